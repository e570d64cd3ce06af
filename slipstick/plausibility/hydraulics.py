"""Findings about valve and piston, from eq. 1 at rest."""

import numpy as np

from slipstick.plausibility.finding import Finding, list_numbers, mask_explained
from slipstick.plausibility.physics import SteadyStates


def hydraulic_findings(steady: SteadyStates) -> list[Finding]:
    """Pressures too low or too late for the piston, and pistons that close too little or too early."""
    conditions = steady.bench.conditions
    n, end = len(conditions), conditions.profile_time[conditions.current_profile, -1]
    findings = [*_never_presses(steady), *Finding.of(
        "parameters.current_delay", steady["current_delay"] >= end,
        f"the pressure follows the current after {1e3 * steady['current_delay']:.4g} ms, and the current profile ends "
        f"after {end.min():.4g} s",
        "no engagement can lock before its profile ends",
        "Check the unit of current_delay and of the profiles' times")]
    stroke = steady["contact_position"]
    findings += Finding.of(
        "parameters.contact_length", np.full(n, steady["contact_length"] >= stroke),
        f"contact_length, {1e3 * steady['contact_length']:.4g} mm, is not less than contact_position, "
        f"{1e3 * stroke:.4g} mm",
        "the contact pressure is proportional to z/(contact_position - contact_length), which must be positive",
        "Check both units: the length is a small part of the stroke")
    closes_too_little = (steady.piston < stroke) & ~mask_explained(findings, n)
    findings += Finding.of(
        "parameters.piston_pressure", closes_too_little,
        f"the piston never closes under {_profiles(steady, closes_too_little)}: at the largest pressure it rests at "
        f"{_least(1e3 * steady.piston, closes_too_little):.4g} mm, and the plates touch at {1e3 * stroke:.4g} mm",
        "the plates are not pressed together, so only the oil film transmits torque",
        "Check the units of piston_pressure, piston_return, temperature_gain and contact_position: the piston rests at "
        "temperature_gain piston_pressure (pressure - pressure_bias)/piston_return")
    return [*findings, *_contact_before_the_command(steady)]


def _never_presses(steady: SteadyStates) -> list[Finding]:
    too_low = steady.pressure <= steady["pressure_bias"]
    return Finding.of(
        "parameters.pressure_bias", too_low,
        f"the pressure never exceeds pressure_bias under {_profiles(steady, too_low)}: the largest current, "
        f"{_least(steady.current, too_low):.4g} A, gives {_least(steady.pressure, too_low):.4g} bar, and the piston "
        f"begins to move at {steady['pressure_bias']:.4g} bar",
        "the piston does not move and no engagement locks",
        "Check the units of current_gain, current_bias and pressure_bias, and the profile's currents: the pressure is "
        "current_gain (current - current_bias)")


def _contact_before_the_command(steady: SteadyStates) -> list[Finding]:
    start = steady["temperature_gain"] * steady["initial_position"]
    touches = np.full(len(steady.bench.conditions), start > steady.contact)
    if steady["ramp_share"] >= 1:
        return Finding.of("parameters.ramp_share", np.ones_like(touches),
                          f"ramp_share is {steady['ramp_share']:.4g}, so friction acts over the whole stroke",
                          "the plates transmit torque before they touch",
                          "Give a small share of the stroke, such as 0.1, as a number without percent")
    return Finding.of(
        "parameters.initial_position", touches,
        f"the piston is in contact before the shift command: it starts at {1e3 * start:.4g} mm, and friction sets in "
        f"at {1e3 * steady.contact:.4g} mm",
        "there is no fill phase, and shifting times do not depend on it",
        "Check the units of initial_position and contact_position, and temperature_gain, which multiplies the position")


def jump_findings(steady: SteadyStates, known: np.ndarray) -> list[Finding]:
    """Pistons closed by the rise of the pressure: integrating a2 x2 moves the piston by a2/c2 times the rise."""
    gain = steady["temperature_gain"] * steady["piston_pressure_rate"] / steady["piston_inertia"]
    jump = gain * np.maximum(0, steady.pressure)
    return Finding.of(
        "parameters.piston_pressure_rate", (jump > steady["contact_position"]) & ~known,
        f"the rise of the pressure alone moves the piston by up to {1e3 * jump.max():.4g} mm at once, more than its "
        f"whole stroke, {1e3 * steady['contact_position']:.4g} mm",
        "the piston closes with the pressure, without a fill phase",
        "Check the unit of piston_pressure_rate, a length per pressure, and piston_inertia, by which it is divided")


def _least(values: np.ndarray, affected: np.ndarray) -> float:
    return float(values[affected].min()) if affected.any() else np.nan


def _profiles(steady: SteadyStates, affected: np.ndarray) -> str:
    return list_numbers("current profile", np.unique(steady.bench.conditions.current_profile[affected]))
