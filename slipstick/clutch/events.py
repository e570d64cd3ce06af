"""Events within a step: what ends a discrete state is located, and the lane continues from there."""

from functools import partial

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.flow import flow_to
from slipstick.clutch.lanes import (
    BREAKAWAY,
    BREAKAWAY_FIRST,
    DIRECTION,
    END,
    END_TIME,
    EVENT,
    FIRST,
    INVERSE_GEAR,
    LANES,
    MIDDLE,
    MOVING,
    RATE,
    RELEASE,
    RELEASE_FIRST,
    RIGID,
    SEGMENT_END,
    SLIPPING,
    START,
    STEP,
    TIME,
)

DIVERGENCE_LIMIT = 1e9
"""The solution has diverged where the sum of the absolute states exceeds this or is NaN."""

NO_EVENT = 0
SEGMENT_ENDS, LOCKS, RELEASES, STOPS, STARTS, DIVERGES = (1 << bit for bit in range(6))
"""What a step may contain, as bits of EVENT: the end of a segment of the current, where it ends, and located events, of
which one follows from a bit: those end a discrete state, or mark divergence."""


@kernel
def mark_events(b):
    """Set EVENT to the sum of what the steps contain."""
    for i in range(LANES):
        input_speed, output_speed = b[END + 3 * LANES + i], b[END + 4 * LANES + i]
        slip = input_speed * b[INVERSE_GEAR + i] - output_speed
        slipping, moving = b[SLIPPING + i] > 0.0, b[MOVING + i] > 0.0
        locks = slipping & (slip * b[DIRECTION + i] <= 0.0)
        releases = (not slipping) & (b[RELEASE + i] > 0.0)
        stops = moving & (output_speed < 0.0)
        starts = (not moving) & (b[BREAKAWAY + i] > 0.0)
        size = abs(input_speed) + abs(output_speed) + abs(b[END + i]) + abs(b[END + LANES + i])
        diverges = not (size + abs(b[END + 2 * LANES + i]) < DIVERGENCE_LIMIT)
        ends = b[END_TIME + i] >= b[SEGMENT_END + i]
        b[EVENT + i] = (ends * SEGMENT_ENDS + locks * LOCKS + releases * RELEASES + stops * STOPS + starts * STARTS
                        + diverges * DIVERGES)


@kernel
def dense_output(b, k, fraction):
    """State k (row and lane) at `fraction` of the step: cubic dense output of fourth-order Runge-Kutta.

    It needs the rates of the last stage in RATE, which stay there until the next step.
    """
    square, cube = fraction * fraction, fraction * fraction * fraction
    first = fraction - 1.5 * square + 2.0 / 3.0 * cube
    middle = square - 2.0 / 3.0 * cube
    last = -0.5 * square + 2.0 / 3.0 * cube
    return b[START + k] + b[STEP + k % LANES] * (first * b[FIRST + k] + middle * b[MIDDLE + k] + last * b[RATE + k])


@partial(kernel, fastmath=False)
def speed_crossing(b, i, input_factor):
    """Fraction of the step of lane i at which input_factor * Omega - omega crosses zero, or 1 if it does not.

    Newton's method on the cubic dense output, within the bracket of the crossing; convergence is quadratic, so that the
    error is the square of the last change. There are no fused operations, with which the slip of plates that have just
    locked is not exactly 0: they would lock at the start of every step, without end.
    """
    speed, load, step = 3 * LANES + i, 4 * LANES + i, b[STEP + i]
    value = input_factor * b[START + speed] - b[START + load]
    first = step * (input_factor * b[FIRST + speed] - b[FIRST + load])
    middle = step * (input_factor * b[MIDDLE + speed] - b[MIDDLE + load])
    last = step * (input_factor * b[RATE + speed] - b[RATE + load])
    square, cube = middle - 1.5 * first - 0.5 * last, 2.0 / 3.0 * (first - middle + last)
    at_end = value + first + square + cube
    if value == 0.0:  # plates that have just broken away may lock again: the cubic without its crossing at the start
        value, first, square, cube = first, square, cube, 0.0
    if value == 0.0 or value * at_end > 0.0:
        return 1.0
    low, high, fraction = 0.0, 1.0, value / (value - at_end)
    for _ in range(60):
        residual = value + fraction * (first + fraction * (square + fraction * cube))
        if (residual > 0.0) == (value > 0.0):
            low = fraction
        else:
            high = fraction
        newton = fraction - residual / (first + fraction * (2.0 * square + fraction * 3.0 * cube))
        before, fraction = fraction, newton if low < newton < high else 0.5 * (low + high)
        if abs(fraction - before) < 1e-7:
            return fraction
    return high


@kernel
def linear_crossing(before, after):
    """Fraction of the step at which a linear quantity from `before` to `after` > 0 crosses zero; 0 if `before` >= 0."""
    return before / (before - after) if before < 0.0 else 0.0


@kernel
def locate_event(b, i):
    """First event of lane i in this step, and the fraction of the step at which it occurs.

    It follows what `mark_events` found: conditions that are computed twice may be rounded differently, and an event
    that is marked and not found would be looked for without end.
    """
    marks = int(b[EVENT + i])
    if marks & DIVERGES:
        return DIVERGES, 1.0
    event, fraction = NO_EVENT, 1.0
    if marks & LOCKS:
        event, fraction = LOCKS, speed_crossing(b, i, b[INVERSE_GEAR + i])
    elif marks & RELEASES:
        event, fraction = RELEASES, linear_crossing(b[RELEASE_FIRST + i], b[RELEASE + i])
    if marks & STOPS:
        at = speed_crossing(b, i, 0.0)
        if at <= fraction:
            event, fraction = STOPS, at
    elif marks & STARTS:
        at = linear_crossing(b[BREAKAWAY_FIRST + i], b[BREAKAWAY + i])
        if at <= fraction:
            event, fraction = STARTS, at
    return event, fraction


@kernel
def apply_event(b, i, event, fraction, state_size):
    """Move lane i to `fraction` of its step, and into the discrete state that follows the event."""
    if fraction < 1.0:
        flow_to(b, i, fraction)
    else:
        for k in range(i, 3 * LANES, LANES):
            b[START + k] = b[END + k]
    for s in range(3, state_size):
        k = s * LANES + i
        b[START + k] = dense_output(b, k, fraction) if fraction < 1.0 else b[END + k]
    b[TIME + i] = b[TIME + i] + fraction * b[STEP + i] if fraction < 1.0 else b[END_TIME + i]
    if event in (LOCKS, RELEASES):  # the slip is exactly 0, as `speed_crossing` needs it
        b[START + 4 * LANES + i] = b[START + 3 * LANES + i] * b[INVERSE_GEAR + i]
    if event == LOCKS:
        b[SLIPPING + i] = 0.0
    elif event == RELEASES:
        b[SLIPPING + i] = 1.0
        b[DIRECTION + i] = 1.0 if b[RIGID + i] >= 0.0 else -1.0
    elif event == STOPS:
        b[MOVING + i] = 0.0
        b[START + 4 * LANES + i] = 0.0
    elif event == STARTS:
        b[MOVING + i] = 1.0
