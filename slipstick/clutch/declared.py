"""The clutch as a declared machine, and recordings as its runs: valve, load, lock, input shaft, and slipping plates.

Equations: eqs. 1 to 4, each block cut at measured signals. That of the plates is one of the closing piston and of full
contact.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from slipstick.bench import Bench, parameters
from slipstick.bench.converter import Converter
from slipstick.clutch.ensemble import initial_input_speed
from slipstick.machine import (
    Block,
    Command,
    Condition,
    Curve,
    Machine,
    Parameter,
    Profile,
    Quantity,
    Runs,
    Sensor,
)
from slipstick.recordings import Recordings

_KNOWN = 0.03
"""Relative standard deviation of what a data sheet states: inertias and losses."""
_CONVERTER_WITHIN, _SAG_WITHIN = 0.05, 0.03
"""Relative standard deviation of a converter's torque by its curve, and of the share of its speed that the motor loses
under the largest torque of the pump."""
_TYPICAL = 0.1
"""Share of the largest friction torque that is the size of a torque that a law adds."""
_SHORTEST = 0.1
"""Least factor by which a law may change the delay of the valve."""
_CHAMBER, _CLOSED = 0.5, 1e-9
"""Size of a pressure in bar that a law adds in the chamber, and least clearance in m that shears a film."""
_TWIST, _ORDER, _WINDOW = 1e-3, 4, 0.8
"""Size of a compliance in rad/(N m), and order and length, in time constants of the valve, of the polynomials whose
derivative is that of the torque."""


def declare(bench: Bench) -> Machine:
    """Return the machine of a bench: values of its parameters are those of `values_of`."""
    sensors = (Sensor("pressure", "bar"), Sensor("output torque", "N m"),
               Sensor("input speed", "rad/s", without=("slip", "output speed")),
               Sensor("output speed", "rad/s", without=("slip", "input speed")))
    return Machine(
        "clutch", (_declare_valve(bench), _declare_load(bench), _declare_lock(bench), _declare_input(bench),
                   _declare_plates(bench)), sensors,
        commands=(Command("current", "A"),),
        conditions=(Condition("motor speed", "rad/s", drifts=True), Condition("load inertia", "kg m^2"),
                    Condition("brake torque", "N m", drifts=True)),
        signals={"output position": lambda u: (np.cumsum(np.maximum(u.output_speed, 0), axis=1)
                                               * (u.time[1] - u.time[0])),
                 "slip": lambda u: np.where(u.slipping, np.maximum(
                     u.input_speed - _value(bench, "gear_ratio") * u.output_speed, 0), 0.0)},
        inputs=("lock-up", "slipping", "locked", "torque rate", "given torque", "first input speed",
                "stated motor speed"))


def _value(bench: Bench, name: str) -> float:
    return float(bench.physics.nominal[parameters.index(name)])


def values_of(bench: Bench) -> dict[str, float]:
    """Return the nominal values of the parameters by name."""
    return dict(zip(parameters.NAMES, bench.physics.nominal, strict=True))


def _declare_valve(bench: Bench) -> Block:
    current = Quantity("valve current", "A", size=1.0, without=("pressure",))
    pressure = Quantity("line pressure", relative=True, without=("current", "past current", "pressure"))
    delay = Quantity("valve delay", relative=True, without=("past current",))
    valve = Block("valve", gives="pressure", reads=("current",), states=("pressure", "pressure rate"),
                  parameters=(Parameter("current_delay", "s", scatter=0.1), Parameter("current_bias", "A", scatter=0.2),
                              Parameter("current_gain", "bar/A", scatter=0.1)), quantities=(current, pressure, delay))

    def demand(u: Any, q: Any, p: Any) -> Any:
        return p.current_gain * (u.current + q.valve_current - p.current_bias) * (1 + q.line_pressure)

    def tau(q: Any, p: Any) -> Any:
        return p.current_delay * np.maximum(1 + q.valve_delay, _SHORTEST)

    @valve.rate
    def _(x: Any, u: Any, q: Any, p: Any) -> Any:
        demanded, time = demand(u, q, p), tau(q, p)
        return (x.pressure_rate - 2 / time * demanded,
                -6 / time**2 * x.pressure - 4 / time * x.pressure_rate + 14 / time**2 * demanded)

    @valve.start
    def _(u: Any, q: Any, p: Any) -> Any:
        demanded = demand(u, q, p)
        return 0 * demanded, 2 / tau(q, p) * demanded

    return valve


def _declare_load(bench: Bench) -> Block:
    size = _TYPICAL * bench.scales.load_torque
    torque = Quantity("load torque", "N m", size=size, without=("past output torque",))
    brake = Quantity("brake torque", relative=True,
                     over=("output speed", "time", "run order", "output position"))
    load = Block("load", gives="output speed",
                 reads=("output torque", "load inertia", "brake torque", "lock-up"), states=("output speed",),
                 lowest={"output speed": 0.0},
                 parameters=(Parameter("output_viscous", "N m s", scatter=0.1, within=_KNOWN),
                             Parameter("load kick", "N m", value=0.0, scatter=0.5, within=1e-3,
                                       scale=10 * size)),
                 quantities=(torque, brake), window=lambda u: u.slipping | u.locked)

    @load.rate
    def _(x: Any, u: Any, q: Any, p: Any) -> Any:
        driven = u.output_torque + p.load_kick * u.lock_up + q.load_torque
        return (driven - p.brake_torque * (1 + q.brake_torque) - p.output_viscous * x.output_speed) / p.load_inertia

    return load


def _declare_lock(bench: Bench) -> Block:
    twist = Quantity("stick torque", "rad/(N m)", size=_TWIST, over=("offset",))
    lock = Block("lock", gives="input speed", reads=("output speed", "torque rate"),
                 parameters=(Parameter("gear_ratio", scatter=0.05, within=1e-4),), quantities=(twist,),
                 window=lambda u: u.locked)

    @lock.output
    def _(x: Any, u: Any, q: Any, p: Any) -> Any:
        return p.gear_ratio * u.output_speed + q.stick_torque * u.torque_rate

    return lock


def _declare_input(bench: Bench) -> Block:
    gear, size = _value(bench, "gear_ratio"), _TYPICAL * bench.scales.load_torque / _value(bench, "gear_ratio")
    converter = bench.physics.curves
    largest = (max(bench.conditions.motor_speed) / min(converter.capacity_factor)) ** 2  # torque of the pump in N m
    torque = Quantity("input torque", "N m", size=size, without=("past output torque",))
    factor = Quantity("converter torque", relative=True, without=("past output torque", "motor speed"))
    shaft = Block("input", gives="input speed",
                  reads=("output torque", "motor speed", "stated motor speed", "given torque", "first input speed",
                         "lock-up"), states=("input speed",),
                  parameters=(Parameter("input_inertia", "kg m^2", scatter=0.1, within=_KNOWN),
                              Parameter("input_coulomb", "N m", scatter=0.1, within=_KNOWN),
                              Parameter("input_viscous", "N m s", scatter=0.1, within=_KNOWN),
                              Parameter("input kick", "N m", value=0.0, scatter=0.5, within=1e-3, scale=10 * size),
                              Parameter("start", value=0.0, scatter=0.05, within=1e-2, scale=1.0),
                              Parameter("sag", value=0.0, scatter=0.0, within=_SAG_WITHIN, scale=1.0)),
                  quantities=(torque, factor), curves=(Curve("converter torque", "speed ratio", _CONVERTER_WITHIN),),
                  derived={"speed ratio": lambda x, u, p: x.input_speed / p.motor_speed},
                  window=lambda u: u.slipping | u.locked)

    def drive(speed: Any, motor: Any, sag: Any) -> Any:
        free = motor
        for _ in range(2):
            pump = (motor / np.interp(speed / motor, converter.speed_ratio, converter.capacity_factor)) ** 2
            motor = free * (1 - sag * pump / largest)
        return _converter_torque(converter, speed, motor)

    @shaft.rate
    def _(x: Any, u: Any, q: Any, p: Any) -> Any:
        driven = drive(x.input_speed, p.motor_speed, p.sag) * (1 + q.converter_torque) + u.given_torque
        against = p.input_coulomb + p.input_viscous * x.input_speed
        clutch = u.output_torque / gear + p.input_kick * u.lock_up
        return (driven - against - clutch + q.input_torque) / p.input_inertia

    @shaft.start
    def _(u: Any, q: Any, p: Any) -> Any:
        return u.first_input_speed * (1 + p.start) * p.motor_speed / u.stated_motor_speed

    return shaft


def _declare_plates(bench: Bench) -> Block:
    gear, stroke, length = (_value(bench, name) for name in ("gear_ratio", "contact_position", "contact_length"))
    pressing, jump, inertia = (_value(bench, name) for name in ("piston_pressure", "piston_pressure_rate",
                                                                "piston_inertia"))
    of_runs = "run order", "motor speed"
    friction = Quantity("friction coefficient", relative=True, over=("slip", "pressure", "past pressure", "heat",
                                                                    "time in contact", "current", *of_runs))
    film = Quantity("film torque", relative=True, over=("slip", *of_runs))
    clearance = Quantity("clearance", "m", size=stroke, over=("pressure", *of_runs))
    chamber = Quantity("chamber pressure", "bar", size=_CHAMBER, over=("pressure", "input speed", *of_runs))
    gain = Quantity("piston gain", relative=True, over=of_runs)
    rate = Quantity("piston rate", "m/s", size=bench.scales.piston_rate,
                    over=("pressure", "piston position", "piston rate"))
    plates = Block("clutch", gives="output torque", reads=("pressure", "input speed", "output speed"),
                   states=("piston drive", "heat", "time in contact"),
                   parameters=(Parameter("friction_coefficient", "N m/Pa", scatter=0.1),
                               Parameter("pressure_bias", "bar", scatter=0.2),
                               Parameter("initial_position", "m", scatter=0.4),
                               Parameter("temperature_gain", scatter=0.3),
                               Parameter("piston_return", "1/s", scatter=0.05, within=_KNOWN),
                               Parameter("film_coefficient", "N m^2 s", scatter=0.05, within=_KNOWN),
                               Parameter("ramp_share", scatter=0.05, within=_KNOWN)),
                   quantities=(friction, film, clearance, chamber, gain, rate),
                   derived={"piston position": lambda x, u, p: (x.piston_drive + jump * u.pressure) / inertia,
                            "piston rate": lambda x, u, p: drive(x, u.pressure, p) / inertia},
                   window=lambda u: u.slipping)

    def drive(x: Any, pressure: Any, p: Any) -> Any:
        """Return the rate of the piston's drive, by which the derivative of the pressure does not appear."""
        return pressing * (pressure - p.pressure_bias) - p.piston_return * (x.piston_drive + jump * pressure) / inertia

    def press(x: Any, u: Any, q: Any, p: Any) -> tuple[Any, Any, Any]:
        """Return the ramp of the contact, the shearing of the film over its torque, and the friction torque in N m."""
        pressure = u.pressure + q.chamber_pressure
        reached = p.temperature_gain * (1 + q.piston_gain) * (x.piston_drive + jump * pressure) / inertia
        gap, width = np.maximum(stroke - np.maximum(reached, 0) + q.clearance, 0), p.ramp_share * stroke
        s = np.minimum(np.maximum(1 - gap / width, 0), 1)
        per_gap = np.where(s > 0, (1 - s) * (1 + 2 * s) / width, 1 / np.maximum(gap, _CLOSED))
        contact = np.maximum((stroke - gap) / (stroke - length), 0) * 1e5 * np.maximum(pressure, 0)
        ramp = s * s * (3 - 2 * s)
        return ramp, per_gap, ramp * p.friction_coefficient * (1 + q.friction_coefficient) * contact

    def slip(u: Any) -> Any:
        return np.maximum(u.input_speed / gear - u.output_speed, 0)

    @plates.rate
    def _(x: Any, u: Any, q: Any, p: Any) -> Any:
        ramp, _, torque = press(x, u, q, p)
        return (drive(x, u.pressure + q.chamber_pressure, p) + inertia * q.piston_rate, 1e-3 * torque * gear * slip(u),
                ramp)

    @plates.start
    def _(u: Any, q: Any, p: Any) -> Any:
        return inertia * p.initial_position - jump * (u.pressure + q.chamber_pressure), 0 * u.pressure, 0 * u.pressure

    @plates.output
    def _(x: Any, u: Any, q: Any, p: Any) -> Any:
        _, per_gap, torque = press(x, u, q, p)
        return gear * (p.film_coefficient * (1 + q.film_torque) * per_gap * slip(u) + torque)

    return plates


