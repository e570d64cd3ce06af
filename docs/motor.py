"""Run-up of a DC motor: the simulator of the worked example in any_machine.md."""

import math

TARGET = 100.0  # rad/s, the speed at which the run-up ends
CONSTANT = 0.08  # N m/A and V s/rad, torque constant and back-EMF constant


def run_up_time(resistance: float, friction: float, voltage: float, inertia: float) -> float | None:
    """Time in s from switching on to the target speed; None if the motor never reaches it.

    `resistance` is in ohm, the constant friction torque `friction` in N m, `voltage` in V, `inertia` in kg m^2. The
    inductance is neglected, so that the speed approaches its final value exponentially.
    """
    final = (voltage - resistance * friction / CONSTANT) / CONSTANT
    if final <= TARGET:
        return None
    return -inertia * resistance / CONSTANT**2 * math.log(1 - TARGET / final)
