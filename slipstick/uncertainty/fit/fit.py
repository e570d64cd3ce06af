"""The maximum-likelihood fit of section III.B: a global search, a refinement on the exact likelihood, and intervals.

`next_state` advances a search by one generation, or by one block of the classic grid. The state is JSON and complete,
so that a search can be interrupted and resumed with identical results.

    state = final_state(settings, problem)  # initial_state, then next_state until is_finished
    estimate = refined_estimate(settings, problem, state)
    while not has_all_intervals(settings, estimate):
        estimate = with_next_interval(settings, problem, estimate)
    result = summary(settings, problem, state, estimate)
"""

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.time_budget import Partial
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

_BETTER = 0.01  # smallest improvement in decades by which a point of a profile replaces the estimate

SearchState = dict[str, Any]
"""JSON: the best candidates so far (`points`, best first, and their `fitness`), the number `generation` of completed
generations, the largest number of `generations`, and after each generation the best log10 likelihood, `history`, and
its candidate, `path`. A block of the classic grid counts as a generation."""
Estimate = dict[str, Any]
"""JSON: the `vector` of unknowns (k,), the `polynomial_error` in the unit of the output (None if the model was used
directly), the `combinations` of the unknowns, and the `intervals` computed so far, first those of the unknowns, then
those of the identified combinations, each with the `unknowns` (p, k) on natural scale at the points of its curve."""


def initial_state(settings: FitSettings, problem: InferenceProblem) -> SearchState:
    """The state before the first generation. Raises `InvalidValue` if the settings do not suit the problem."""
    space = search_space(settings, problem)
    for corner in (space.lower, space.upper):
        space.candidate(corner)
    middle = space.candidate((space.lower + space.upper) / 2)
    make_basis(middle.inputs.germs, settings.expansion(len(space.axes)))
    if settings.method == "classic" and classic.candidate_count(settings, space) > classic.MOST_CANDIDATES:
        raise InvalidValue(f"A grid of {settings.grid} values of {len(space.lower)} unknowns has "
                           f"{classic.candidate_count(settings, space):.2g} candidates, which takes weeks",
                           "Take a coarser grid, fewer unknowns, or the genetic method")
    count = classic.block_count(settings, space) if settings.method == "classic" else settings.generations
    return {**empty().to_dict(), "generations": count, "history": [], "path": []}