def _converter_torque(converter: Converter, speed: Any, motor: Any) -> Any:
    """Return the torque in N m of a converter at its input and motor speeds in rad/s."""
    ratio = speed / motor
    torque, capacity = (np.interp(ratio, converter.speed_ratio, values)
                        for values in (converter.torque_ratio, converter.capacity_factor))
    return torque * (motor / capacity) ** 2


def runs_of(bench: Bench, recordings: Recordings, slipping: np.ndarray, locked: np.ndarray) -> Runs:
    """Return recordings as runs, where the plates certainly are `slipping`, or `locked`, at samples (n, k)."""
    signals, conditions = recordings.signals, recordings.conditions
    assert signals is not None
    profile = conditions.current_profile
    corners = Profile(np.asarray(conditions.profile_time)[profile], np.asarray(conditions.profile_current)[profile])
    n, time = len(recordings), signals.time
    vectors = np.tile(bench.physics.nominal, (n, 1))
    initial, column = initial_input_speed(bench.physics.curves, vectors, conditions)
    given = np.zeros(n) if conditions.input_torque is None else conditions.input_torque
    spike = np.zeros((n, len(time)))
    spike[np.arange(n), np.clip(np.searchsorted(time, recordings.measured_time), 1, len(time) - 2)] = 1.0
    measured = {name.replace("_", " "): signals[name].astype(float) for name in signals.names}
    channels: dict[str, np.ndarray] = {"lock-up": spike, "slipping": slipping, "locked": locked,
                                       **_list_channels(recordings, slipping)}
    if "output torque" in measured:
        channels["torque rate"] = _differentiate(bench, measured["output torque"], time) / _value(bench, "gear_ratio")
    order = recordings.run_order if recordings.run_order is not None else conditions.run_order
    stated = {"motor speed": conditions.motor_speed, "load inertia": conditions.load_inertia,
              "brake torque": conditions.brake_torque}
    constants = {"given torque": given, "first input speed": initial[np.arange(n), column],
                 "stated motor speed": conditions.motor_speed}
    channels |= {name: np.repeat(value[:, None], len(time), axis=1) for name, value in constants.items()}
    return Runs(time, measured, {"current": corners}, stated, channels,
                None if order is None else np.asarray(order, float))


def _differentiate(bench: Bench, torque: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the rate (n, k) in N m/s of a measured torque, because an elastic shaft oscillates."""
    step = float(time[1] - time[0])
    width = max(_ORDER + 1, round(_WINDOW * bench.scales.time / step)) // 2 * 2 + 1
    return np.asarray(scipy.signal.savgol_filter(torque, width, _ORDER, deriv=1, delta=step, axis=1))


def _list_channels(recordings: Recordings, slipping: np.ndarray) -> Mapping[str, np.ndarray]:
    """Return the means (n,) of further channels while the plates slip, of those that have values in all runs."""
    listed = {}
    for name, channel in recordings.further.items():
        known = slipping & np.isfinite(channel.values)
        if known.any(axis=1).all():
            listed[name.replace("_", " ")] = np.where(known, channel.values, 0).sum(axis=1) / known.sum(axis=1)
    return listed
