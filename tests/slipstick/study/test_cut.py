"""The model cut at the measured signals, held against its own simulation: what is left is noise where it is right."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch import ensemble
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.study import locate, study
from slipstick.study.comparison import WIDTH
from slipstick.study.cut import cut
from slipstick.study.settings import StudySettings
from tests.benches import HEAVY

Studied = Callable[[str], tuple[Any, Any, dict[str, Any]]]


@pytest.fixture(scope="module")
def fitted(studied: Studied) -> tuple[Any, Any, Any]:
    """Settings, comparison and the last fit of the study of the shipped recordings, whose model has an effect in it."""
    compared, state, _ = studied("friction")
    settings = StudySettings()
    compared = study.observed(compared, state)
    return compared, study.restore(settings, compared, state["rounds"][0]), study.restore(
        settings, compared, state["rounds"][-1])


def simulated(compared: Any, found: Any, seed: int | None) -> Any:
    """The comparison with signals of the fitted model instead, with noise where there is a seed."""
    signals, conditions = compared.recordings.signals, compared.recordings.conditions
    response = ensemble.simulate(HEAVY.physics.converter, *found.design.vectors(found.points), conditions, signals.time,
                                 paired=True)
    rng = None if seed is None else np.random.default_rng(seed)
    made = Signals(signals.time, *(
        getattr(response, name) + (0 if rng is None else np.sqrt(WIDTH) * compared.noise[name]
                                   * rng.standard_normal(signals.pressure.shape)) for name in SIGNAL_UNITS))
    return replace(compared, recordings=replace(compared.recordings, signals=made,
                                                measured_time=response.shifting_time))


def squares(blocks: locate.Blocks) -> dict[str, float]:
    """Mean square of each block, the instant of lock-up apart."""
    return {name: float(np.nanmean(np.where(blocks.phase >= 0, values, np.nan) ** 2))
            for name, values in blocks.residual.items()}


def test_a_model_leaves_nothing_of_its_own_simulation(fitted: tuple[Any, Any, Any]) -> None:
    compared, _, found = fitted
    made = simulated(compared, found, None)
    seen = cut(made, found, 1)
    assert max(squares(seen.left).values()) < 1e-9
    # The equations of the cut alone do not know the effect.
    assert squares(locate.blocks(made, found))["output_torque"] > 10
    assert seen.simulated.output_torque == pytest.approx(made.recordings.signals.output_torque)


def test_noise_leaves_one(fitted: tuple[Any, Any, Any]) -> None:
    compared, _, found = fitted
    for value in squares(cut(simulated(compared, found, 5), found, 1).left).values():
        assert value == pytest.approx(1.0, rel=0.2)


def test_a_model_without_the_effect_leaves_it(fitted: tuple[Any, Any, Any]) -> None:
    compared, before, found = fitted
    left = squares(cut(simulated(compared, found, 5), before, 1).left)
    assert left["output_torque"] > 10
    assert left["pressure"] < 1.5


def test_an_engagement_that_never_locks_is_no_error(fitted: tuple[Any, Any, Any]) -> None:
    compared, before, _ = fitted
    theta = before.state.theta.copy()
    theta[before.design.parameters.index("friction_coefficient")] = 0.05
    seen = cut(compared, replace(before, state=replace(before.state, theta=theta)), 1)
    assert squares(seen.left)["output_torque"] > 100


def test_without_signals_there_is_none(studied: Studied) -> None:
    compared, state, _ = studied("times")
    found = study.restore(StudySettings(), compared, state["rounds"][0])
    assert cut(compared, found, 1) is None
