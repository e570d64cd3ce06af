"""The classic grid against a slow loop that shares nothing: every candidate, every sample, by itself."""

import json
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import norm, qmc

from slipstick.uncertainty.fit import FitSettings, classic, fit
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem

TINY = FitSettings(method="classic", grid=3, samples=32, seed=5, refine=False, intervals=False,
                   mean_bounds=((0.9, 1.1),), std_bounds=((0.01, 0.1),), output_std_bounds=(0.002, 0.02))


@pytest.fixture(scope="module")
def small() -> InferenceProblem:
    """Six engagements of a model that curves, and has no time at large values of the first input."""
    slopes = np.random.default_rng(3).uniform(-0.2, 0.2, (2, 6))

    def model(points: np.ndarray, conditions: Any) -> np.ndarray:
        times = 0.5 + np.sinh((points - 1.0) @ slopes)
        times[points[:, 0] > 1.15, 0] = np.nan
        return times

    measured = 0.5 + 0.02 * np.random.default_rng(4).standard_normal(6)
    return InferenceProblem(model, None, measured, np.full(2, 0.5), np.full(2, 1.5), ("a", "b"))


def slow(settings: FitSettings, problem: InferenceProblem) -> tuple[list[float], float, int]:
    """The best of all candidates, in the unknowns' own scale."""
    levels = [np.linspace(*settings.mean_bounds[0], settings.grid)] * 2
    levels += [np.geomspace(*settings.std_bounds[0], settings.grid)] * 2
    levels += [np.geomspace(*settings.output_std_bounds, settings.grid)]
    levels += [np.linspace(-0.98, 0.98, settings.grid)] * settings.correlated
    normals = qmc.MultivariateNormalQMC(np.zeros(2), rng=settings.seed).random(settings.samples)
    best, highest, count = [], -np.inf, 0
    for values in product(*levels):
        count += 1
        first, second, std_1, std_2, noise = values[:5]
        rho = values[5] if settings.correlated else 0.0
        logs = np.full((settings.samples, 6), -np.inf)
        for row, (one, other) in enumerate(normals):
            point = [first + std_1 * one, second + std_2 * (rho * one + np.sqrt(1 - rho**2) * other)]
            logs[row] = norm.logpdf(1e3 * problem.measured_time, 1e3 * problem.model(np.array([point]), None)[0],
                                    1e3 * noise)
        whole = float(np.sum(logsumexp(np.where(np.isnan(logs), -np.inf, logs), axis=0)
                             - np.log(settings.samples)) / np.log(10))
        if whole > highest:
            best, highest = list(values), whole
    return best, highest, count


@pytest.mark.parametrize("changes", [{}, {"correlated": True, "grid": 2}])
def test_its_best_node_is_the_best_of_all_candidates(small: InferenceProblem, changes: dict[str, Any]) -> None:
    settings = replace(TINY, **changes)
    space = search_space(settings, small)
    expected, highest, count = slow(settings, small)
    assert classic.candidate_count(settings, space) == count
    found = [classic.best_of_block(settings, small, space, block) for block in range(classic.block_count(settings, space))]
    vector, reached = max(found, key=lambda one: one[1])
    np.testing.assert_allclose(reached, highest, rtol=1e-12)
    np.testing.assert_allclose([*vector[:2], *np.exp(vector[2:5]), *vector[5:]], expected, rtol=1e-12)
    assert len({tuple(one[0][:2]) for one in found}) == settings.grid**2  # each block has means of its own


def test_blocks_resume_after_json(small: InferenceProblem) -> None:
    straight = begun = fit.initial_state(TINY, small)
    assert begun["generations"] == 9
    while not fit.is_finished(TINY, straight):
        straight = fit.next_state(TINY, small, straight)
    for _ in range(4):
        begun = fit.next_state(TINY, small, begun)
    revived = json.loads(json.dumps(begun, allow_nan=False))
    while not fit.is_finished(TINY, revived):
        revived = fit.next_state(TINY, small, revived)
    assert revived == straight
    assert straight["history"] == sorted(straight["history"])
    np.testing.assert_allclose(straight["history"][-1], slow(TINY, small)[1], rtol=1e-12)


def test_a_grid_without_any_likelihood_has_none(small: InferenceProblem) -> None:
    lost = InferenceProblem(lambda points, conditions: np.full((len(points), 6), np.nan), None, small.measured_time, small.lower,
                   small.upper, small.axes)
    vector, highest = classic.best_of_block(TINY, lost, search_space(TINY, lost), 0)
    assert highest == -np.inf
    assert np.isfinite(vector).all()
