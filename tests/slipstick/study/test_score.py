from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch import effects
from slipstick.study import score
from slipstick.study.mixed import MixedFit
from tests.benches import HEAVY


def test_the_statistic_counts_experiments_and_not_what_they_weigh() -> None:
    rng = np.random.default_rng(0)
    each = rng.standard_normal((400, 3))
    np.testing.assert_allclose(score.statistic(each), score.statistic(1e6 * each))
    assert score.statistic(each).max() < 12
    assert score.statistic(each + 0.5).min() > 40


def test_efficient_scores_leave_nothing_that_a_refit_would_take(linear_fit: MixedFit) -> None:
    integrated = linear_fit.marginal
    onto, information, kept = score._efficient(integrated, 2)  # the third column as if it were a probe
    total = integrated.information.sum(axis=0)
    np.testing.assert_allclose(onto[0].T @ total[:, :2], 0, atol=1e-6 * total.max())
    assert information[0] == pytest.approx(1 / np.linalg.inv(total)[2, 2], rel=1e-6)
    assert 0 < kept[0] < 1


def test_a_trend_of_the_scatter_leaves_nothing_of_a_drift_like_it(linear_fit: MixedFit) -> None:
    run = np.linspace(-1, 1, 60)
    gram = linear_fit.about.gram.copy()  # the third column becomes the first one, drifting
    gram[:, :, 2] = gram[:, :, 0] * run[:, None]
    gram[:, :, :, 2] = gram[:, :, :, 0] * run[:, None]
    gram[:, :, 2, 2] = gram[:, :, 0, 0] * run**2
    drifting = replace(linear_fit, about=replace(linear_fit.about, gram=gram)).marginal
    trend = np.zeros((60, 3, 1))
    trend[:, 0, 0] = run
    assert score._efficient(drifting, 2)[2][0] > 0.5
    assert score._efficient(drifting, 2, trend)[2][0] < 1e-3


def test_halves_of_the_experiments_choose_the_form_that_all_show_and_share_what_few_do() -> None:
    rng, n = np.random.default_rng(6), 60
    each = 0.1 * rng.standard_normal((n, 4))
    each[:, 0] += 1.0  # every experiment says the first
    one = score.Scores((), each, np.ones(4), np.ones(4), np.ones(4), np.ones(4))
    np.testing.assert_allclose(one.selected(1), [1, 0, 0, 0])
    each[:, 1] = each[:, 0] + 0.3 * rng.standard_normal(n)  # and the second is hardly another
    shared = replace(one, each=each).selected(1)
    assert shared.sum() == pytest.approx(1)
    assert shared[2:].max() == 0
    assert 0.1 < shared[1] < 0.9
    each[:, 0] = each[:, 1] = 0.0
    each[0, 2] = 50.0  # one experiment alone is in half of the halves, the others are chance
    assert 0.5 <= replace(one, each=each).selected(1)[2] < 0.8


def test_an_autoregression_is_stationary_and_remembers() -> None:
    drawn = score.autoregression(np.random.default_rng(1), (20_000, 2), 0.8)
    assert drawn.std() == pytest.approx(1, rel=0.05)
    assert np.corrcoef(drawn[1:, 0], drawn[:-1, 0])[0, 1] == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize("memory", [0.0, 0.6])
def test_the_memory_of_the_scatter_is_found_beside_a_trend(linear_fit: MixedFit, memory: float) -> None:
    rng, order = np.random.default_rng(2), np.random.default_rng(3).permutation(60)
    found = []
    for _ in range(60):
        wandering = score.autoregression(rng, (60, 2), memory) + 3 * np.linspace(-1, 1, 60)[:, None]
        modes = 0.05 * wandering[order]
        found.append(score.remembered(replace(linear_fit, state=replace(linear_fit.state, modes=modes)), order))
    assert np.mean(found) == pytest.approx(memory, abs=0.08)
    assert score.remembered(linear_fit, None) == 0.0


def test_probes_try_every_amplitude_and_several_shapes() -> None:
    tried = score.probes([effect.name for effect in effects.CATALOGUE if effect.listed], HEAVY)
    assert {probe.effect for probe in tried} == {effect.name for effect in effects.CATALOGUE if effect.listed}
    decays = [dict(probe.shape)["decay_speed"] for probe in tried if probe.effect == "stribeck_friction"]
    assert len(decays) == 3
    assert min(decays) < effects.find("stribeck_friction").on(HEAVY.scales).typical[1] < max(decays)
