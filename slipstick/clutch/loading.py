"""Loading of an engagement into a lane: parameters in the form used by the equations, and the initial state vector."""

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.conditions import reversals
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    BRAKE,
    COEFFICIENTS,
    CONTACT_FACTOR,
    CONTACT_POSITION,
    CURRENT_BIAS,
    CURVES,
    DIRECTION,
    EFFECT_TIME,
    FILM_COEFFICIENT,
    FRICTION_COEFFICIENT,
    FULL_STATE_SIZE,
    GEAR,
    INPUT_COULOMB,
    INPUT_INERTIA,
    INPUT_TORQUE,
    INPUT_VISCOUS,
    INVERSE_GEAR,
    INVERSE_INPUT_INERTIA,
    INVERSE_LOAD_INERTIA,
    INVERSE_MOTOR_SPEED,
    INVERSE_RAMP_WIDTH,
    INVERSE_STIFFNESS,
    INVERSE_TOTAL_INERTIA,
    LANES,
    MOTOR_SPEED,
    MOVING,
    OUTPUT_VISCOUS,
    PISTON_FROM_PRESSURE,
    PISTON_FROM_RATE,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RETURN,
    PRESSURE_BIAS,
    PRESSURE_DAMPING,
    PRESSURE_GAIN,
    PRESSURE_STIFFNESS,
    RAMP_WIDTH,
    RUN,
    SEGMENT_CURRENT,
    SEGMENT_DIRECTION,
    SEGMENT_END,
    SEGMENT_REVERSAL,
    SEGMENT_SLOPE,
    SEGMENT_SWING,
    SEGMENT_TIME,
    SEGMENT_TORQUE,
    SEGMENT_TORQUE_SLOPE,
    SLIPPING,
    SLOPE_GAIN,
    START,
    STATE_SIZE,
    STIFFNESS,
    TEMPERATURE_GAIN,
    TIME,
    VALVE_DELAY,
    VALVE_GAIN,
    VALVE_TIME,
)

(_DELAY, _BIAS, _GAIN, _A2, _B2, _C2, _D2, _PRESSURE_BIAS, _TEMPERATURE, _CONTACT, _X30, _BETA, _GAMMA, _ALPHA, _GEAR,
 _JI, _TIC, _BIV, _BOV, _EPS) = range(len(parameters.NAMES))


FIRST_STIFFNESS = 1e4
"""Assumed for the first step, in 1/s: it is short, and shows the stiffness."""


@kernel
def torque(curves, ratio, motor_speed):
    """Converter output torque in N m at one speed ratio, from the curves as `Converter.terms` gives them."""
    beyond = min(curves[2], max(curves[1], ratio)) - curves[1]
    torque_ratio, capacity = curves[3] + curves[4] * beyond, curves[5] + curves[6] * beyond
    for k in range(7, 7 + 12 * int(curves[0]), 3):
        hinge = max(0.0, beyond + curves[1] - curves[k])
        torque_ratio += curves[k + 1] * hinge
        capacity += curves[k + 2] * hinge
    return torque_ratio * (motor_speed / capacity) ** 2


def initial_speeds(vectors, motor_speeds, curves, out):
    """Input speed at which converter torque and input losses balance: out[point, speed] in rad/s, by bisection.

    The points have the same `motor_speeds` (1, speeds), or a row each (points, speeds).
    """
    shared = len(motor_speeds) == 1
    for point in range(len(vectors)):
        coulomb, viscous = vectors[point, _TIC], vectors[point, _BIV]
        is_repeated = point > 0 and vectors[point - 1, _TIC] == coulomb and vectors[point - 1, _BIV] == viscous
        for k in range(motor_speeds.shape[1]):
            if is_repeated and shared:
                out[point, k] = out[point - 1, k]
                continue
            motor_speed = motor_speeds[0 if shared else point, k]
            low, high = 0.0, 2.0 * motor_speed
            for _ in range(55):
                speed = 0.5 * (low + high)
                if torque(curves, speed / motor_speed, motor_speed) > viscous * speed + coulomb:
                    low = speed
                else:
                    high = speed
            out[point, k] = 0.5 * (low + high)


