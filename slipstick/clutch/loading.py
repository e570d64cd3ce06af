"""One engagement into one lane: parameters in the form the equations use them, and the state at t = 0."""

import numpy as np

from slipstick.clutch import parameters
from slipstick.clutch.conditions import turns
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    BRAKE,
    COEFFICIENTS,
    CONTACT_FACTOR,
    CONTACT_POSITION,
    CURRENT_BIAS,
    DIRECTION,
    FILM_COEFFICIENT,
    FRICTION_COEFFICIENT,
    GEAR,
    INPUT_COULOMB,
    INPUT_INERTIA,
    INPUT_VISCOUS,
    INVERSE_GEAR,
    INVERSE_INPUT_INERTIA,
    INVERSE_LOAD_INERTIA,
    INVERSE_MOTOR_SPEED,
    INVERSE_RAMP_WIDTH,
    INVERSE_TOTAL_INERTIA,
    LANES,
    LINE_CURRENT,
    LINE_DIRECTION,
    LINE_END,
    LINE_SLOPE,
    LINE_SWING,
    LINE_TIME,
    LINE_TURN,
    MEMORIES,
    MOTOR_SPEED,
    MOVING,
    OUTPUT_VISCOUS,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RETURN,
    PRESSURE_BIAS,
    PRESSURE_DAMPING,
    PRESSURE_GAIN,
    PRESSURE_STIFFNESS,
    RESPONSE_TIME,
    RUN,
    SEGMENTS,
    SLIPPING,
    SLOPE_GAIN,
    START,
    STATES,
    TEMPERATURE_GAIN,
    TIME,
)

(_DELAY, _BIAS, _GAIN, _A2, _B2, _C2, _D2, _PRESSURE_BIAS, _TEMPERATURE, _CONTACT, _X30, _BETA, _GAMMA, _ALPHA, _GEAR,
 _JI, _TIC, _BIV, _BOV, _EPS) = range(len(parameters.NAMES))


@kernel
def torque(curves, ratio, motor_speed):
    """Converter output torque in N m at one speed ratio, from the curves as `Converter.segments` gives them."""
    x = min(curves[2], max(curves[1], ratio))
    torque_ratio, capacity = curves[3] + curves[5] * (x - curves[1]), curves[4] + curves[6] * (x - curves[1])
    for k in range(7, 7 + 12 * int(curves[0]), 3):
        beyond = max(0.0, x - curves[k])
        torque_ratio += curves[k + 1] * beyond
        capacity += curves[k + 2] * beyond
    return torque_ratio * (motor_speed / capacity) ** 2


@kernel
def initial_speeds(vectors, motor_speeds, curves, out):
    """Input speed at which the converter drives just the input losses: out[point, speed] in rad/s, by bisection."""
    for point in range(len(vectors)):
        coulomb, viscous = vectors[point, _TIC], vectors[point, _BIV]
        same = point > 0 and vectors[point - 1, _TIC] == coulomb and vectors[point - 1, _BIV] == viscous
        for k in range(len(motor_speeds)):
            if same:
                out[point, k] = out[point - 1, k]
                continue
            low, high = 0.0, 2.0 * motor_speeds[k]
            for _ in range(55):
                speed = 0.5 * (low + high)
                if torque(curves, speed / motor_speeds[k], motor_speeds[k]) > viscous * speed + coulomb:
                    low = speed
                else:
                    high = speed
            out[point, k] = 0.5 * (low + high)


@kernel
def load(b, i, vectors, coefficients, acts, point, conditions, condition, initial_speed):
    """Put the engagement of a point (parameter vector) under a condition into lane i, at rest at t = 0."""
    tau, gear = vectors[point, _DELAY], vectors[point, _GEAR]
    motor_speed, inertia = conditions[condition, 0], conditions[condition, 1]
    b[PRESSURE_STIFFNESS + i] = 6.0 / (tau * tau)
    b[PRESSURE_DAMPING + i] = 4.0 / tau
    b[PRESSURE_GAIN + i] = 6.0 * vectors[point, _GAIN] / (tau * tau)
    b[SLOPE_GAIN + i] = 2.0 * vectors[point, _GAIN] / tau
    b[CURRENT_BIAS + i] = vectors[point, _BIAS]
    piston = 3.0 * vectors[point, _C2] / abs(vectors[point, _D2])
    b[RESPONSE_TIME + i] = min(tau, piston, acts.shortest[point])
    b[PISTON_PRESSURE + i] = vectors[point, _B2] / vectors[point, _C2]
    b[PISTON_PRESSURE_RATE + i] = vectors[point, _A2] / vectors[point, _C2]
    b[PISTON_RETURN + i] = vectors[point, _D2] / vectors[point, _C2]
    b[PRESSURE_BIAS + i] = vectors[point, _PRESSURE_BIAS]
    b[TEMPERATURE_GAIN + i] = vectors[point, _TEMPERATURE]
    b[CONTACT_POSITION + i] = vectors[point, _CONTACT]
    b[CONTACT_FACTOR + i] = 1.0 / (vectors[point, _CONTACT] - vectors[point, _BETA])
    b[INVERSE_RAMP_WIDTH + i] = 1.0 / (vectors[point, _EPS] * vectors[point, _CONTACT])
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
    for c in acts.used:
        b[COEFFICIENTS + c * LANES + i] = coefficients[point, c]
    b[TIME + i] = 0.0
    b[START + i] = 0.0
    b[START + LANES + i] = 0.0
    b[START + 2 * LANES + i] = vectors[point, _X30]
    b[START + 3 * LANES + i] = initial_speed
    b[START + 4 * LANES + i] = 0.0
    for s in range(STATES, STATES + len(MEMORIES)):
        b[START + s * LANES + i] = 0.0
    b[SLIPPING + i] = 1.0
    b[MOVING + i] = 0.0
    b[DIRECTION + i] = 1.0


@kernel
def park(b, i):
    """Leave lane i where nothing moves and nothing happens."""
    for row in range(0, SEGMENTS, LANES):
        b[row + i] = 0.0
    b[CONTACT_POSITION + i] = 1.0
    b[START + 3 * LANES + i] = 1.0
    b[SLIPPING + i] = 1.0
    b[MOVING + i] = 1.0
    b[DIRECTION + i] = 1.0
    b[INVERSE_GEAR + i] = 1.0
    b[LINE_END + i] = np.inf


def lines(time: np.ndarray, current: np.ndarray) -> np.ndarray:
    """The straight lines of current profiles (p, k): (p, k, 7) start, current, slope, end (s, A, A/s, s), `turns`.

    The last line of each holds the current for ever.
    """
    slope = np.zeros_like(time)
    slope[:, :-1] = np.diff(current, axis=1) / np.diff(time, axis=1)
    end = np.concatenate([time[:, 1:], np.full((len(time), 1), np.inf)], axis=1)
    return np.concatenate([np.stack([time, current, slope, end], axis=2), [turns(row) for row in current]], axis=2)


@kernel
def set_line(b, i, table, profile, line):
    """Put a straight line of the current into lane i."""
    b[LINE_TIME + i] = table[profile, line, 0]
    b[LINE_CURRENT + i] = table[profile, line, 1]
    b[LINE_SLOPE + i] = table[profile, line, 2]
    b[LINE_END + i] = table[profile, line, 3]
    b[LINE_DIRECTION + i] = table[profile, line, 4]
    b[LINE_TURN + i] = table[profile, line, 5]
    b[LINE_SWING + i] = table[profile, line, 6]
