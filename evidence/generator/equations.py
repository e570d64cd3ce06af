"""The equations of the bench, in which effects can change every quantity: hydraulics, clutch, and shafts.

Each part adds its quantities, (n,) each, to `q`, and sets the `rates` of its states; they are evaluated in this order.
"""

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from .bench import Bench
from .states import (
    CONTACT,
    CONVERTER,
    ENERGY,
    FRICTION,
    HEAT,
    INPUT,
    MAGNET,
    OUTPUT,
    PISTON,
    POSITION,
    PRESSURE,
    RATE,
    REST,
    STICK,
    TWIST,
    Quantities,
)

RING_DAMPING = 0.08  # damping ratio of the shaft oscillation after lock-up
MAGNET_TIME = 0.12  # s, time constant of the lagged current
COOLING_TIME = 0.3  # s, time constant of the cooling of the plates


class Lanes(Protocol):
    """What the equations need of n engagements: see engagements.py."""

    values: Mapping[str, np.ndarray]
    motor_speed: np.ndarray
    load_inertia: np.ndarray
    brake_torque: np.ndarray
    knot_time: np.ndarray
    knot_current: np.ndarray
    bench: Bench
    sag: float

    def is_affected(self, quantity: str) -> bool:
        """Return whether an effect changes the quantity."""

    def with_effects(self, quantity: str, value: np.ndarray, q: Quantities) -> np.ndarray:
        """Return the value with all effects on the quantity, and put it into `q`."""


