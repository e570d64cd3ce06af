"""The fit of section III.B: a genetic algorithm on the likelihood by expansion, then a polish on the model itself.

A fit is a state that `advance` moves on by one generation: JSON, complete, and the same after a restart.

    state = start(settings, dimension)
    while not finished(settings, state):
        state = advance(settings, problem, state)
    result = conclude(settings, problem, state)
"""

from dataclasses import asdict
from typing import Any

import numpy as np
from scipy.optimize import minimize

from slipstick.errors import InvalidValue
from slipstick.uncertainty.bounds import chased, open_directions, remarks
from slipstick.uncertainty.expansion import hermite_basis
from slipstick.uncertainty.genetic import Population, Search, ask, empty, tell
from slipstick.uncertainty.inputs import axis_mass_outside, count_outside, mass_outside, normal_germs
from slipstick.uncertainty.likelihood import Candidate, Problem, by_expansion, exact
from slipstick.uncertainty.settings import FitSettings
from slipstick.uncertainty.unknowns import Box, box, candidate, nominal, vector

__all__ = ["Candidate", "FitSettings", "Problem", "State", "advance", "conclude", "finished", "progress", "start"]

State = dict[str, Any]
"""JSON: the population (`points`, `fitness`), `generation`, and `history`, the best log10 likelihood after each."""

_EVALUATIONS = 600
_FIRST_RADIUS, _LAST_RADIUS = 0.05, 1e-4  # of the polish, as shares of the box


def start(settings: FitSettings, dimension: int) -> State:
    """The state before the first generation, for d inputs."""
    hermite_basis(dimension, settings.order, settings.nodes)  # refuses what cannot be expanded, before a job runs
    return {**empty().to_dict(), "history": []}


def advance(settings: FitSettings, problem: Problem, state: State) -> State:
    """Return the state one generation on; the same for the same state, also after a round trip through JSON.

    The first generation holds the nominal model. Raises `InvalidValue` where no candidate has any likelihood.
    """
    limits = box(settings, problem)
    search = Search(limits.lower, limits.upper, settings.population, settings.seed)
    population = Population.from_dict(state)
    vectors = ask(search, population)
    if population.generation == 0:
        vectors[0] = vector(nominal(problem, limits))
    likelihood = _by_expansion(settings, problem, [candidate(row) for row in vectors])
    population = tell(search, population, vectors, likelihood.sum(axis=1))
    if not np.isfinite(population.fitness[0]):
        lost = np.flatnonzero(np.all(np.isneginf(likelihood), axis=0)).tolist() or "each another"
        raise InvalidValue(f"No candidate gives all conditions a likelihood (conditions at fault: {lost})",
                           "Leave out conditions that do not lock here, or narrow mean_bounds and std_bounds")
    return {**population.to_dict(), "history": [*state["history"], float(population.fitness[0])]}


def finished(settings: FitSettings, state: State) -> bool:
    """Whether the generations are used up, or the last `patience` of them gained no more than `tolerance`."""
    history = state["history"]
    if len(history) <= settings.patience:
        return len(history) >= settings.generations
    stalled = history[-1] - history[-1 - settings.patience] <= settings.tolerance
    return stalled or len(history) >= settings.generations


def progress(settings: FitSettings, state: State) -> dict[str, Any]:
    """How far the fit is and the best so far, by expansion; None before the first generation."""
    best: dict[str, Any] = {"mean": None, "std": None, "output_std": None, "log10_likelihood": None}
    if state["generation"]:
        best = {**_spell(candidate(np.array(state["points"][0]))), "log10_likelihood": state["history"][-1]}
    return {"generation": state["generation"], "generations": settings.generations, **best,
            "history": list(state["history"])}


