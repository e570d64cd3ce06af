"""The solution of eq. 1 on a segment of the current: exact for the paper's equation, and for constant changes of it.

Pressure and piston obey linear equations with constant coefficients. The pressure deviates from its steady rise
k (u - a - tau u') by e, with e1' = e2 and e2' = -6/tau^2 e1 - 4/tau e2: a decay at the rate 2/tau with the angular
frequency sqrt(2)/tau. The piston state is p e1 + r e2 + g with two constants p and r of the parameters, and g follows a
linear function of the time with the rate of the return spring.

What effects and laws add to the three rates, `FORCE`, is constant in this solution. Its change during the step is
integrated by the Runge-Kutta method, as in an integrating factor method (Lawson, SIAM J. Numer. Anal. 4, 372, 1967).
"""

from slipstick.clutch.fastmath import inlined, kernel
from slipstick.clutch.lanes import (
    CURRENT_BIAS,
    END,
    FORCE,
    FORCE_LAST,
    FORCE_MIDDLE,
    INVERSE_STIFFNESS,
    LANES,
    MIDPOINT,
    PISTON_FROM_PRESSURE,
    PISTON_FROM_RATE,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RATE,
    PISTON_RETURN,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_BIAS,
    PRESSURE_CHANGE,
    PRESSURE_DAMPING,
    PRESSURE_RATE,
    PRESSURE_STIFFNESS,
    SEGMENT_CURRENT,
    SEGMENT_SLOPE,
    SEGMENT_TIME,
    STAGE,
    START,
    STEP,
    TIME,
    VALVE_DELAY,
    VALVE_GAIN,
)


@inlined
def _decay(b, i, duration, e1, e2):
    """Deviations of the pressure and its rate after a `duration` in s, by series that are exact to 1e-11.

    They are for durations up to half of VALVE_TIME.
    """
    stiffness, decay = b[PRESSURE_STIFFNESS + i], 0.5 * b[PRESSURE_DAMPING + i]
    x = -0.25 * decay * duration  # e^4x by the series of e^x
    p = 1.0 + x * (1.0 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040 + x * (
        1 / 40320 + 1 / 362880 * x))))))))
    damped = p * p * p * p
    y = -0.5 * decay * decay * duration * duration  # minus the square of the angle
    cosine = 1.0 + y * (1 / 2 + y * (1 / 24 + y * (1 / 720 + y * (1 / 40320 + y * (1 / 3628800 + 1 / 479001600 * y)))))
    sine = duration * (1.0 + y * (1 / 6 + y * (1 / 120 + y * (1 / 5040 + y * (1 / 362880 + 1 / 39916800 * y)))))
    return (damped * ((cosine + decay * sine) * e1 + sine * e2),
            damped * ((cosine - decay * sine) * e2 - stiffness * sine * e1))


@inlined
def _relax_piston(b, i, duration, g, held, rise):
    """The rest g of the piston state after a `duration` in s, driven by `held` and its `rise` per s."""
    z = b[PISTON_RETURN + i] * duration  # second = (e^-z - 1 + z) / z^2, without a division by a weak spring
    second = 1 / 2 - z * (1 / 6 - z * (1 / 24 - z * (1 / 120 - z * (1 / 720 - z * (1 / 5040 - z * (1 / 40320 - z * (
        1 / 362880 - 1 / 3628800 * z)))))))
    first = 1.0 - z * second
    return (1.0 - z * first) * g + duration * (first * held + duration * second * rise)


@inlined
def _advance(b, i, duration, time, pressure, pressure_rate, piston_state):
    """The three states of lane i a `duration` in s after they have been given ones at a `time` in s."""
    own, of_rate = b[PISTON_FROM_PRESSURE + i], b[PISTON_FROM_RATE + i]
    current = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (time - b[SEGMENT_TIME + i])
    rise = b[VALVE_GAIN + i] * b[SEGMENT_SLOPE + i]
    steady = (b[VALVE_GAIN + i] * (current - b[CURRENT_BIAS + i]) - b[VALVE_DELAY + i] * rise
              + (b[FORCE + LANES + i] + b[PRESSURE_DAMPING + i] * b[FORCE + i]) * b[INVERSE_STIFFNESS + i])
    steady_rate = rise - b[FORCE + i]
    e1, e2 = pressure - steady, pressure_rate - steady_rate
    f1, f2 = _decay(b, i, duration, e1, e2)
    held = (b[PISTON_PRESSURE + i] * (steady - b[PRESSURE_BIAS + i]) + b[PISTON_PRESSURE_RATE + i] * steady_rate
            + b[FORCE + 2 * LANES + i])
    g = _relax_piston(b, i, duration, piston_state - own * e1 - of_rate * e2, held, b[PISTON_PRESSURE + i] * rise)
    return steady + rise * duration + f1, steady_rate + f2, own * f1 + of_rate * f2 + g


@kernel
def flow(b):
    """Set MIDPOINT and the first three rows of END: the states in the middle and at the end of the step."""
    for i in range(LANES):
        half, time = 0.5 * b[STEP + i], b[TIME + i]
        x1, x2, x3 = _advance(b, i, half, time, b[START + i], b[START + LANES + i], b[START + 2 * LANES + i])
        b[MIDPOINT + i], b[MIDPOINT + LANES + i], b[MIDPOINT + 2 * LANES + i] = x1, x2, x3
        x1, x2, x3 = _advance(b, i, half, time + half, x1, x2, x3)
        b[END + i], b[END + LANES + i], b[END + 2 * LANES + i] = x1, x2, x3