def hydraulics(lanes: Lanes, q: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
    """Add the valve, eq. 1, and the piston, eq. 2."""
    v, lane, piece = lanes.values, np.arange(phase.shape[1]), phase[0]
    time, before = lanes.knot_time[lane, piece], lanes.knot_current[lane, piece]
    slope = (lanes.knot_current[lane, piece + 1] - before) / (lanes.knot_time[lane, piece + 1] - time)
    q["current"] = before + slope * (q["time"] - time)
    q["current_excess"] = q["current"] - state[MAGNET]
    rates[MAGNET] = q["current_excess"] / (MAGNET_TIME * lanes.bench.pace)
    current = lanes.with_effects("valve_current", q["current"], q)
    slope = _valve_slope(lanes, q, current, slope, slope - rates[MAGNET])
    gain = lanes.with_effects("pressure_gain", v["k"], q)
    demand = lanes.with_effects("pressure_demand", gain * (current - v["a"]), q)
    delay = lanes.with_effects("valve_delay", v["tau"], q)
    rates[PRESSURE] = state[RATE]
    rates[RATE] = (6 * (demand - state[PRESSURE]) / delay - 4 * state[RATE] - 2 * gain * slope) / delay

    chamber = lanes.with_effects("chamber_pressure", state[PRESSURE], q)
    spring = lanes.with_effects("spring_rate", v["d2"], q) * state[PISTON]
    feed = lanes.with_effects("piston_feed", v["a2"], q) * state[RATE]
    q["driving_pressure"] = chamber - v["aa"] + (feed - spring) / v["b2"]
    q["free_piston_rate"] = v["b2"] / v["c2"] * lanes.with_effects("net_pressure", q["driving_pressure"], q)
    rates[PISTON] = lanes.with_effects("piston_rate", q["free_piston_rate"], q)


def _valve_slope(lanes: Lanes, q: Quantities, current: np.ndarray, slope: np.ndarray,
                 excess_rate: np.ndarray) -> np.ndarray:
    """Return the rate (n,) in A/s of the `current` of the valve, after effects, from those of its abscissas."""
    commanded = q["current"]
    if not lanes.is_affected("valve_current"):
        return slope * (commanded + 1e-6 - commanded) / 1e-6  # rounded as below: draws are the same to the last digit
    later = lanes.with_effects("valve_current", commanded + 1e-6, {**q, "current": commanded + 1e-6})
    excess = lanes.with_effects("valve_current", commanded, {**q, "current_excess": q["current_excess"] + 1e-6})
    return (slope * (later - current) + excess_rate * (excess - current)) / 1e-6


def clutch(lanes: Lanes, q: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
    """Add the plates: contact, friction and film."""
    v = lanes.values
    clearance = lanes.with_effects("clearance", v["z_contact"], q)
    z = np.minimum(clearance, np.maximum(0, lanes.with_effects("oil_temperature_gain", v["kT"], q) * state[PISTON]))
    s = np.minimum(np.maximum(0, (z / clearance - 1 + v["eps"]) / v["eps"]), 1)
    regime = s * s * (3 - 2 * s)
    slip = state[INPUT] / v["gr"] - state[OUTPUT]
    q["piston_position"] = z
    contact = z / (clearance - v["beta"]) * np.maximum(0, q["chamber_pressure"])
    contact = lanes.with_effects("contact_pressure", contact, q)
    friction = regime * lanes.with_effects("friction_coefficient", v["alpha"], q) * 1e5 * contact
    friction = _apply_lag(lanes, "friction_lag", FRICTION, friction, q, rates, state)
    film = lanes.with_effects("film_coefficient", v["gamma"], q)
    shortest = v["eps"] * clearance
    inverse_gap = np.where(s > 0, (1 - s) * (1 + 2 * s) / shortest, 1 / np.maximum(clearance - z, shortest))
    q["friction_torque"] = friction
    q["slip_torque"] = friction * phase[2] + film * inverse_gap * slip
    rates[ENERGY] = np.where(phase[1] == STICK, 0, friction * v["gr"] * np.abs(slip))
    rates[HEAT] = rates[ENERGY] - state[HEAT] / (COOLING_TIME * lanes.bench.pace)
    rates[CONTACT] = regime


def shafts(lanes: Lanes, q: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
    """Add the converter, both shafts and the load."""
    v, mode, speed = lanes.values, phase[1], state[INPUT]
    converter = lanes.with_effects("converter_torque", _converter_torque(lanes, speed), q)
    lagged = _apply_lag(lanes, "converter_lag", CONVERTER, converter, q, rates, state)
    drive = lagged - lanes.with_effects("input_drag", v["biv"] * speed + v["Tic"], q)
    brake = lanes.with_effects("brake_torque", lanes.brake_torque, q)
    load = lanes.with_effects("load_torque", v["bov"] * state[OUTPUT] + brake, q)

    slip = speed / v["gr"] - state[OUTPUT]
    rigid = (drive - load / v["gr"]) / (v["Ji"] + lanes.load_inertia / v["gr"] ** 2)
    held_torque = drive - v["Ji"] * rigid
    stick_margin = q["friction_torque"] * (1 + 1e-6) - np.abs(held_torque)
    softness = compliance(lanes, state, q)
    if lanes.is_affected("shaft_compliance"):  # a compliant shaft never slips again after lock-up
        reduced = 1 / (1 / lanes.load_inertia + 1 / (v["Ji"] * v["gr"] ** 2))
        damping = 2 * RING_DAMPING * np.sqrt(reduced / softness)
        held_torque = (state[TWIST] / softness + damping * slip) / v["gr"]
        stick_margin = np.ones_like(speed)
        rates[TWIST] = np.where(mode == STICK, slip, 0)
    torque = np.where(mode == STICK, held_torque, q["slip_torque"])
    rates[INPUT] = (drive - torque) / v["Ji"]
    rates[POSITION] = state[OUTPUT]
    rates[OUTPUT] = np.where(mode == REST, 0, (v["gr"] * torque - load) / lanes.load_inertia)
    q["output_torque"] = v["gr"] * torque
    q["margin"] = np.choose(
        mode, [load - v["gr"] * torque, np.minimum(phase[2] * slip, state[OUTPUT]), stick_margin])


def compliance(lanes: Lanes, state: np.ndarray, q: Quantities) -> np.ndarray:
    """Return the compliance of the output shaft, (n,) in rad/(N m), at the twist of `state`."""
    q["twist"] = np.abs(state[TWIST])
    return lanes.with_effects("shaft_compliance", np.zeros_like(q["twist"]), q)


def _converter_torque(lanes: Lanes, speed: np.ndarray) -> np.ndarray:
    bench, motor_speed = lanes.bench, lanes.motor_speed
    if lanes.sag:
        largest = (np.max(bench.motor_speed) / bench.capacity[0]) ** 2
        for _ in range(2):
            pump = (motor_speed / np.interp(speed / motor_speed, bench.speed_ratio, bench.capacity)) ** 2
            motor_speed = lanes.motor_speed * (1 - lanes.sag * pump / largest)
    ratio = speed / motor_speed
    capacity = np.interp(ratio, bench.speed_ratio, bench.capacity)
    return motor_speed**2 * (np.interp(ratio, bench.speed_ratio, bench.torque_ratio) / capacity**2)


def _apply_lag(lanes: Lanes, lag: str, memory: int, value: np.ndarray, q: Quantities,
               rates: np.ndarray, state: np.ndarray) -> np.ndarray:
    if not lanes.is_affected(lag):
        return value
    rates[memory] = (value - state[memory]) / lanes.with_effects(lag, np.zeros_like(value), q)
    return state[memory]
