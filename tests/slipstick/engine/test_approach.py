"""Where a fit begins, of runs whose signals tell nothing of the way to the right parameters."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine import approach as approaching
from slipstick.engine.approach import approach, approach_each
from slipstick.engine.fit import begin, fit
from slipstick.engine.laws import list_candidates
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

RUNS, NOISE, WIDTH = 40, 0.02, 0.02
TIME = np.linspace(0, 1, 201)


def declare() -> Machine:
    """A tooth that passes a sensor: one that is expected elsewhere tells neither where it is nor on which side."""
    tooth = Block("tooth", gives="voltage", reads=("angle",),
                  parameters=(Parameter("place", value=0.5, scale=1.0, scatter=0.1, within=0.1),),
                  quantities=(Quantity("size", relative=True, over=("run order",)),))
    tooth.output(lambda x, u, q, p: (1 + q.size) * np.exp(-((u.angle - p.place) / WIDTH) ** 2))
    return Machine("gear", (tooth,), (Sensor("voltage"),), commands=(Command("angle"),))


@pytest.fixture(scope="module")
def places() -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.1, 0.1, RUNS)


@pytest.fixture(scope="module")
def recorded(places: np.ndarray) -> Recorded:
    voltage = np.exp(-((TIME - 0.5 - places[:, None]) / WIDTH) ** 2)
    voltage += NOISE * np.random.default_rng(2).standard_normal(voltage.shape)
    angle = Profile(np.tile([0.0, 1.0], (RUNS, 1)), np.tile([0.0, 1.0], (RUNS, 1)))
    return prepare(declare(), Runs(TIME, {"voltage": voltage}, {"angle": angle}, order=np.arange(RUNS, dtype=float)))


def count_away(points: np.ndarray, places: np.ndarray) -> int:
    return int((np.abs(points[:, 0] - places) > 0.5 * WIDTH).sum())


def test_runs_that_no_step_leads_to_are_reached_by_draws_from_the_others(
        recorded: Recorded, places: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> None:
    state, left = approach(recorded)
    assert count_away(state.points, places) <= 2
    assert np.median(left) == pytest.approx(1, abs=0.2)
    monkeypatch.setattr(approaching, "_DRAWS", 1)  # the median of the others alone
    assert count_away(approach(recorded)[0].points, places) > 10


def test_a_fit_of_all_goes_on_from_there(recorded: Recorded, places: np.ndarray) -> None:
    state, left = approach(recorded)
    good = np.flatnonzero(left < 2)
    fitted = fit(recorded.take(good), {}, {}, state.take(good), state.points.var(axis=0))
    assert fitted.converged
    assert count_away(fitted.state.points, places[good]) == 0
    assert fit(recorded, {}, {}).evidence < fitted.evidence - 1000  # steps of all from nominal parameters


def test_runs_are_fitted_beside_a_law_that_stays_as_it_is(recorded: Recorded, places: np.ndarray) -> None:
    law = next(each for each in list_candidates(recorded, {"tooth": {}}) if each.pair == ("size", "run order"))
    near = replace(begin(recorded), points=places[:, None] + 0.3 * WIDTH, laws={law.pair: np.full(law.count, 0.1)})
    state = approach_each(recorded, {law.pair: law}, near)
    assert count_away(state.points, places) == 0
    np.testing.assert_array_equal(state.laws[law.pair], 0.1)
