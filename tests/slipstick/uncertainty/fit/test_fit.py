"""The complete fit: reproducibility, comparison with a global optimizer of SciPy, and remarks on bounds."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from slipstick.errors import InvalidValue, UnknownName
from slipstick.uncertainty import Inputs, fit
from slipstick.uncertainty.fit import FitSettings, SearchState
from slipstick.uncertainty.fit.bounds import polynomial_remarks
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, by_expansion, exact

QUICK = FitSettings(order=4, population=24, patience=12, intervals=False)


def through_json(state: SearchState) -> SearchState:
    decoded: SearchState = json.loads(json.dumps(state, allow_nan=False))
    return decoded


def run(settings: FitSettings, problem: InferenceProblem, state: SearchState | None = None,
        generations: int = 1000) -> SearchState:
    state = state or fit.initial_state(settings, problem)
    while not fit.is_finished(settings, state) and generations:
        state, generations = fit.next_state(settings, problem, state), generations - 1
    return state


def conclude(settings: FitSettings, problem: InferenceProblem, state: SearchState) -> dict[str, Any]:
    estimate = fit.refined_estimate(settings, problem, state)
    while not fit.has_all_intervals(settings, estimate):
        estimate = fit.with_next_interval(settings, problem, estimate)
    return fit.summary(settings, problem, state, estimate)


@pytest.fixture(scope="module")
def finished(problem: InferenceProblem) -> SearchState:
    return run(QUICK, problem)


@pytest.mark.slow
def test_a_search_is_bit_identical_for_any_number_of_threads() -> None:
    """The rounding of BLAS depends on the number of threads, but a fit must not."""
    code = (
        "import numpy as np\n"
        "from slipstick.uncertainty import fit\n"
        "from slipstick.uncertainty.likelihood import InferenceProblem\n"
        "slope = np.random.default_rng(1).uniform(-0.2, 0.2, (2, 216))\n"
        "def model(points, conditions): return 0.5 + np.einsum('md,dn->mn', np.exp(points), slope)\n"
        "problem = InferenceProblem(model, None, np.full(216, 0.5), np.full(2, 0.5), np.full(2, 1.5), ('a', 'b'))\n"
        "settings = fit.FitSettings()\n"
        "print(fit.next_state(settings, problem, fit.initial_state(settings, problem)))\n"
    )
    digests = [
        hashlib.sha256(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True,
                                      env={**os.environ, "OPENBLAS_NUM_THREADS": threads}).stdout).hexdigest()
        for threads in ("1", "2")
    ]
    assert digests[0] == digests[1]


@pytest.mark.slow
def test_agrees_with_differential_evolution(problem: InferenceProblem) -> None:
    """Within 5 decades before the refinement, with a third of the evaluations, and as good after the refinement."""
    generations = 25
    space, evaluations = search_space(QUICK, problem), 0

    def loss(vectors: np.ndarray) -> np.ndarray:
        nonlocal evaluations
        evaluations += vectors.shape[1]
        return -by_expansion(problem, [space.candidate(row) for row in vectors.T], QUICK.expansion(2)).sum(axis=1)

    oracle = differential_evolution(loss, list(zip(space.lower, space.upper, strict=True)), rng=1, maxiter=30,
                                    popsize=15, tol=1e-6, polish=False, vectorized=True, updating="deferred")
    assert evaluations > 3 * generations * QUICK.population
    expected = exact(problem, space.candidate(oracle.x)).sum()
    for seed in (1, 2):
        state = run(replace(QUICK, seed=seed, generations=generations, patience=generations), problem)
        best = -loss(np.array(state["points"][0])[:, None])[0]
        assert best > -oracle.fun - 5.0
        vector = fit.refined_estimate(QUICK, problem, state)["vector"]
        assert exact(problem, space.candidate(np.array(vector))).sum() > expected - 0.05
    first = np.array(run(QUICK, problem, generations=1)["points"][0])
    assert -loss(first[:, None])[0] < -oracle.fun - 5.0  # negative control: not met by the first generation


def test_recovers_the_true_inputs(problem: InferenceProblem, truth: Candidate, finished: SearchState) -> None:
    result = conclude(QUICK, problem, finished)
    at_truth = exact(problem, truth).sum()
    assert at_truth < result["log10_likelihood"] < at_truth + 5
    np.testing.assert_allclose(result["mean"], truth.inputs.mean, atol=0.02)
    np.testing.assert_allclose(result["std"], truth.inputs.marginal_std, atol=0.015)
    np.testing.assert_allclose(result["output_std"], truth.output_std, atol=0.002)
    assert result["remarks"] == []


def test_result_is_json_and_consistent(problem: InferenceProblem, finished: SearchState) -> None:
    result = conclude(QUICK, problem, finished)
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    assert result == conclude(QUICK, problem, through_json(finished))
    np.testing.assert_allclose(sum(result["log10_likelihood_per_condition"]), result["log10_likelihood"])
    assert result["before"]["log10_likelihood"] < result["searched"]["log10_likelihood"] - 10
    assert result["log10_likelihood"] > result["searched"]["log10_likelihood"]
    assert 0 < abs(result["expansion_error"]) < 1
    assert 0 < result["sampling_error"] < 0.05
    unrefined = conclude(replace(QUICK, refine=False), problem, finished)
    assert unrefined["log10_likelihood"] == unrefined["searched"]["log10_likelihood"]
    np.testing.assert_allclose(unrefined["searched"]["log10_likelihood_by_expansion"], finished["history"][-1],
                               rtol=1e-9)


def test_progress_and_termination(problem: InferenceProblem) -> None:
    settings = replace(QUICK, patience=4, tolerance=0.2)
    initial = fit.initial_state(settings, problem)
    assert fit.progress(settings, problem, initial)["log10_likelihood"] is None
    progress = fit.progress(settings, problem, run(settings, problem))
    history = progress["history"]
    assert 4 < progress["generation"] == len(history) < progress["generations"] == settings.generations
    assert history == sorted(history)
    assert progress["log10_likelihood"] == history[-1]
    # The search ends as soon as the improvement by 4 generations does not exceed the tolerance.
    improvements = [history[k] - history[k - 4] for k in range(4, len(history))]
    assert improvements[-1] <= settings.tolerance
    assert all(improvement > settings.tolerance for improvement in improvements[:-1])
    assert run(replace(settings, generations=2), problem)["generation"] == 2


def test_the_first_generation_contains_the_nominal_model(problem: InferenceProblem) -> None:
    state = run(replace(QUICK, population=4), problem, generations=1)
    before = conclude(replace(QUICK, refine=False), problem, state)["before"]
    assert before["mean"] == [1.0, 1.0]
    np.testing.assert_allclose(before["std"], 0.002)
    residual = problem.model(np.ones((1, 2)), problem.conditions)[0] - problem.measured_time
    np.testing.assert_allclose(before["output_std"], np.sqrt(np.mean(residual**2)))
    assert state["history"][0] >= before["log10_likelihood_by_expansion"] - 1e-9


def remarks(settings: FitSettings, problem: InferenceProblem) -> dict[str, tuple[str, str]]:
    result = conclude(settings, problem, run(settings, problem))
    return {remark["unknown"]: (remark["cause"], remark["remedy"]) for remark in result["remarks"]}


@pytest.mark.slow
def test_a_mean_at_the_edge_of_the_table_gives_a_remark(
        problem_measured_at: Callable[[Candidate], InferenceProblem]) -> None:
    problem = problem_measured_at(Candidate(Inputs([1.2, 1.0], [0.03, 0.03]), 0.004))
    by_unknown = remarks(QUICK, replace(problem, upper=np.array([1.1, 1.5])))
    cause, remedy = by_unknown["mean of pressure_bias"]
    assert "upper edge of the table, 1.1" in cause
    assert "axis pressure_bias reaches above 1.1" in remedy
    assert "pressure_bias" not in by_unknown  # no second remark on the runs outside the table
    # A bound of the search inside the table gives a remark that does not mention the table.
    settings = replace(QUICK, mean_bounds=((0.5, 1.1), (0.5, 1.5)))
    cause, remedy = remarks(settings, problem)["mean of pressure_bias"]
    assert "table" not in cause + remedy


@pytest.mark.slow
def test_scatter_outside_the_table_gives_a_remark(problem_measured_at: Callable[[Candidate], InferenceProblem]) -> None:
    problem = problem_measured_at(Candidate(Inputs([1.05, 1.0], [0.06, 0.03]), 0.004))
    cause, remedy = remarks(QUICK, replace(problem, upper=np.array([1.1, 1.5])))["pressure_bias"]
    assert 5 < float(cause.split(" %")[0]) < 45
    assert "pressure_bias goes from" in remedy


def test_data_without_scatter_give_a_remark(problem_measured_at: Callable[[Candidate], InferenceProblem]) -> None:
    problem = problem_measured_at(Candidate(Inputs([1.04, 0.97], [0.0, 0.0]), 0.004))
    by_unknown = remarks(QUICK, problem)
    of_stds = [cause for name, (cause, _) in by_unknown.items() if name.startswith("std of ")]
    assert of_stds
    assert all("lower bound, 0.002" in cause for cause in of_stds)


@pytest.mark.slow
def test_stds_at_the_upper_bounds_give_remarks(problem: InferenceProblem) -> None:
    tight = replace(QUICK, std_bounds=((0.002, 0.01),), output_std_bounds=(0.0005, 0.003))
    by_unknown = remarks(tight, problem)
    assert "upper bound, 0.01" in by_unknown["std of pressure_bias"][0]
    assert "upper bound, 3 ms" in by_unknown["output std"][0]
    assert "lacks" in by_unknown["output std"][1]


def test_a_condition_that_never_locks_is_named_in_the_error(problem: InferenceProblem) -> None:
    def partial(points: np.ndarray, conditions: object) -> np.ndarray:
        times = problem.model(points, conditions)
        times[:, 17] = np.nan
        return times

    with pytest.raises(InvalidValue, match=r"\[17\]"):
        run(QUICK, replace(problem, model=partial), generations=1)


def test_a_region_where_conditions_never_lock_is_avoided(problem: InferenceProblem) -> None:
    """Candidates with nodes in the region have a likelihood of 0, but the search succeeds."""
    def partial(points: np.ndarray, conditions: object) -> np.ndarray:
        times = problem.model(points, conditions)
        times[points[:, 0] - points[:, 1] > 0.25] = np.nan
        return times

    settings = replace(QUICK, generations=10)
    result = conclude(settings, replace(problem, model=partial), run(settings, replace(problem, model=partial)))
    assert result["log10_likelihood"] >= result["searched"]["log10_likelihood"]
    assert result["searched"]["log10_likelihood_by_expansion"] is not None


def test_one_input() -> None:
    """The times are proportional to the input."""
    random = np.random.default_rng(2)
    slope = random.uniform(0.5, 1.0, 100)
    measured = slope * random.normal(1.1, 0.03, 100) + 0.002 * random.standard_normal(100)
    problem = InferenceProblem(lambda points, conditions: points * conditions, slope, measured, np.array([0.5]),
                               np.array([1.5]), ("gain",))
    state = fit.initial_state(QUICK, problem)
    while not fit.is_finished(QUICK, state):
        state = fit.next_state(QUICK, problem, state)
    result = conclude(QUICK, problem, state)
    np.testing.assert_allclose(result["mean"] + result["std"], [1.1, 0.03], atol=0.01)


def test_a_search_finds_the_same_in_any_unit_and_says_the_unit(problem: InferenceProblem) -> None:
    """A factor of a power of two changes no rounding, so that the searches agree but for logarithms."""
    settings, factor = replace(QUICK, generations=2, refine=False), 2.0**26
    other = replace(problem, model=lambda points, conditions: factor * problem.model(points, conditions), unit="Pa",
                    measured_time=factor * problem.measured_time, output_std_bounds=(factor * 0.0005, factor * 0.1))
    results = [conclude(settings, posed, run(settings, posed)) for posed in (problem, other)]
    for name in ("mean", "std"):
        np.testing.assert_allclose(results[1][name], results[0][name], rtol=1e-6)
    np.testing.assert_allclose(results[1]["output_std"], factor * results[0]["output_std"], rtol=1e-6)
    bound = replace(other, output_std_bounds=(factor * 0.05, factor * 0.1))
    cause, = [remark["cause"] for remark in conclude(settings, bound, run(settings, bound))["remarks"]
              if remark["unknown"] == "output std"]
    assert cause == "The output std is at its lower bound, 3.355e+06 Pa"
    remark, = polynomial_remarks(3e6, 4e6, "Pa")
    assert "an error of 3e+06 Pa, and the output std is 4e+06 Pa" in remark.cause


def test_a_fit_of_an_earlier_version_states_its_bounds() -> None:
    assert FitSettings().output_std_bounds is None
    stored = {**FitSettings().to_dict(), "output_std_bounds": [0.0005, 0.1]}
    assert FitSettings.from_dict(json.loads(json.dumps(stored))).output_std_bounds == (0.0005, 0.1)
    assert FitSettings.from_dict(json.loads(json.dumps(FitSettings().to_dict()))) == FitSettings()


def test_settings_are_converted_to_json_and_back_and_checked() -> None:
    settings = replace(QUICK, mean_bounds=((0.5, 1.5), (0.6, 1.4)), tolerance=1 / 3)
    assert FitSettings.from_dict(json.loads(json.dumps(settings.to_dict()))) == settings
    with pytest.raises(UnknownName, match="Did you mean 'population'"):
        FitSettings.from_dict({"populaton": 40})
    for wrong in ({"population": 1}, {"samples": 1000}, {"families": ("cauchy",)}, {"method": "guess"}, {"level": 1.0},
                  {"tolerance": float("nan")}, {"patience": 0},
                  {"std_bounds": ((1e-300, 0.1),)}, {"std_bounds": ((0.01, 1e9),)},
                  {"std_bounds": ((0.0, 0.1),)}, {"mean_bounds": ((1.5, 0.5),)}, {"output_std_bounds": (1e-3,)}):
        with pytest.raises((InvalidValue, UnknownName)):
            FitSettings(**wrong)  # type: ignore[arg-type]


@pytest.mark.slow
def test_families_correlation_and_the_classic_grid(problem: InferenceProblem) -> None:
    short = replace(QUICK, generations=6)
    for settings in (replace(short, families=("gamma", "beta")), replace(short, correlated=True),
                     replace(short, families=("lognormal", "uniform"), refine=False),
                     replace(QUICK, method="classic", grid=3, samples=64)):
        state = run(settings, problem)
        result = conclude(settings, problem, state)
        assert json.loads(json.dumps(result, allow_nan=False)) == result
        assert result["log10_likelihood"] >= result["searched"]["log10_likelihood"] - 1e-6
    assert state["generation"] == 9  # one block for each choice of the means


@pytest.mark.slow
def test_seven_inputs(truth: Candidate) -> None:
    """Seven inputs of a linear model, without a tensor grid, refined on local expansions."""
    random = np.random.default_rng(7)
    slope = random.uniform(-0.2, 0.2, (8, 7))

    def model(points: np.ndarray, conditions: np.ndarray) -> np.ndarray:
        return 1.0 + (points - 1.0) @ conditions.T

    drawn = random.normal(1.0, 0.05, (8, 7))
    measured = 1.0 + np.sum((drawn - 1.0) * slope, axis=1) + 0.003 * random.standard_normal(8)
    seven = InferenceProblem(model, slope, measured, np.full(7, 0.5), np.full(7, 1.5), tuple("abcdefg"))
    settings = replace(QUICK, order=1, generations=5)
    result = conclude(settings, seven, run(settings, seven))
    known = Candidate(Inputs(np.ones(7), np.full(7, 0.05)), 0.003)
    assert result["log10_likelihood"] > exact(seven, known).sum()
    assert result["polynomial_error"] < 1e-9  # of a linear model
    assert result["log10_likelihood"] > result["searched"]["log10_likelihood"]