def next_state(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> SearchState:
    """The state after one more generation; deterministic, also after a round trip through JSON.

    The first generation contains the nominal model. Raises `InvalidValue` if all candidates have a likelihood of 0.
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
        likelihood = _search_likelihood(settings, problem, [space.candidate(row) for row in vectors])
        fitness = likelihood.sum(axis=1)
    population = tell(search, population, vectors, fitness)
    if settings.method == "genetic" and not np.isfinite(population.fitness[0]):
        lost = np.flatnonzero(np.all(np.isneginf(likelihood), axis=0)).tolist() or "different for each candidate"
        raise InvalidValue(f"All candidates have a likelihood of 0 (conditions without a density: {lost})",
                           "Leave out conditions that do not lock, or narrow mean_bounds and std_bounds")
    return {**state, **population.to_dict(), "path": [*state["path"], population.points[0].tolist()],
            "history": [*state["history"], _finite_or_none(float(population.fitness[0]))]}


def is_finished(settings: FitSettings, state: SearchState) -> bool:
    """Whether the search is complete, or the last `patience` generations improved by no more than `tolerance`."""
    history: list[float] = state["history"]
    if len(history) >= state["generations"]:
        return True
    if settings.method == "classic" or len(history) <= settings.patience:
        return False
    return history[-1] - history[-1 - settings.patience] <= settings.tolerance


def final_state(settings: FitSettings, problem: InferenceProblem) -> SearchState:
    """The state at the end of an uninterrupted search."""
    state = initial_state(settings, problem)
    while not is_finished(settings, state):
        state = next_state(settings, problem, state)
    return state


def progress(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> dict[str, Any]:
    """The number of generations and the best candidate so far as JSON; its entries are None before there is one."""
    best: dict[str, Any] = {"mean": None, "std": None, "output_std": None, "correlation": None}
    if state["history"] and state["history"][-1] is not None:
        best = _candidate_dict(search_space(settings, problem).candidate(np.array(state["points"][0])))
    return {"generation": state["generation"], "generations": state["generations"], **best,
            "log10_likelihood": state["history"][-1] if state["history"] else None, "history": list(state["history"])}


def refined_estimate(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> Estimate:
    """The estimate without intervals: the best candidate of the search, refined on the exact likelihood.

    Raises `InvalidValue` if all candidates have a likelihood of 0.
    """
    best = np.array(state["points"][0])
    if state["fitness"][0] is None:
        raise InvalidValue("All candidates of the grid have a likelihood of 0",
                           "Take a finer grid, or narrow mean_bounds and std_bounds")
    space = search_space(settings, problem)
    return _estimate(problem, space, refined_vector(problem, space, best) if settings.refine else best)


def has_all_intervals(settings: FitSettings, estimate: Estimate) -> bool:
    """Whether all intervals of the estimate have been computed."""
    return not settings.intervals or len(estimate["intervals"]) == _interval_count(estimate)


def with_next_interval(settings: FitSettings, problem: InferenceProblem, estimate: Estimate) -> Estimate:
    """The estimate with one more profile-likelihood interval.

    If a profile finds a higher likelihood than the estimate, the estimate was not the maximum. The result is then a new
    estimate, refined from the best point of the profile, without intervals.
    """
    space, vector, intervals = search_space(settings, problem), np.array(estimate["vector"]), estimate["intervals"]
    identified = [direction_of(space, np.array(combination["weights"]))
                  for combination in _identified_combinations(estimate)]
    direction = [*np.eye(len(vector)), *identified][len(intervals)]
    interval = profile_interval(problem, space, vector, direction, settings.level)
    if settings.refine and interval.curve[:, 1].min() < -_BETTER:
        better = refined_vector(problem, space, interval.highest)
        before, after = (float(exact(problem, space.candidate(unknowns)).sum()) for unknowns in (vector, better))
        if after > before + _BETTER:
            return _estimate(problem, space, better)
    entry = {"estimate": interval.estimate, "lower": interval.lower, "upper": interval.upper,
             "unsettled": list(interval.unsettled), "level": interval.level, "curve": interval.curve.tolist(),
             "unknowns": interval.unknowns.tolist()}
    return {**estimate, "intervals": [*intervals, entry]}


def unfinished(settings: FitSettings, state: SearchState, estimate: Estimate | None) -> tuple[list[str], list[str]]:
    """What a fit has done and what is missing, in words; without an `estimate`, it has not been refined."""
    parts = [("search", is_finished(settings, state),
              f"{state['generation']} of at most {state['generations']} generations of the search")]
    if settings.refine:
        parts.append(("refinement", estimate is not None, ""))
    if settings.intervals:
        count = 0 if estimate is None else len(estimate["intervals"])
        extent = f"{count} of {_interval_count(estimate)} intervals" if estimate is not None and count else ""
        parts.append(("intervals", estimate is not None and has_all_intervals(settings, estimate), extent))
    done = [name if is_done else extent for name, is_done, extent in parts if is_done or extent]
    return done, [f"the rest of the {name}" if extent else name for name, is_done, extent in parts if not is_done]


def summary(settings: FitSettings, problem: InferenceProblem, state: SearchState, estimate: Estimate,
            partial: Partial | None = None) -> dict[str, Any]:
    """The result of a fit as JSON; `partial` if its time budget ended before it was complete.

    `log10_likelihood` is the exact likelihood, per ms. `expansion_error` is the likelihood of the search at the same
    candidate minus the exact one, and `sampling_error` is the change by the last doubling of the integration lines,
    both in decades. `before` is the nominal candidate, `searched` the best candidate of the search.
    """
    space, vector = search_space(settings, problem), np.array(estimate["vector"])
    candidate = space.candidate(vector)
    likelihood, sampling_error = _converged_likelihood(settings, problem, candidate)
    total = float(likelihood.sum())
    normals = standard_normals(len(space.axes), settings.samples, settings.seed)
    intervals = [{name: value for name, value in interval.items() if name != "unknowns"}
                 for interval in estimate["intervals"]]
    of_unknowns, of_combinations = intervals[:len(vector)], iter(intervals[len(vector):])
    return {
        "axes": list(space.axes), "families": list(space.families), "support": space.support.tolist(),
        "method": settings.method, "refined": settings.refine,
        **_candidate_dict(candidate),
        "log10_likelihood": _finite_or_none(total),
        "log10_likelihood_per_condition": [_finite_or_none(value) for value in likelihood.tolist()],
        "expansion_error": _finite_or_none(float(_search_likelihood(settings, problem, [candidate]).sum()) - total),
        "sampling_error": _finite_or_none(sampling_error),
        "before": _candidate_summary(settings, problem, nominal_candidate(problem, space)),
        "searched": _candidate_summary(settings, problem, space.candidate(np.array(state["points"][0]))),
        "intervals": [{"unknown": name, **interval} for name, interval in zip(space.names, of_unknowns, strict=False)],
        "combinations": [_combination(space, combination,
                                      next(of_combinations, None) if combination["identified"] else None)
                         for combination in estimate["combinations"]],
        "mass_outside": mass_outside(candidate.inputs, problem.lower, problem.upper, normals),
        "axis_mass_outside": axis_mass_outside(candidate.inputs, problem.lower, problem.upper).tolist(),
        "polynomial_error": estimate["polynomial_error"],
        "remarks": [asdict(remark) for remark in (
            *remarks(problem, space, vector),
            *polynomial_remarks(estimate["polynomial_error"], candidate.output_std, problem.unit))],
        "generations": state["generation"],
        "history": list(state["history"]),
        "partial": None if partial is None else asdict(partial),
    }


def _interval_count(estimate: Estimate) -> int:
    return len(estimate["vector"]) + len(_identified_combinations(estimate))


def _identified_combinations(estimate: Estimate) -> list[dict[str, Any]]:
    return [combination for combination in estimate["combinations"] if combination["identified"]]


def _combination(space: Unknowns, combination: dict[str, Any], interval: dict[str, Any] | None) -> dict[str, Any]:
    """A combination with its interval; the width of the interval, if any, determines whether it is identified."""
    identified = combination["identified"]
    if interval is not None:
        is_closed = interval["lower"] is not None and interval["upper"] is not None
        identified = (is_closed
                      and interval["upper"] - interval["lower"] < widest_identified_interval(interval["level"]))
    return {**combination, "weights": dict(zip(space.names, combination["weights"], strict=True)),
            "identified": identified, "interval": interval}


def _estimate(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> Estimate:
    if "beta" in space.families:  # the candidate limits the std of a beta input
        vector = space.vector(space.candidate(vector))
    local, _ = local_problem(problem, space, vector)
    error = local.model.error if isinstance(local.model, PolynomialModel) else None
    entries = [{**asdict(combination), "weights": combination.weights.tolist()}
               for combination in combinations(replace(local, lattice=None), space, vector)]
    return {"vector": vector.tolist(), "polynomial_error": error, "combinations": entries, "intervals": []}


def _search_likelihood(settings: FitSettings, problem: InferenceProblem, candidates: list[Candidate]) -> np.ndarray:
    """log10 p (c, n) by the method of the search."""
    if settings.integration == "lines" and settings.method == "genetic":
        return by_expansion(problem, candidates, settings.expansion(len(problem.axes)))
    normals = standard_normals(len(problem.axes), settings.samples, settings.seed)
    return by_sampling(problem, candidates, settings.expansion(len(problem.axes)), normals)


def _converged_likelihood(settings: FitSettings, problem: InferenceProblem,
                          candidate: Candidate) -> tuple[np.ndarray, float]:
    """The likelihood that the refinement and the intervals maximise, and its error: without lattices."""
    return converged(problem, candidate, settings.seed, lattices=False)


def _candidate_summary(settings: FitSettings, problem: InferenceProblem, candidate: Candidate) -> dict[str, Any]:
    return {**_candidate_dict(candidate),
            "log10_likelihood": _finite_or_none(float(_converged_likelihood(settings, problem, candidate)[0].sum())),
            "log10_likelihood_by_expansion": _finite_or_none(
                float(_search_likelihood(settings, problem, [candidate]).sum()))}


def _candidate_dict(candidate: Candidate) -> dict[str, Any]:
    inputs = candidate.inputs
    return {"mean": inputs.mean.tolist(), "std": inputs.marginal_std.tolist(), "output_std": candidate.output_std,
            "correlation": None if inputs.correlation is None else inputs.correlation.tolist()}


def _finite_or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None
