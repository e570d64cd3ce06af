"""The fit of section III.B: a search for the greatest likelihood, and its refinement on the exact one.

A search is a state that `advance` moves on by one generation, or one block of the classic grid: JSON, complete, and the
same after a restart.

    state = searched(settings, problem)  # start, and advance until finished
    estimate = refined(settings, problem, state)
    while not profiled(settings, estimate):
        estimate = profile(settings, problem, estimate)
    result = conclude(settings, problem, state, estimate)
"""

from dataclasses import asdict
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.expansion import make_basis
from slipstick.uncertainty.fit import classic
from slipstick.uncertainty.fit.bounds import polynomial_remarks, remarks
from slipstick.uncertainty.fit.genetic import Population, Search, ask, empty, tell
from slipstick.uncertainty.fit.intervals import combinations, direction_of, profile_interval, widest_identified_interval
from slipstick.uncertainty.fit.refine import local_problem, refined_vector
from slipstick.uncertainty.fit.search_space import nominal_candidate, search_space
from slipstick.uncertainty.fit.settings import FitSettings
from slipstick.uncertainty.likelihood.likelihood import by_expansion, by_sampling, converged, exact
from slipstick.uncertainty.likelihood.local import PolynomialModel
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns
from slipstick.uncertainty.outside import axis_mass_outside, mass_outside
from slipstick.uncertainty.sampling import standard_normals

_BETTER = 0.01  # decades by which a profile must beat the estimate to take its place

SearchState = dict[str, Any]
"""JSON: the best candidates so far (`points`, best first, and their `fitness`), the `generation` they are of, how many
`generations` there are at most, and `history`, the best log10 likelihood after each. A block of the classic grid counts
as a generation."""
Estimate = dict[str, Any]
"""JSON: the vector of unknowns `found` (k,), the `polynomial_error` in s where polynomials stood for the model, the
`combinations` of the unknowns, and the `intervals` so far, first those of the unknowns, then those of the identified
combinations."""


def initial_state(settings: FitSettings, problem: InferenceProblem) -> SearchState:
    """The state before the first generation; refuses what cannot be searched, before a job runs."""
    space = search_space(settings, problem)
    for corner in (space.lower, space.upper):
        space.candidate(corner)
    middle = space.candidate((space.lower + space.upper) / 2)
    make_basis(middle.inputs.germs, settings.expansion(len(space.axes)))
    if settings.method == "classic" and classic.candidate_count(settings, space) > classic.MOST_CANDIDATES:
        raise InvalidValue(f"A grid of {settings.grid} values of {len(space.lower)} unknowns has "
                           f"{classic.candidate_count(settings, space):.2g} candidates, which take weeks",
                           "Take a coarser grid or fewer unknowns, or the genetic method")
    count = classic.block_count(settings, space) if settings.method == "classic" else settings.generations
    return {**empty().to_dict(), "generations": count, "history": []}


