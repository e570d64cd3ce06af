"""Runge-Kutta of order four over all lanes at once; each lane has its own time, step and mode.

A lane steps coarsely while its torques are smooth, twice so once its pressure is calm, and finely while its piston
is in, or may reach, the share of the stroke in which f_reg rises. Steps end where the current bends. The sign of the
slip and the mode are frozen during a step; a mode that ends is located on the step's cubic dense output, and the lane
goes on from there. Lanes share nothing: a result does not depend on what is computed beside it.
"""

from slipstick.clutch import memories
from slipstick.clutch.driveline import driveline
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hydraulics import hydraulics
from slipstick.clutch.lanes import (
    BREAKAWAY,
    BREAKAWAY_FIRST,
    CLEARANCE_CHANGE,
    CONTACT_POSITION,
    DIRECTION,
    END,
    END_TIME,
    EVENT,
    FIRST,
    INVERSE_GEAR,
    INVERSE_RAMP_WIDTH,
    LANES,
    SEGMENT_END,
    MIDDLE,
    MOVING,
    PISTON_GAIN,
    RATE,
    RELEASE,
    RELEASE_FIRST,
    MEMORY_FLAG,
    RESPONSE_TIME,
    RIGID,
    SLIPPING,
    STAGE_TIME,
    START,
    STAGE,
    STATE_SIZE,
    STEP,
    TIME,
)

DIVERGENCE_LIMIT = 1e9
"""States that add up to more than this, or to no number at all, have blown up."""

SMOOTH_PRESSURE = 1e-4
"""Where the pressure bends by less than this (bar) within a coarse step, the step may be twice as long."""

STABLE_FRACTION = 0.3
"""Longest step, as a share of the delay of the current and of a third of the piston's time constant."""

NO_EVENT, LOCKS, STOPS, STARTS, RELEASES, DIVERGES = range(6)


@kernel
def first_stage(b, active, fine, coarse):
    """Evaluate the rates at the start and choose every lane's step in s."""
    for i in range(STATE_SIZE * LANES):
        b[STAGE + i] = b[START + i]
    if active[MEMORY_FLAG]:
        memories.begin(b)
    for i in range(LANES):
        b[STAGE_TIME + i] = b[TIME + i]
    hydraulics(b, active)
    driveline(b, active)
    for i in range(STATE_SIZE * LANES):
        b[FIRST + i] = b[RATE + i]
    if active[MEMORY_FLAG]:
        memories.keep_first(b)
    for i in range(LANES):
        b[BREAKAWAY_FIRST + i] = b[BREAKAWAY + i]
        b[RELEASE_FIRST + i] = b[RELEASE + i]
        here = b[PISTON_GAIN + i] * b[START + 2 * LANES + i] - b[CLEARANCE_CHANGE + i]
        calm = abs(b[FIRST + LANES + i]) * coarse * coarse < SMOOTH_PRESSURE
        longest = 2.0 * coarse if calm else coarse
        # A quarter more than the step: the piston may speed up.
        there = here + 1.25 * longest * b[PISTON_GAIN + i] * b[FIRST + 2 * LANES + i]
        onset = b[CONTACT_POSITION + i] - 1.0 / b[INVERSE_RAMP_WIDTH + i]
        in_ramp = (max(here, there) > onset) & (min(here, there) < b[CONTACT_POSITION + i])
        slip = b[START + 3 * LANES + i] * b[INVERSE_GEAR + i] - b[START + 4 * LANES + i]
        slip_rate = b[FIRST + 3 * LANES + i] * b[INVERSE_GEAR + i] - b[FIRST + 4 * LANES + i]
        locking = (b[SLIPPING + i] > 0.0) & ((slip + longest * slip_rate) * b[DIRECTION + i] < 0.0)
        # Never more than a share of the shortest time constant; one so short that this would take for ever blows up.
        stable = max(STABLE_FRACTION * b[RESPONSE_TIME + i], fine * 0.02)
        step = min(stable, fine if (in_ramp | locking) else longest)
        left = b[SEGMENT_END + i] - b[TIME + i]
        b[STEP + i] = min(step, left)
        b[END_TIME + i] = b[SEGMENT_END + i] if step >= left else b[TIME + i] + step


@kernel
def other_stages(b, active):
    """Stages two to four, and the states at the end of every lane's step."""
    for stage in range(3):
        share = 1.0 if stage == 2 else 0.5
        for s in range(STATE_SIZE):
            for i in range(LANES):
                b[STAGE + s * LANES + i] = b[START + s * LANES + i] + share * b[STEP + i] * b[RATE + s * LANES + i]
        if active[MEMORY_FLAG]:
            memories.advance(b, share)
        for i in range(LANES):
            b[STAGE_TIME + i] = b[TIME + i] + share * b[STEP + i]
        hydraulics(b, active)
        driveline(b, active)
        if stage == 0:
            for i in range(STATE_SIZE * LANES):
                b[MIDDLE + i] = b[RATE + i]
        elif stage == 1:
            for i in range(STATE_SIZE * LANES):
                b[MIDDLE + i] += b[RATE + i]
        if active[MEMORY_FLAG]:
            memories.keep(b, stage)
    for s in range(STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            b[END + k] = b[START + k] + b[STEP + i] / 6.0 * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])
    if active[MEMORY_FLAG]:
        memories.finish(b)