def conclude(settings: FitSettings, problem: Problem, state: State) -> dict[str, Any]:
    """Polish the best candidate, and report it as JSON.

    `log10_likelihood` is the exact one, per ms, with the model run at the samples; `expansion_error` what the
    expansion adds to it at the same candidate, `sampling_error` what other samples add, in decades. `before` is
    the nominal model with the noise that suits it, `genetic` the best of the genetic algorithm.
    """
    limits, germs = box(settings, problem), normal_germs(len(problem.lower), settings.samples, settings.seed)
    others = normal_germs(len(problem.lower), settings.samples, settings.seed + 1)
    genetic = candidate(np.array(state["points"][0]))
    found = polish(problem, limits, genetic, germs) if settings.polish else genetic
    likelihood = exact(problem, found, germs)
    whole = float(likelihood.sum())
    sampling_error = float(exact(problem, found, others).sum()) - whole
    gain = whole - float(exact(problem, genetic, germs).sum())
    nodes = found.inputs.points(hermite_basis(len(problem.lower), settings.order, settings.nodes).nodes)
    return {
        **_spell(found),
        "log10_likelihood": _finite(whole),
        "log10_likelihood_per_condition": [_finite(value) for value in likelihood.tolist()],
        "expansion_error": _finite(float(_by_expansion(settings, problem, [found]).sum()) - whole),
        "sampling_error": _finite(sampling_error),
        "before": _account(settings, problem, nominal(problem, limits), germs),
        "genetic": _account(settings, problem, genetic, germs),
        "mass_outside": mass_outside(found.inputs, problem.lower, problem.upper, germs),
        "axis_mass_outside": axis_mass_outside(found.inputs, problem.lower, problem.upper).tolist(),
        "nodes_outside": count_outside(nodes, problem.lower, problem.upper),
        "nodes": len(nodes),
        "remarks": [asdict(remark) for remark in
                    remarks(problem, limits, found) + chased(settings.samples, sampling_error)
                    + open_directions(problem.axes, genetic, found, gain)],
        "generations": state["generation"],
        "history": list(state["history"]),
    }


def polish(problem: Problem, limits: Box, begin: Candidate, germs: np.ndarray) -> Candidate:
    """Climb from `begin` to the nearest maximum of the exact likelihood at fixed germs (m, d), within the box.

    COBYQA, without derivatives: of scipy's bounded local methods it came nearest to the best maximum over all our
    starts, along ridges that run into a bound; those with gradients stopped up to a decade short.
    """
    span = limits.upper - limits.lower

    def loss(share: np.ndarray) -> float:
        unknowns = limits.lower + np.clip(share, 0.0, 1.0) * span
        return -float(exact(problem, candidate(unknowns), germs).sum())

    first = (vector(begin) - limits.lower) / span
    best = minimize(loss, first, method="COBYQA", bounds=[(0.0, 1.0)] * len(span),
                    options={"maxfev": _EVALUATIONS, "initial_tr_radius": _FIRST_RADIUS,
                             "final_tr_radius": _LAST_RADIUS})
    if not best.fun < loss(first):
        return begin
    return candidate(limits.lower + np.clip(best.x, 0.0, 1.0) * span)


def _by_expansion(settings: FitSettings, problem: Problem, candidates: list[Candidate]) -> np.ndarray:
    dimension = len(problem.lower)
    basis = hermite_basis(dimension, settings.order, settings.nodes)
    return by_expansion(problem, candidates, basis, normal_germs(dimension, settings.samples, settings.seed))


def _account(settings: FitSettings, problem: Problem, found: Candidate, germs: np.ndarray) -> dict[str, Any]:
    return {**_spell(found), "log10_likelihood": _finite(float(exact(problem, found, germs).sum())),
            "log10_likelihood_by_expansion": _finite(float(_by_expansion(settings, problem, [found]).sum()))}


def _spell(found: Candidate) -> dict[str, Any]:
    return {"mean": found.inputs.mean.tolist(), "std": found.inputs.marginal_std.tolist(),
            "output_std": found.output_std}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