def next_state(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> SearchState:
    """Return the state one generation on; the same for the same state, also after a round trip through JSON.

    The first generation holds the nominal model. Raises `InvalidValue` where no candidate has any likelihood.
    """
    space, population = search_space(settings, problem), Population.from_dict(state)
    search = Search(space.lower, space.upper, settings.population, settings.seed)
    if settings.method == "classic":
        vector, highest = classic.best_of_block(settings, problem, space, population.generation)
        vectors, fitness = vector[None], np.array([highest])
    else:
        vectors = ask(search, population)
        if population.generation == 0:
            vectors[0] = space.vector(nominal_candidate(problem, space))
        likelihood = _searched(settings, problem, [space.candidate(row) for row in vectors])
        fitness = likelihood.sum(axis=1)
    population = tell(search, population, vectors, fitness)
    if settings.method == "genetic" and not np.isfinite(population.fitness[0]):
        lost = np.flatnonzero(np.all(np.isneginf(likelihood), axis=0)).tolist() or "others for each"
        raise InvalidValue(f"No candidate gives all conditions a likelihood (conditions at fault: {lost})",
                           "Leave out conditions that do not lock here, or narrow mean_bounds and std_bounds")
    return {**state, **population.to_dict(), "history": [*state["history"], _finite(float(population.fitness[0]))]}


def is_finished(settings: FitSettings, state: SearchState) -> bool:
    """Whether all is searched, or the last `patience` generations gained no more than `tolerance`."""
    history: list[float] = state["history"]
    if len(history) >= state["generations"]:
        return True
    if settings.method == "classic" or len(history) <= settings.patience:
        return False
    return history[-1] - history[-1 - settings.patience] <= settings.tolerance


def final_state(settings: FitSettings, problem: InferenceProblem) -> SearchState:
    """The state at the end of a search that nothing interrupts."""
    state = initial_state(settings, problem)
    while not is_finished(settings, state):
        state = next_state(settings, problem, state)
    return state


def progress(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> dict[str, Any]:
    """How far the search is and the best so far; None before there is any."""
    best: dict[str, Any] = {"mean": None, "std": None, "output_std": None, "correlation": None}
    if state["history"] and state["history"][-1] is not None:
        best = _spell(search_space(settings, problem).candidate(np.array(state["points"][0])))
    return {"generation": state["generation"], "generations": state["generations"], **best,
            "log10_likelihood": state["history"][-1] if state["history"] else None, "history": list(state["history"])}


def refined_estimate(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> Estimate:
    """What a climb on the exact likelihood reaches from the best of the search, without intervals yet."""
    best = np.array(state["points"][0])
    if state["fitness"][0] is None:
        raise InvalidValue("No candidate of the grid gives all conditions a likelihood",
                           "Take a finer grid, or narrow mean_bounds and std_bounds")
    space = search_space(settings, problem)
    return _estimate(problem, space, refined_vector(problem, space, best) if settings.refine else best)


def has_all_intervals(settings: FitSettings, estimate: Estimate) -> bool:
    """Whether the estimate has all its intervals."""
    return not settings.intervals or len(estimate["intervals"]) == len(estimate["vector"]) + len(_identified(estimate))


def with_next_interval(settings: FitSettings, problem: InferenceProblem, estimate: Estimate) -> Estimate:
    """The estimate with one more profile-likelihood interval.

    Where its profile rises above the estimate, that was no maximum: then it is a better one, without intervals.
    """
    space, found, done = search_space(settings, problem), np.array(estimate["vector"]), estimate["intervals"]
    others = [direction_of(space, np.array(one["weights"])) for one in _identified(estimate)]
    direction = [*np.eye(len(found)), *others][len(done)]
    one = profile_interval(problem, space, found, direction, settings.level)
    if settings.refine and one.curve[:, 1].min() < -_BETTER:
        better = refined_vector(problem, space, one.highest)
        before, after = (float(exact(problem, space.candidate(vector)).sum()) for vector in (found, better))
        if after > before + _BETTER:
            return _estimate(problem, space, better)
    told = {"estimate": one.estimate, "lower": one.lower, "upper": one.upper, "unsettled": list(one.unsettled),
            "level": one.level, "curve": one.curve.tolist()}
    return {**estimate, "intervals": [*done, told]}


def summary(settings: FitSettings, problem: InferenceProblem, state: SearchState, estimate: Estimate) -> dict[str, Any]:
    """Report a fit as JSON.

    `log10_likelihood` is the exact one, per ms; `expansion_error` what the likelihood of the search adds to it at the
    same candidate, and `sampling_error` what other lines change in it, in decades. `before` is the nominal model with
    the noise that suits it, `searched` the best of the search.
    """
    space, vector = search_space(settings, problem), np.array(estimate["vector"])
    candidate = space.candidate(vector)
    likelihood, sampling_error = converged(problem, candidate, settings.seed)
    whole = float(likelihood.sum())
    normals = standard_normals(len(space.axes), settings.samples, settings.seed)
    of_unknowns, others = estimate["intervals"][:len(vector)], iter(estimate["intervals"][len(vector):])
    return {
        "axes": list(space.axes), "families": list(space.families), "support": space.support.tolist(),
        "method": settings.method, "refined": settings.refine,
        **_spell(candidate),
        "log10_likelihood": _finite(whole),
        "log10_likelihood_per_condition": [_finite(value) for value in likelihood.tolist()],
        "expansion_error": _finite(float(_searched(settings, problem, [candidate]).sum()) - whole),
        "sampling_error": _finite(sampling_error),
        "before": _account(settings, problem, nominal_candidate(problem, space)),
        "searched": _account(settings, problem, space.candidate(np.array(state["points"][0]))),
        "intervals": [{"unknown": name, **one} for name, one in zip(space.names, of_unknowns, strict=False)],
        "combinations": [_combination(space, one, next(others, None) if one["identified"] else None)
                         for one in estimate["combinations"]],
        "mass_outside": mass_outside(candidate.inputs, problem.lower, problem.upper, normals),
        "axis_mass_outside": axis_mass_outside(candidate.inputs, problem.lower, problem.upper).tolist(),
        "polynomial_error": estimate["polynomial_error"],
        "remarks": [asdict(one) for one in (*remarks(problem, space, vector),
                                            *polynomial_remarks(estimate["polynomial_error"], candidate.output_std))],
        "generations": state["generation"],
        "history": list(state["history"]),
    }


def _identified(estimate: Estimate) -> list[dict[str, Any]]:
    return [one for one in estimate["combinations"] if one["identified"]]


def _combination(space: Unknowns, one: dict[str, Any], ends: dict[str, Any] | None) -> dict[str, Any]:
    """A combination with its interval, which has the last word on whether it is identified."""
    identified = one["identified"]
    if ends is not None:
        closed = ends["lower"] is not None and ends["upper"] is not None
        identified = closed and ends["upper"] - ends["lower"] < widest_identified_interval(ends["level"])
    return {**one, "weights": dict(zip(space.names, one["weights"], strict=True)), "identified": identified,
            "interval": ends}


def _estimate(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> Estimate:
    vector = space.vector(space.candidate(vector)) if "beta" in space.families else vector  # whose std has its limit
    near, _ = local_problem(problem, space, vector)
    error = near.model.error if isinstance(near.model, PolynomialModel) else None
    found = [{**asdict(one), "weights": one.weights.tolist()} for one in combinations(near, space, vector)]
    return {"vector": vector.tolist(), "polynomial_error": error, "combinations": found, "intervals": []}


def _searched(settings: FitSettings, problem: InferenceProblem, candidates: list[Candidate]) -> np.ndarray:
    """log10 p (c, n) as the search takes it."""
    if settings.integration == "lines" and settings.method == "genetic":
        return by_expansion(problem, candidates, settings.expansion(len(problem.axes)))
    normals = standard_normals(len(problem.axes), settings.samples, settings.seed)
    return by_sampling(problem, candidates, settings.expansion(len(problem.axes)), normals)


def _account(settings: FitSettings, problem: InferenceProblem, candidate: Candidate) -> dict[str, Any]:
    return {**_spell(candidate),
            "log10_likelihood": _finite(float(converged(problem, candidate, settings.seed)[0].sum())),
            "log10_likelihood_by_expansion": _finite(float(_searched(settings, problem, [candidate]).sum()))}


def _spell(candidate: Candidate) -> dict[str, Any]:
    inputs = candidate.inputs
    return {"mean": inputs.mean.tolist(), "std": inputs.marginal_std.tolist(), "output_std": candidate.output_std,
            "correlation": None if inputs.correlation is None else inputs.correlation.tolist()}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