@kernel
def load(b, i, vectors, coefficients, active_effects, point, conditions, condition, initial_speed):
    """Load the engagement of a point (parameter vector) under a condition into lane i, at rest at t = 0."""
    tau, gear = vectors[point, _DELAY], vectors[point, _GEAR]
    motor_speed, inertia = conditions[condition, 0], conditions[condition, 1]
    b[PRESSURE_STIFFNESS + i] = 6.0 / (tau * tau)
    b[PRESSURE_DAMPING + i] = 4.0 / tau
    b[PRESSURE_GAIN + i] = 6.0 * vectors[point, _GAIN] / (tau * tau)
    b[SLOPE_GAIN + i] = 2.0 * vectors[point, _GAIN] / tau
    b[VALVE_GAIN + i], b[VALVE_DELAY + i], b[INVERSE_STIFFNESS + i] = vectors[point, _GAIN], tau, tau * tau / 6.0
    b[CURRENT_BIAS + i] = vectors[point, _BIAS]
    b[VALVE_TIME + i] = min(tau, vectors[point, _C2] / abs(vectors[point, _D2]))
    b[EFFECT_TIME + i] = active_effects.shortest_time_constant[point]
    b[STIFFNESS + i] = FIRST_STIFFNESS
    b[PISTON_PRESSURE + i] = vectors[point, _B2] / vectors[point, _C2]
    b[PISTON_PRESSURE_RATE + i] = vectors[point, _A2] / vectors[point, _C2]
    b[PISTON_RETURN + i] = vectors[point, _D2] / vectors[point, _C2]
    above = b[PRESSURE_DAMPING + i] - b[PISTON_RETURN + i]
    b[PISTON_FROM_RATE + i] = (b[PISTON_PRESSURE + i] - b[PISTON_RETURN + i] * b[PISTON_PRESSURE_RATE + i]) / (
        b[PISTON_RETURN + i] * above - b[PRESSURE_STIFFNESS + i])
    b[PISTON_FROM_PRESSURE + i] = b[PISTON_PRESSURE_RATE + i] + above * b[PISTON_FROM_RATE + i]
    b[PRESSURE_BIAS + i] = vectors[point, _PRESSURE_BIAS]
    b[TEMPERATURE_GAIN + i] = vectors[point, _TEMPERATURE]
    b[CONTACT_POSITION + i] = vectors[point, _CONTACT]
    b[CONTACT_FACTOR + i] = 1.0 / (vectors[point, _CONTACT] - vectors[point, _BETA])
    b[RAMP_WIDTH + i] = vectors[point, _EPS] * vectors[point, _CONTACT]
    b[INVERSE_RAMP_WIDTH + i] = 1.0 / b[RAMP_WIDTH + i]
    b[FILM_COEFFICIENT + i] = vectors[point, _GAMMA]
    b[FRICTION_COEFFICIENT + i] = vectors[point, _ALPHA]
    b[GEAR + i] = gear
    b[INVERSE_GEAR + i] = 1.0 / gear
    b[INPUT_COULOMB + i] = vectors[point, _TIC]
    b[INPUT_VISCOUS + i] = vectors[point, _BIV]
    b[OUTPUT_VISCOUS + i] = vectors[point, _BOV]
    b[INPUT_INERTIA + i] = vectors[point, _JI]
    b[INVERSE_INPUT_INERTIA + i] = 1.0 / vectors[point, _JI]
    b[INVERSE_LOAD_INERTIA + i] = 1.0 / inertia
    b[INVERSE_TOTAL_INERTIA + i] = 1.0 / (vectors[point, _JI] + inertia / (gear * gear))
    b[BRAKE + i] = conditions[condition, 2]
    b[MOTOR_SPEED + i] = motor_speed
    b[INVERSE_MOTOR_SPEED + i] = 1.0 / motor_speed
    b[RUN + i] = 0.01 * conditions[condition, 3]
    b[INPUT_TORQUE + i] = conditions[condition, 4]
    for c in active_effects.coefficient_indices:
        b[COEFFICIENTS + c * LANES + i] = coefficients[point, c]
    b[TIME + i] = 0.0
    b[START + i] = 0.0
    b[START + LANES + i] = 0.0
    b[START + 2 * LANES + i] = vectors[point, _X30]
    b[START + 3 * LANES + i] = initial_speed
    b[START + 4 * LANES + i] = 0.0
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        b[START + s * LANES + i] = 0.0
    b[SLIPPING + i] = 1.0
    b[MOVING + i] = 0.0
    b[DIRECTION + i] = 1.0


@kernel
def park(b, i):
    """Set lane i to an idle state without motion or events."""
    for row in range(0, CURVES, LANES):
        b[row + i] = 0.0
    b[CONTACT_POSITION + i] = 1.0
    b[START + 3 * LANES + i] = 1.0
    b[SLIPPING + i] = 1.0
    b[MOVING + i] = 1.0
    b[DIRECTION + i] = 1.0
    b[INVERSE_GEAR + i] = 1.0
    b[SEGMENT_END + i] = np.inf


def segments(time: np.ndarray, current: np.ndarray, torque: np.ndarray | None = None) -> np.ndarray:
    """Segments of current profiles (p, k) and of a given input torque (p, k) in N m: shape (p, k, 9).

    Start, current, slope, end (s, A, A/s, s), `reversals`, input torque and its slope (N m, N m/s). The last segment of
    each profile keeps current and torque constant without end.
    """
    given = np.zeros_like(time) if torque is None else torque
    end = np.concatenate([time[:, 1:], np.full((len(time), 1), np.inf)], axis=1)
    lines = np.stack([time, current, _slopes(time, current), end], axis=2)
    torques = np.stack([given, _slopes(time, given)], axis=2)
    return np.concatenate([lines, [reversals(row) for row in current], torques], axis=2)


def _slopes(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    slopes = np.zeros_like(time)
    slopes[:, :-1] = np.diff(values, axis=1) / np.diff(time, axis=1)
    return slopes


@kernel
def set_segment(b, i, table, profile, segment):
    """Set the active segment of the current profile in lane i."""
    b[SEGMENT_TIME + i] = table[profile, segment, 0]
    b[SEGMENT_CURRENT + i] = table[profile, segment, 1]
    b[SEGMENT_SLOPE + i] = table[profile, segment, 2]
    b[SEGMENT_END + i] = table[profile, segment, 3]
    b[SEGMENT_DIRECTION + i] = table[profile, segment, 4]
    b[SEGMENT_REVERSAL + i] = table[profile, segment, 5]
    b[SEGMENT_SWING + i] = table[profile, segment, 6]
    b[SEGMENT_TORQUE + i] = table[profile, segment, 7]
    b[SEGMENT_TORQUE_SLOPE + i] = table[profile, segment, 8]
