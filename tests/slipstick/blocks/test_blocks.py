"""Every block, driven by simulated signals without noise, against the signal that the compiled simulator gives."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipstick.bench import Bench, parameters
from slipstick.blocks import Clutch, Friction, Input, Load, Valve
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.errors import BadRecording
from slipstick.recordings import Recordings, Signals
from tests.benches import BENCHES, HEAVY

both = pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)


@cache
def exact(bench: Bench) -> tuple[Recordings, np.ndarray, ensemble.Response]:
    """Recordings without noise, in which every parameter of the model differs from run to run."""
    conditions = bench.conditions.take(range(0, len(bench.conditions), 9))
    n, rng = len(conditions), np.random.default_rng(3)
    vectors = np.array(bench.physics.nominal) * rng.uniform(0.97, 1.03, (n, len(parameters.NAMES)))
    coefficients = np.tile(Model(bench.physics).coefficients(), (n, 1))
    time = np.arange(0.0, 1.7, bench.sample_time)
    true = ensemble.simulate(bench.physics.curves, vectors, coefficients, conditions, time, ensemble.TIGHT, paired=True)
    signals = Signals(time, true.pressure, true.input_speed, true.output_speed, true.output_torque)
    return Recordings(conditions, true.shifting_time, signals), vectors, true


def slipping(bench: Bench) -> np.ndarray:
    """Samples before lock-up; at lock-up the torque jumps between two samples, which no block can know."""
    recordings, _, true = exact(bench)
    assert recordings.signals is not None
    return np.asarray(recordings.signals.time < true.shifting_time[:, None])


@both
def test_the_valve_is_exact_and_any_other_parameter_leaves_it(bench: Bench) -> None:
    recordings, vectors, true = exact(bench)
    valve = Valve.of(recordings)
    assert np.abs(valve.predict(vectors) - true.pressure).max() < 2e-4  # bar, of the simulator's steps
    others = vectors.copy()
    own = [parameters.index(name) for name in valve.parameters]
    others[:, [column for column in range(20) if column not in own]] *= 1.1
    np.testing.assert_array_equal(valve.predict(others), valve.predict(vectors))
    for column in own:
        moved = vectors.copy()
        moved[:, column] *= 1.01
        assert np.abs(valve.predict(moved) - true.pressure).max() > 0.01


@both
def test_the_load_follows_the_torque_from_breakaway_on(bench: Bench) -> None:
    recordings, vectors, true = exact(bench)
    load, noise = Load.of(recordings), bench.sensors["output_speed"].noise
    assert noise
    assert np.abs((load.predict(vectors) - true.output_speed) * slipping(bench)).max() < 0.3 * noise
    weaker = replace(load, brake=0.9 * load.brake)
    assert np.abs(weaker.predict(vectors) - true.output_speed).max() > noise
    assert np.all(replace(load, brake=load.brake + load.torque.max()).predict(vectors) == 0)


@both
def test_the_input_is_integrated_far_below_the_sampling_time(bench: Bench) -> None:
    recordings, vectors, true = exact(bench)
    shaft, noise = Input.of(recordings, bench.physics), bench.sensors["input_speed"].noise
    assert noise
    predicted = shaft.predict(vectors)
    assert np.abs((predicted - true.input_speed) * slipping(bench)).max() < 0.5 * noise
    assert np.abs(replace(shaft, steps=8).predict(vectors) - predicted).max() < 0.01 * noise
    heavier = vectors.copy()
    heavier[:, parameters.index("input_inertia")] *= 1.02
    assert np.abs(shaft.predict(heavier) - true.input_speed).max() > noise


@both
def test_the_clutch_closes_its_piston_under_the_measured_pressure(bench: Bench) -> None:
    recordings, vectors, true = exact(bench)
    clutch, stroke = Clutch.of(recordings), vectors[:, parameters.index("contact_position")]
    position = clutch.piston_position(vectors)
    assert np.abs(position - true.piston_position).max() < 1e-3 * stroke.max()
    error = (clutch.predict(vectors) - true.output_torque) * slipping(bench)
    assert np.abs(error).max() < 2e-3 * true.output_torque.max()
    full = slipping(bench) & (true.piston_position >= stroke[:, None])
    assert full.any(axis=1).all()
    np.testing.assert_allclose(Friction.of(recordings).predict(vectors)[full], true.output_torque[full], rtol=1e-6)


def test_a_block_needs_signals() -> None:
    with pytest.raises(BadRecording, match="driven by measured signals"):
        Valve.of(replace(exact(HEAVY)[0], signals=None))
