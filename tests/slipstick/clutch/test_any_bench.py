"""Benches that are not the nominal one: no converter, a measured current, and profiles of any length."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.bench import Bench, Conditions, Physics
from slipstick.bench.experiments import stacked
from slipstick.clutch import ensemble, reference
from slipstick.clutch.model import Model
from tests.benches import BENCHES, COMPACT, HEAVY

SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque", "piston_position")
SAMPLES = np.arange(0.0, 1.5, 0.02)


def without_converter(bench: Bench, input_torque: float, input_speed: float) -> tuple[Model, Conditions]:
    n = len(bench.conditions)
    return (Model(Physics(bench.physics.nominal, None)),
            replace(bench.conditions, input_torque=np.full(n, input_torque),
                    initial_input_speed=np.full(n, input_speed)))


def compare(model: Model, conditions: Conditions, condition: int) -> float:
    """Shifting time; the compiled simulator agrees with its readable twin in it, and in all signals."""
    time, signals = reference.simulate(model, conditions, condition, SAMPLES)
    fast = ensemble.signals(model, conditions.take([condition]), SAMPLES, accuracy=ensemble.TIGHT)
    np.testing.assert_allclose(fast.shifting_time[0, 0], time, rtol=0, atol=1e-5)
    for k, name in enumerate(SIGNALS):
        assert np.max(np.abs(getattr(fast, name)[0, 0] - signals[:, k])) < 1e-4 * np.ptp(signals[:, k]), name
    return time


@pytest.mark.parametrize(("bench", "torque", "speed"), [(HEAVY, 150.0, 140.0), (COMPACT, 25.0, 200.0),
                                                        (COMPACT, 30.0, 0.0)],
                         ids=["heavy", "compact", "from standstill"])
def test_a_constant_input_torque_agrees_with_the_reference_implementation(bench: Bench, torque: float,
                                                                          speed: float) -> None:
    model, conditions = without_converter(bench, torque, speed)
    assert 0.05 < compare(model, conditions, len(bench.conditions) // 2) < bench.profiles[0].max()
    # And the torque acts: another one gives another time.
    times = [ensemble.shifting_times(*without_converter(bench, one, speed))[0][0, 0] for one in (torque, 1.05 * torque)]
    assert abs(times[1] - times[0]) > 1e-4


def test_before_the_plates_touch_the_input_torque_accelerates_the_input_shaft() -> None:
    model, conditions = without_converter(COMPACT, 25.0, 100.0)
    model = model.with_parameters({"film_coefficient": 0.0})
    response = ensemble.signals(model, conditions.take([0]), np.array([0.0, 0.05]))
    p = dict(zip(("inertia", "coulomb", "viscous"), model.parameters[15:18], strict=True))
    # J w' = T - T_c - b w, solved for the speed after 50 ms.
    limit = (25.0 - p["coulomb"]) / p["viscous"]
    expected = limit + (100.0 - limit) * np.exp(-p["viscous"] * 0.05 / p["inertia"])
    assert response.input_speed[0, 0, 0] == 100.0
    assert response.input_speed[0, 0, 1] == pytest.approx(expected, rel=1e-8)
    assert abs(expected / 100 - 1) > 0.05


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_a_measured_current_is_the_profile_that_it_samples(bench: Bench) -> None:
    # Every breakpoint is a multiple of 1 ms: the samples of a 1 kHz measurement describe the same current.
    time, current = bench.profiles
    end = time[:, -1]
    assert np.allclose(np.round(1e3 * time), 1e3 * time, atol=1e-9)
    samples = [np.arange(round(1e3 * one) + 1) / 1e3 for one in end]
    measured = stacked([(t, np.interp(t, time[p], current[p])) for p, t in enumerate(samples)])
    assert measured[0].shape[1] > 1000
    sampled = replace(bench.conditions, profile_time=measured[0], profile_current=measured[1])
    model = Model(bench.physics)
    times, status = ensemble.shifting_times(model, bench.conditions, accuracy=ensemble.TIGHT)
    again, other = ensemble.shifting_times(model, sampled, accuracy=ensemble.TIGHT)
    np.testing.assert_array_equal(status, other)
    np.testing.assert_allclose(again, times, rtol=0, atol=1e-6)
    # A current that is 1 % higher is another one.
    higher = replace(sampled, profile_current=1.01 * measured[1])
    assert np.min(np.abs(ensemble.shifting_times(model, higher, accuracy=ensemble.TIGHT)[0] - times)) > 1e-4


def test_a_noisy_measured_current_agrees_with_the_reference_implementation() -> None:
    rng, bench = np.random.default_rng(4), COMPACT
    time = np.arange(91) / 50
    profile = bench.profiles[0][0], bench.profiles[1][0]
    current = np.interp(time, *profile) + 0.005 * rng.standard_normal(len(time))
    n = len(bench.conditions)
    conditions = replace(bench.conditions, current_profile=np.zeros(n, np.int64), profile_time=time[None],
                         profile_current=current[None])
    compare(Model(bench.physics), conditions, 40)


def test_padding_a_profile_does_not_change_what_is_simulated() -> None:
    time, current = COMPACT.profiles
    dense = np.linspace(0, 1.8, 60)
    padded = stacked([*zip(time, current, strict=True), (dense, np.full(60, 0.5))])
    assert padded[0].shape == (6, 60)
    conditions = replace(COMPACT.conditions, profile_time=padded[0], profile_current=padded[1])
    model = Model(COMPACT.physics)
    short, long = (ensemble.shifting_times(model, one, accuracy=ensemble.TIGHT)[0]
                   for one in (COMPACT.conditions, conditions))
    np.testing.assert_allclose(long, short, rtol=0, atol=1e-6)


@pytest.mark.parametrize("condition", [0, 89])
def test_the_second_bench_agrees_with_the_reference_implementation(condition: int) -> None:
    compare(Model(COMPACT.physics), COMPACT.conditions, condition)


def test_a_measured_input_torque_agrees_with_the_reference_implementation() -> None:
    model, conditions = without_converter(COMPACT, 0.0, 150.0)
    time = np.arange(0.0, 1.8005, 0.005)
    profiles = [(time, np.interp(time, *(column[p] for column in COMPACT.profiles)), 25.0 + 4.0 * np.sin(20.0 * time))
                for p in range(len(COMPACT.profiles[0]))]
    times, currents, torques = stacked(profiles)
    varying = replace(conditions, profile_time=times, profile_current=currents, profile_input_torque=torques)
    assert compare(model, varying, 40) > 0.05
    resampled = replace(varying, profile_input_torque=np.full_like(torques, 25.0))
    there, other = (ensemble.shifting_times(model, one)[0] for one in (varying, resampled))
    assert np.nanmax(np.abs(there - other)) > 1e-3
    constant = replace(conditions, profile_input_torque=np.full_like(conditions.profile_time, 25.0))
    steady, _ = ensemble.shifting_times(*without_converter(COMPACT, 25.0, 150.0))
    np.testing.assert_allclose(ensemble.shifting_times(model, constant)[0], steady, rtol=0, atol=1e-12)
    assert varying.digest != resampled.digest
