"""Findings from the simulated engagements: those that fail, never lock, or lock before the plates are pressed."""

import numpy as np

from slipstick.clutch.ensemble import FAILED, NEVER_LOCKED
from slipstick.plausibility.behaviour import Behaviour
from slipstick.plausibility.finding import Finding, list_numbers
from slipstick.plausibility.physics import SteadyStates

_DESCRIBED = 3  # engagements described with their numbers


def engagement_findings(steady: SteadyStates, behaviour: Behaviour, known: np.ndarray) -> list[Finding]:
    """Findings about conditions that no other finding explains (`known`, (n,))."""
    failed, never = behaviour.status == FAILED, (behaviour.status == NEVER_LOCKED) & ~known
    early = behaviour.locked & (behaviour.position_at_lock < steady.contact) & ~known
    return [
        *Finding.of("parameters", failed & ~known,
                    f"the simulation diverges in {list_numbers('condition', np.flatnonzero(failed & ~known))}",
                    "these engagements have no shifting time", "Check the units of inertias and viscous coefficients"),
        *Finding.of("conditions", never, f"{list_numbers('condition', np.flatnonzero(never))} never lock"
                    f"{'s' if never.sum() == 1 else ''} before the current profile ends: "
                    + "; ".join(_describe(steady, behaviour, row) for row in np.flatnonzero(never)[:_DESCRIBED]),
                    "recordings, tables and fits need a shifting time of each condition",
                    "Lengthen the current profile or raise its current, or leave out these conditions"),
        *Finding.of("conditions", early,
                    f"{list_numbers('condition', np.flatnonzero(early))} lock{'s' if early.sum() == 1 else ''} before "
                    "the plates are pressed, with the piston at "
                    f"{1e3 * behaviour.position_at_lock[np.argmax(early)]:.3g} of "
                    f"{1e3 * steady['contact_position']:.3g} mm",
                    "the oil film alone brings both shafts to the same speed, and friction does not matter",
                    "Check film_coefficient, load_inertia and motor_speed, and the losses and torque of the input")]


def _describe(steady: SteadyStates, behaviour: Behaviour, row: int) -> str:
    conditions = steady.bench.conditions
    return (f"condition {row} (profile {conditions.current_profile[row]}, {conditions.motor_speed[row]:.4g} rad/s, "
            f"{conditions.load_inertia[row]:.4g} kg m², brake {conditions.brake_torque[row]:.4g} N m) ends with "
            f"{behaviour.final_slip[row]:.4g} rad/s of slip, the piston reached "
            f"{1e3 * behaviour.furthest_position[row]:.4g} of {1e3 * steady['contact_position']:.4g} mm and the output "
            f"torque {behaviour.largest_torque[row]:.4g} N m")