@kernel
def events(b):
    """Mark the lanes whose step ends on a bend of the current (1) or within which a mode ends or numbers are lost (2).

    Returns the sum of the marks.
    """
    total = 0
    for i in range(LANES):
        input_speed, output_speed = b[END + 3 * LANES + i], b[END + 4 * LANES + i]
        slip = input_speed * b[INVERSE_GEAR + i] - output_speed
        slipping, moving = b[SLIPPING + i] > 0.0, b[MOVING + i] > 0.0
        locks = slipping & (slip * b[DIRECTION + i] <= 0.0)
        releases = (not slipping) & (b[RELEASE + i] > 0.0)
        stops = moving & (output_speed < 0.0)
        starts = (not moving) & (b[BREAKAWAY + i] > 0.0)
        size = abs(input_speed) + abs(output_speed) + abs(b[END + i]) + abs(b[END + LANES + i])
        sane = size + abs(b[END + 2 * LANES + i]) < DIVERGENCE_LIMIT
        mark = 2.0 if (locks | releases | stops | starts | (not sane)) else 0.0
        mark = max(mark, 1.0) if b[END_TIME + i] >= b[SEGMENT_END + i] else mark
        b[EVENT + i] = mark
        total += int(mark)
    return total


@kernel
def accept(b, active):
    """Move every lane to the end of its step, but for those in which a mode ends."""
    for s in range(STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            start, end = b[START + k], b[END + k]
            b[START + k] = start if b[EVENT + i] > 1.0 else end
    if active[MEMORY_FLAG]:
        memories.accept(b)
    for i in range(LANES):
        start, end = b[TIME + i], b[END_TIME + i]
        b[TIME + i] = start if b[EVENT + i] > 1.0 else end


@kernel
def dense(b, k, share):
    """State k (row and lane) at `share` of the step: the cubic dense output of Runge-Kutta of order four.

    RATE still holds the rates of the last stage: nothing evaluates them again before the next step.
    """
    square, cube = share * share, share * share * share
    first = share - 1.5 * square + 2.0 / 3.0 * cube
    middle = square - 2.0 / 3.0 * cube
    last = -0.5 * square + 2.0 / 3.0 * cube
    return b[START + k] + b[STEP + k % LANES] * (first * b[FIRST + k] + middle * b[MIDDLE + k] + last * b[RATE + k])


@kernel
def crossing(b, i, of_input):
    """Share of lane i's step at which of_input * Omega - omega falls through zero: regula falsi (Illinois)."""
    speed, load = 3 * LANES + i, 4 * LANES + i
    low, at_low = 0.0, of_input * b[START + speed] - b[START + load]
    high, at_high = 1.0, of_input * dense(b, speed, 1.0) - dense(b, load, 1.0)
    if at_low == 0.0 or at_low * at_high > 0.0:
        return 1.0
    for _ in range(30):
        share = (low * at_high - high * at_low) / (at_high - at_low)
        value = of_input * dense(b, speed, share) - dense(b, load, share)
        if (value > 0.0) == (at_low > 0.0):
            low, at_low, at_high = share, value, 0.5 * at_high
        else:
            high, at_high, at_low = share, value, 0.5 * at_low
        if abs(value) < 1e-11 or high - low < 1e-12:
            return share
    return high


@kernel
def onset(before, after):
    """Share of the step at which a quantity that goes from `before` to `after` > 0 passes zero."""
    return before / (before - after) if before < 0.0 else 0.0


@kernel
def locate(b, i):
    """The first thing that happens to lane i in this step: (what, at which share of the step)."""
    size = 0.0
    for s in range(STATE_SIZE):
        size += abs(b[END + s * LANES + i])
    if not size < DIVERGENCE_LIMIT:
        return DIVERGES, 1.0
    what, share = NO_EVENT, 1.0
    if b[SLIPPING + i] > 0.0:
        slip = b[END + 3 * LANES + i] * b[INVERSE_GEAR + i] - b[END + 4 * LANES + i]
        if slip * b[DIRECTION + i] <= 0.0:
            what, share = LOCKS, crossing(b, i, b[INVERSE_GEAR + i])
    elif b[RELEASE + i] > 0.0:
        what, share = RELEASES, onset(b[RELEASE_FIRST + i], b[RELEASE + i])
    if b[MOVING + i] > 0.0 and b[END + 4 * LANES + i] < 0.0:
        at = crossing(b, i, 0.0)
        if at <= share:
            what, share = STOPS, at
    elif b[MOVING + i] == 0.0 and b[BREAKAWAY + i] > 0.0:
        at = onset(b[BREAKAWAY_FIRST + i], b[BREAKAWAY + i])
        if at <= share:
            what, share = STARTS, at
    return what, share


@kernel
def settle(b, i, what, share, states):
    """Move lane i to `share` of its step and into the mode that begins there."""
    for s in range(states):
        k = s * LANES + i
        b[START + k] = dense(b, k, share) if share < 1.0 else b[END + k]
    b[TIME + i] = b[TIME + i] + share * b[STEP + i] if share < 1.0 else b[END_TIME + i]
    if what == LOCKS:
        b[SLIPPING + i] = 0.0
        b[START + 4 * LANES + i] = b[START + 3 * LANES + i] * b[INVERSE_GEAR + i]
    elif what == RELEASES:
        b[SLIPPING + i] = 1.0
        b[DIRECTION + i] = 1.0 if b[RIGID + i] >= 0.0 else -1.0
    elif what == STOPS:
        b[MOVING + i] = 0.0
        b[START + 4 * LANES + i] = 0.0
    elif what == STARTS:
        b[MOVING + i] = 1.0
