"""The clutch as a declared machine, simulated by the engine, against converged results of another implementation.

Its blocks are cut at measured signals. Here they drive each other: the slip of the plates, which stick, is a state.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch import ensemble
from slipstick.clutch.declared import declare, values_of
from slipstick.clutch.ensemble import initial_input_speed
from slipstick.clutch.model import Model
from slipstick.engine.equations import Problem
from slipstick.engine.trajectory import solve
from slipstick.machine import Profile
from slipstick.machine.declaration import Namespace, identifier_of
from slipstick.machine.system import System, system_of
from tests.benches import COMPACT, HEAVY

AXES = "pressure_bias", "initial_position"
DATA = Path(__file__).parent / "data"
STEP = 1e-3
"""Step in s."""
POINTS = {"heavy": [(1, 1), (0.5, 0.5), (0.5, 1.5), (1.5, 0.5), (1.5, 1.5)],
          "compact": [(1, 1), (0.8, 1.2), (1.2, 0.8)]}
"""Factors of the parameters `AXES`."""


SIGNALS = "pressure", "input_speed", "output_speed", "output_torque"


def couple(bench: Bench) -> System:
    """Return the equations of valve, plates, load and input shaft, in which the plates' slip is a state."""
    valve, load, _, shaft, plates = map(system_of, declare(bench).blocks)
    gear = values_of(bench)["gear_ratio"]

    def read(x: Any, u: Any, q: Any, p: Any) -> Namespace:
        """Return the inputs with the signals; plates that slip backward turn their torque around."""
        apart = Namespace(**{**vars(u), "pressure": x.pressure, "output_speed": x.output_speed, "lock_up": 0.0,
                             "input_speed": gear * (np.abs(x.slip) + x.output_speed)})
        torque = x.slip_side * plates.output(x, apart, q, p)
        return Namespace(**{**vars(apart), "output_torque": torque})

    def rate(x: Any, u: Any, q: Any, p: Any) -> tuple[Any, ...]:
        known = read(x, u, q, p)
        x.input_speed = gear * (x.slip + x.output_speed)
        accelerated = load.rate(x, known, q, p)
        output = np.where((x.output_speed <= 0) & (accelerated < 0), 0, accelerated)
        return (*valve.rate(x, known, q, p), *plates.rate(x, known, q, p),
                shaft.rate(x, known, q, p) / gear - output, output)

    def start(u: Any, q: Any, p: Any) -> tuple[Any, ...]:
        pressure = valve.start(u, q, p)
        known = Namespace(**{**vars(u), "pressure": pressure[0]})
        return (*pressure, *plates.start(known, q, p), shaft.start(u, q, p) / gear, 0.0)

    def give(x: Any, u: Any, q: Any, p: Any) -> tuple[Any, ...]:
        return x.slip, x.pressure, gear * (x.slip + x.output_speed), x.output_speed, read(x, u, q, p).output_torque

    states = (*valve.states, *plates.states, "slip", "output_speed")
    return System(states, ("slip", *SIGNALS), rate, start, give,
                  lowest=(*[-np.inf] * (len(states) - 1), 0.0), switches=(len(states) - 2,))


def simulate(bench: Bench, conditions: Conditions, **changed: float) -> tuple[np.ndarray, np.ndarray]:
    """Return instants (k,) in s, and the slip in rad/s with `SIGNALS` (n, 5, k), with factors of parameters."""
    profile, shape = conditions.current_profile, (len(conditions), 1)
    corners = Profile(np.asarray(conditions.profile_time)[profile], np.asarray(conditions.profile_current)[profile])
    time = np.arange(0, corners.time.max(), STEP)
    initial, column = initial_input_speed(bench.physics.curves, np.array([bench.physics.nominal]), conditions)
    values = {name: np.full(shape, value * changed.get(name, 1.0)) for name, value in values_of(bench).items()}
    values |= {name: np.zeros(shape) for name in ("load_kick", "input_kick", "start", "sag")}
    values |= {name: getattr(conditions, name)[:, None] for name in ("motor_speed", "load_inertia", "brake_torque")}
    inputs = {"current": corners.approximate(time), "stated_motor_speed": conditions.motor_speed[:, None],
              "first_input_speed": initial[0, column][:, None], "given_torque": 0.0}
    quantities = {identifier_of(each.name): 0.0 for each in declare(bench).quantities}
    return time, solve(Problem(couple(bench), STEP, inputs, quantities, values)).outputs


@pytest.mark.parametrize("bench", [HEAVY, COMPACT], ids=lambda bench: bench.name)
def test_shifting_times_agree_on_many_conditions_and_all_points(bench: Bench) -> None:
    some = np.arange(0, len(bench.conditions), 5)  # all levels of all conditions
    conditions = bench.conditions.take(some)
    folder = DATA / bench.name if bench is COMPACT else DATA
    reference = np.loadtxt(folder / "shifting_times.csv", delimiter=",", skiprows=1)[:, 1:].T
    for (bias, position), exact in zip(POINTS[bench.name], reference, strict=True):
        time, outputs = simulate(bench, conditions, pressure_bias=bias, initial_position=position)
        slip, runs = outputs[:, 0], np.arange(len(outputs))
        last = (slip <= 0).argmax(axis=1) - 1  # before the plates stick
        shifted = time[last] + STEP * slip[runs, last] / (slip[runs, last - 1] - slip[runs, last])
        np.testing.assert_allclose(shifted, exact[some], atol=1e-4)


@pytest.mark.parametrize("condition", [0, 100, 215])
def test_signals_agree_while_the_load_rests_the_plates_slip_and_stick(condition: int) -> None:
    rows = np.loadtxt(DATA / "trajectories.csv", delimiter=",", skiprows=1)
    rows = rows[rows[:, 0] == condition]
    time, outputs = simulate(HEAVY, HEAVY.conditions.take([condition]))
    at = np.round(rows[:, 1] / STEP).astype(int)
    np.testing.assert_allclose(time[at], rows[:, 1], atol=1e-9)
    for column, name in enumerate(SIGNALS, start=2):
        error = np.abs(outputs[0, column - 1, at] - rows[:, column])
        assert np.max(error) < 1e-3 * np.ptp(rows[:, column]), name
    assert (outputs[0, 0, at] == 0).mean() > 0.2


def test_plates_break_away_as_those_of_the_lanes_do() -> None:
    """The current falls after the plates stick, so that they slip again under the load."""
    conditions = HEAVY.conditions.take(np.arange(0, 216, 27))
    current = conditions.profile_current.copy()
    current[:, -1] = current[:, 0]
    released = replace(conditions, profile_current=current)
    time, outputs = simulate(HEAVY, released)
    lanes = ensemble.signals(Model(HEAVY.physics), released, time, AXES, np.ones((1, 2)), ensemble.TIGHT)
    sticks = outputs[:, 0] == 0
    assert (sticks.mean(axis=1) > 0.2).all()
    assert (outputs[:, 0, -1] > 0).all()  # slips again
    for place, name in enumerate(SIGNALS, start=1):
        signal = getattr(lanes, name)[0]
        np.testing.assert_allclose(outputs[:, place], signal, atol=1e-3 * np.ptp(signal), err_msg=name)