@inlined
def _force(b, i):
    """What effects and laws add to the three rates at the current stage; zero without them.

    The second state is w, in which the pressure rate is w - 2/tau c (`valve`).
    """
    change, damping = b[PRESSURE_CHANGE + i], b[PRESSURE_DAMPING + i]
    offset = 0.5 * damping * change
    rate = b[PRESSURE_RATE + i] + offset
    paper = (b[PISTON_PRESSURE + i] * (b[PRESSURE + i] - b[PRESSURE_BIAS + i])
             + b[PISTON_PRESSURE_RATE + i] * rate - b[PISTON_RETURN + i] * b[PISTON_STATE + i])
    return -offset, b[PRESSURE_STIFFNESS + i] * change + damping * offset, b[PISTON_RATE + i] - paper


@kernel
def store_force(b):
    """Set FORCE at the first stage."""
    for i in range(LANES):
        f1, f2, f3 = _force(b, i)
        b[FORCE + i], b[FORCE + LANES + i], b[FORCE + 2 * LANES + i] = f1, f2, f3


@kernel
def change_stage(b, stage):
    """Add to the states of a stage what the change of the force up to the stage before makes of them."""
    for i in range(LANES):
        if stage == 1:
            for s in range(3):
                k = s * LANES + i
                b[STAGE + k] += 0.5 * b[STEP + i] * b[FORCE_MIDDLE + k]
        elif stage == 2:
            x1, x2, x3 = _carry(b, i, b[FORCE_LAST + i], b[FORCE_LAST + LANES + i], b[FORCE_LAST + 2 * LANES + i])
            b[STAGE + i] += b[STEP + i] * x1
            b[STAGE + LANES + i] += b[STEP + i] * x2
            b[STAGE + 2 * LANES + i] += b[STEP + i] * x3


@inlined
def _carry(b, i, d1, d2, d3):
    """A change of the three states in the middle of the step, at its end."""
    half, own, of_rate = 0.5 * b[STEP + i], b[PISTON_FROM_PRESSURE + i], b[PISTON_FROM_RATE + i]
    f1, f2 = _decay(b, i, half, d1, d2)
    return f1, f2, own * f1 + of_rate * f2 + _relax_piston(b, i, half, d3 - own * d1 - of_rate * d2, 0.0, 0.0)


@kernel
def store_change(b, stage):
    """Store the change of the force at a stage: of the middle stages their sum, beside that of the present stage."""
    for i in range(LANES):
        f1, f2, f3 = _force(b, i)
        d1, d2, d3 = f1 - b[FORCE + i], f2 - b[FORCE + LANES + i], f3 - b[FORCE + 2 * LANES + i]
        b[FORCE_LAST + i], b[FORCE_LAST + LANES + i], b[FORCE_LAST + 2 * LANES + i] = d1, d2, d3
        if stage == 0:
            b[FORCE_MIDDLE + i], b[FORCE_MIDDLE + LANES + i], b[FORCE_MIDDLE + 2 * LANES + i] = d1, d2, d3
        elif stage == 1:
            b[FORCE_MIDDLE + i] += d1
            b[FORCE_MIDDLE + LANES + i] += d2
            b[FORCE_MIDDLE + 2 * LANES + i] += d3


@kernel
def finish_change(b):
    """Add the integral of the change of the force to the states in the middle and at the end of the step."""
    for i in range(LANES):
        sixth = 1 / 6 * b[STEP + i]
        x1, x2, x3 = _carry(b, i, b[FORCE_MIDDLE + i], b[FORCE_MIDDLE + LANES + i], b[FORCE_MIDDLE + 2 * LANES + i])
        b[END + i] += sixth * (2.0 * x1 + b[FORCE_LAST + i])
        b[END + LANES + i] += sixth * (2.0 * x2 + b[FORCE_LAST + LANES + i])
        b[END + 2 * LANES + i] += sixth * (2.0 * x3 + b[FORCE_LAST + 2 * LANES + i])
        for s in range(3):
            k = s * LANES + i
            b[MIDPOINT + k] += 0.25 * sixth * (4.0 * b[FORCE_MIDDLE + k] - b[FORCE_LAST + k])


@kernel
def flow_to(b, i, fraction):
    """Move the first three states of lane i to a `fraction` of its step."""
    half, time = 0.5 * fraction * b[STEP + i], b[TIME + i]
    x1, x2, x3 = _advance(b, i, half, time, b[START + i], b[START + LANES + i], b[START + 2 * LANES + i])
    x1, x2, x3 = _advance(b, i, half, time + half, x1, x2, x3)
    b[START + i], b[START + LANES + i], b[START + 2 * LANES + i] = x1, x2, x3
    for s in range(3):  # the change of the force is a parabola through 0, its mean in the middle, and its last value
        k = s * LANES + i
        middle, last = 0.5 * b[FORCE_MIDDLE + k], b[FORCE_LAST + k]
        integral = 0.5 * (4.0 * middle - last) + fraction / 3.0 * (2.0 * last - 4.0 * middle)
        b[START + k] += b[STEP + i] * fraction * fraction * integral
