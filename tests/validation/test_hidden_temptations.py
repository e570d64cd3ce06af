"""Temptations of the simulated test bench change what they state (tests/validation/hidden/temptations.py)."""

from pathlib import Path

import numpy as np
import pytest
from hidden import Case, World, generate, simulate, write
from hidden.case import further
from hidden.nominal import HEAVY
from hidden.temptations import TEMPTATIONS, oil_temperature, second_batch, tempted

from slipstick.recordings import Recordings

COUNT = 8


def tempting(name: str, **world: float) -> Case:
    return Case(count=COUNT, shift="none", scatter=0, world=tempted(World(**world), 1, [name]))


def test_two_batches_have_other_levels_and_other_noise() -> None:
    case = tempting("batches", conditions=0.02)
    run, _, signals = generate(case, relative=1e-4)
    later = second_batch(run.order)
    assert sum(later) == COUNT / 2
    nominal, actual = HEAVY.motor_speed[run.conditions], run.bench.motor_speed
    errors = [{level: set((actual / nominal)[half & (nominal == level)].round(9)) for level in set(nominal)}
              for half in (later, ~later)]
    assert all(len(values) <= 1 for half in errors for values in half.values())
    assert errors[0] != errors[1]
    std = np.std(signals["input_speed"] - run.readings["input_speed"], axis=1)
    assert std[later].mean() / std[~later].mean() == pytest.approx(1.3 / 0.7, rel=0.1)


def test_the_ambient_changes_speed_and_brake_torque_over_the_test_sequence() -> None:
    run = simulate(tempting("ambient"), relative=1e-4)
    assert np.array_equal(run.bench.load_inertia, HEAVY.load_inertia[run.conditions])
    for actual, nominal in ((run.bench.motor_speed, HEAVY.motor_speed), (run.bench.brake_torque, HEAVY.brake_torque)):
        change = (actual / nominal[run.conditions])[np.argsort(run.order)]
        assert abs(change[-1] - change[0]) == pytest.approx(0.02)
        np.testing.assert_allclose(np.diff(change), change[1] - change[0])


def test_one_sensor_is_loud_and_bad_runs_are_many() -> None:
    loud = TEMPTATIONS["loud_sensor"](World(), np.random.default_rng(1))
    assert (list((loud.noise or {}).values()), list((loud.memory or {}).values())) == ([0.03], [0.9])
    assert TEMPTATIONS["many_bad_runs"](World(bad_runs=0.02), np.random.default_rng(1)).bad_runs == 0.1


def test_a_thermometer_writes_the_oil_temperature_and_changes_nothing_else(tmp_path: Path) -> None:
    case = tempting("thermometer")
    run, _, signals = generate(case, relative=1e-4)
    plain = generate(Case(count=COUNT, shift="none", scatter=0), relative=1e-4)[2]
    np.testing.assert_equal(signals, plain)
    write(tmp_path / "case.h5", case, relative=1e-4)
    channel = Recordings.open(tmp_path / "case.h5").further["oil_temperature"]
    assert channel.unit == "degC"
    np.testing.assert_allclose(channel.values, further(case, run)["oil_temperature"])
    np.testing.assert_allclose(channel.values.mean(axis=1), run.bench.channels["oil_temperature"], atol=0.1)


def test_an_effect_over_the_oil_temperature_is_recorded_with_it() -> None:
    run = simulate(Case({"piston_gain_follows_the_oil": 0.1}, count=COUNT), relative=1e-4)
    assert run.bench.channels["oil_temperature"].shape == (COUNT,)


def test_the_oil_is_warmed_twice_so_that_its_temperature_is_not_the_run_order() -> None:
    order = np.arange(54)
    temperature = oil_temperature(order, np.random.default_rng(3))
    assert (temperature[:5].mean(), temperature[-5:].mean()) == pytest.approx((46, 87), abs=4)
    assert temperature[18:22].mean() > temperature[22:26].mean() + 8
