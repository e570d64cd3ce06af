"""Findings about converter, brake and friction, from eqs. 2 and 3 at rest."""

import numpy as np

from slipstick.plausibility.finding import Finding, list_numbers
from slipstick.plausibility.physics import SteadyStates

_OVERSIZED = 10.0
"""Capacity of the clutch, in stall torques of the input, that counts as a slip of a power of ten.

A clutch is designed to hold the largest torque that it transmits with a margin of less than three.
"""
_RADIANS_PER_RPM = np.pi / 30


def loss_findings(steady: SteadyStates) -> list[Finding]:
    """Losses that drive."""
    everywhere = np.ones(len(steady.bench.conditions), bool)
    return [finding for name in ("film_coefficient", "input_coulomb", "input_viscous", "output_viscous")
            for finding in Finding.of(f"parameters.{name}", everywhere & (steady[name] < 0), f"{name} is negative",
                                      "a loss would drive the shaft", "Give a positive value, or 0")]


def converter_findings(steady: SteadyStates, known: np.ndarray) -> list[Finding]:
    """Converters that create energy or cannot hold idle, where nothing else explains the condition (`known`, (n,))."""
    return [] if steady.bench.physics.converter is None else [*_efficiency(steady), *_idle(steady, known)]


def _efficiency(steady: SteadyStates) -> list[Finding]:
    converter = steady.bench.physics.curves
    efficiency = np.array(converter.speed_ratio) * np.array(converter.torque_ratio)
    if efficiency.max() <= 1:
        return []
    return [Finding("converter.torque_ratio",
                    f"the converter gives more power than it takes: at the speed ratio "
                    f"{converter.speed_ratio[int(efficiency.argmax())]:.4g} its efficiency, speed ratio times torque "
                    f"ratio, is {efficiency.max():.4g}",
                    "energy is created, and the input shaft is driven too strongly",
                    "Check the curve: torque_ratio is the torque of the turbine over that of the pump")]


def _idle(steady: SteadyStates, known: np.ndarray) -> list[Finding]:
    stall, synchronous = steady.input_torque(0.0), steady.input_torque(1.0)
    too_weak, runs_away = (stall <= 0) & ~known, (stall > 0) & (synchronous > 0) & ~known
    speeds = steady.bench.conditions.motor_speed
    return [*Finding.of(
        "converter.capacity_factor", too_weak,
        f"the converter cannot hold idle at {_speeds(speeds[too_weak])}: its stall torque less the losses of the input "
        f"shaft is {_first(stall, too_weak):.4g} N m",
        "the input shaft stands still before the shift command",
        "Check the units of capacity_factor and input_coulomb: torque = (motor speed/capacity_factor)^2 torque_ratio"),
        *Finding.of(
        "converter.speed_ratio", runs_away,
        f"the converter cannot hold idle at {_speeds(speeds[runs_away])}: it turns the input shaft faster than the "
        f"motor, at whose speed {_first(synchronous, runs_away):.4g} N m are left after the losses",
        "below the speed of the motor, no input speed balances converter torque and losses",
        "Continue the curves to speed ratio 1, where the capacity factor rises steeply, and check the input's losses")]


def brake_findings(steady: SteadyStates, known: np.ndarray) -> list[Finding]:
    """Brakes stronger than clutch or converter."""
    brake, gear = steady.bench.conditions.brake_torque, steady["gear_ratio"]
    held, driven = gear * steady.capacity, gear * steady.input_torque(0.0)
    weak = (brake >= held) & ~known
    stalls = (brake >= driven) & ~weak & ~known & (steady.bench.physics.converter is not None)
    return [*Finding.of(
        "conditions.brake_torque", weak,
        f"the brake is stronger than the clutch in {list_numbers('condition', np.flatnonzero(weak))}: it holds "
        f"{_first(brake, weak):.4g} N m, and the closed clutch transmits at most {_first(held, weak):.4g} N m at the "
        "largest pressure",
        "the load does not move, and an engagement can lock only by stopping the input shaft",
        "Check the units of brake_torque and friction_coefficient: the clutch transmits gear_ratio "
        "friction_coefficient times the contact pressure in Pa"),
        *Finding.of(
        "conditions.brake_torque", stalls,
        f"the brake is stronger than the converter in {list_numbers('condition', np.flatnonzero(stalls))}: it holds "
        f"{_first(brake, stalls):.4g} N m, and the stalled converter drives the load with "
        f"{_first(driven, stalls):.4g} N m",
        "the closing clutch stops the input shaft, and the load does not start",
        "Check the units of brake_torque and capacity_factor, and the gear_ratio")]


def capacity_findings(steady: SteadyStates, known: np.ndarray) -> list[Finding]:
    """Clutches, and oil films of open clutches, far stronger than the input."""
    stall = steady.input_torque(0.0)
    compared = ~known & (stall > 0) & (steady.capacity > 0)
    ratio = steady.capacity / np.where(compared, stall, np.inf)
    typical = float(np.median(ratio[compared])) if compared.any() else 0.0
    oversized = compared & (typical > _OVERSIZED)
    drags = ~known & ~oversized & (steady.open_drag >= stall) & (stall > 0)
    return [*Finding.of(
        "parameters.friction_coefficient", oversized,
        f"the closed clutch transmits {typical:.3g} times the largest torque of its input, at up to "
        f"{steady.pressure.max():.4g} bar",
        "a clutch is built for less than three times, so a pressure, friction or speed is off by a power of ten",
        "Check the units of friction_coefficient, current_gain, capacity_factor, motor_speed and of the currents"),
        *Finding.of(
        "parameters.film_coefficient", drags,
        f"the oil film of the open clutch transmits {_first(steady.open_drag, drags):.4g} N m to a load at rest, more "
        f"than the largest torque of the input, {_first(stall, drags):.4g} N m",
        "the film instead of the plates accelerates the load, and friction hardly enters the shifting time",
        "Check the units of film_coefficient, contact_position and motor_speed")]


def _first(values: np.ndarray, affected: np.ndarray) -> float:
    return float(values[np.argmax(affected)])


def _speeds(speeds: np.ndarray) -> str:
    return ", ".join(f"{speed / _RADIANS_PER_RPM:.4g} rpm" for speed in np.unique(speeds))
