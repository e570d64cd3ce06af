"""The clutch as a declared machine: its plates against the lanes, and fitted to recordings."""

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.clutch.declared import declare, runs_of, values_of
from slipstick.clutch.ensemble import TIGHT, signals
from slipstick.clutch.model import Model
from slipstick.engine.approach import approach
from slipstick.engine.equations import Problem
from slipstick.engine.fit import fit
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.trajectory import solve
from slipstick.machine.declaration import Block, identifier_of
from slipstick.machine.system import system_of
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Recordings
from tests.benches import BENCHES, HEAVY, TABLES


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    """Six of the shipped recordings, cut at the plates."""
    recordings = Recordings.open(TABLES / "measured.h5")
    scene = Scene.of(HEAVY, recordings, NamingSettings())
    whole = prepare(declare(HEAVY), runs_of(HEAVY, recordings, scene.slipping, scene.locked), values_of(HEAVY))
    return next(group for group in whole.groups() if group.parts[0].name == "clutch").take(np.arange(6))


def _plates(bench: Bench) -> Block:
    return next(block for block in declare(bench).blocks if block.name == "clutch")


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_the_torque_of_slipping_plates_is_that_of_the_lanes(bench: Bench, factor: float) -> None:
    """For given pressure and speeds, at each 27th condition, to a thousandth of the largest torque."""
    conditions, step = bench.conditions.take(np.arange(0, len(bench.conditions), 27)), 2e-4
    time = np.arange(0, conditions.profile_time[:, -1].min(), step)
    axes, point = ("pressure_bias", "initial_position"), np.array([[factor, 2 - factor]])
    read = signals(Model(bench.physics), conditions, time, axes, point, TIGHT)
    values = {name: np.full((len(conditions), 1), value) for name, value in values_of(bench).items()}
    values |= {name: scale * values[name] for name, scale in zip(axes, point[0], strict=True)}
    block = _plates(bench)
    inputs = {name: getattr(read, name)[0] for name in ("pressure", "input_speed", "output_speed")}
    quantities = {identifier_of(quantity.name): 0.0 for quantity in block.quantities}
    torque = solve(Problem(system_of(block), step, inputs, quantities, values)).outputs[:, 0]
    slip = inputs["input_speed"] / values["gear_ratio"] - inputs["output_speed"]
    slipping = slip > 0.01 * slip.max()
    assert slipping.mean() > 0.1
    lanes = read.output_torque[0]
    np.testing.assert_allclose(torque[slipping], lanes[slipping], atol=1e-3 * lanes.max())


@pytest.mark.slow
def test_runs_that_steps_of_all_drive_away_are_fitted_from_where_each_is_by_itself(recorded: Recorded) -> None:
    together = fit(recorded, {}, {})
    state, _ = approach(recorded)
    apart = fit(recorded, {}, {}, state, state.points.var(axis=0))
    assert apart.evidence > together.evidence + 1000
    before, after = (each.chi_square["clutch"].max() for each in (together, apart))
    assert before > 200
    assert after < 7  # an effect is missing in these recordings
    assert np.abs(apart.state.points).max() < 0.8  # none is at the end of what a parameter may change
