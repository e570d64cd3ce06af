"""The exact solution of eq. 1 on a segment of the current, where no effect or law changes the equation.

Pressure and piston then obey linear equations with constant coefficients. The pressure deviates from its steady rise
k (u - a - tau u') by e, with e1' = e2 and e2' = -6/tau^2 e1 - 4/tau e2: a decay at the rate 2/tau with the angular
frequency sqrt(2)/tau. The piston state is p e1 + r e2 + g with two constants p and r of the parameters, and g follows a
linear function of the time with the rate of the return spring.
"""

from slipstick.clutch.fastmath import inlined, kernel
from slipstick.clutch.lanes import (
    CURRENT_BIAS,
    END,
    LANES,
    MIDPOINT,
    PISTON_FROM_PRESSURE,
    PISTON_FROM_RATE,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RETURN,
    PRESSURE_BIAS,
    PRESSURE_DAMPING,
    PRESSURE_GAIN,
    PRESSURE_STIFFNESS,
    SEGMENT_CURRENT,
    SEGMENT_SLOPE,
    SEGMENT_TIME,
    START,
    STEP,
    TIME,
)


@inlined
def _after(b, i, duration, time, pressure, pressure_rate, piston_state):
    """The three states of lane i a `duration` in s after they have been given ones at a `time` in s.

    The series are accurate to 1e-11 for durations up to half of VALVE_TIME.
    """
    stiffness, decay, back = b[PRESSURE_STIFFNESS + i], 0.5 * b[PRESSURE_DAMPING + i], b[PISTON_RETURN + i]
    per_pressure, per_rate = b[PISTON_PRESSURE + i], b[PISTON_PRESSURE_RATE + i]
    own, of_rate = b[PISTON_FROM_PRESSURE + i], b[PISTON_FROM_RATE + i]
    current = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (time - b[SEGMENT_TIME + i])
    gain = b[PRESSURE_GAIN + i] / stiffness
    rise = gain * b[SEGMENT_SLOPE + i]
    steady = gain * (current - b[CURRENT_BIAS + i]) - 2.0 * rise / decay
    e1, e2 = pressure - steady, pressure_rate - rise
    g = piston_state - own * e1 - of_rate * e2

    x = -0.25 * decay * duration  # e^4x by the series of e^x
    p = 1.0 + x * (1.0 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040 + x * (
        1 / 40320 + x / 362880))))))))
    damped = p * p * p * p
    y = -0.5 * decay * decay * duration * duration  # minus the square of the angle
    cosine = 1.0 + y * (1 / 2 + y * (1 / 24 + y * (1 / 720 + y * (1 / 40320 + y * (1 / 3628800 + y / 479001600)))))
    sine = duration * (1.0 + y * (1 / 6 + y * (1 / 120 + y * (1 / 5040 + y * (1 / 362880 + y / 39916800)))))
    f1 = damped * ((cosine + decay * sine) * e1 + sine * e2)
    f2 = damped * ((cosine - decay * sine) * e2 - stiffness * sine * e1)

    z = back * duration  # second = (e^-z - 1 + z) / z^2, without a division by a weak spring
    second = 1 / 2 - z * (1 / 6 - z * (1 / 24 - z * (1 / 120 - z * (1 / 720 - z * (1 / 5040 - z * (1 / 40320 - z * (
        1 / 362880 - z / 3628800)))))))
    first = 1.0 - z * second
    held = per_pressure * (steady - b[PRESSURE_BIAS + i]) + per_rate * rise
    g = (1.0 - z * first) * g + duration * (first * held + duration * second * per_pressure * rise)
    return steady + rise * duration + f1, rise + f2, own * f1 + of_rate * f2 + g


@kernel
def flow(b):
    """Set the first three rows of MIDPOINT and END: the states in the middle and at the end of the step."""
    for i in range(LANES):
        half, time = 0.5 * b[STEP + i], b[TIME + i]
        x1, x2, x3 = _after(b, i, half, time, b[START + i], b[START + LANES + i], b[START + 2 * LANES + i])
        b[MIDPOINT + i], b[MIDPOINT + LANES + i], b[MIDPOINT + 2 * LANES + i] = x1, x2, x3
        x1, x2, x3 = _after(b, i, half, time + half, x1, x2, x3)
        b[END + i], b[END + LANES + i], b[END + 2 * LANES + i] = x1, x2, x3


@kernel
def flow_to(b, i, fraction):
    """Move the first three states of lane i to a `fraction` of its step."""
    half, time = 0.5 * fraction * b[STEP + i], b[TIME + i]
    x1, x2, x3 = _after(b, i, half, time, b[START + i], b[START + LANES + i], b[START + 2 * LANES + i])
    x1, x2, x3 = _after(b, i, half, time + half, x1, x2, x3)
    b[START + i], b[START + LANES + i], b[START + 2 * LANES + i] = x1, x2, x3
