"""Fourth-order Runge-Kutta over all lanes at once; each lane has its own time, step and discrete state.

Steps are coarse while the torques are smooth, twice as long while the pressure is smooth too, and fine while the
piston is in the part of the stroke where f_reg rises, or may reach it. Steps end at the breakpoints of the current. The
discrete state (rest, slip or stick) and the sign of the slip are constant during a step. An event that ends a discrete
state is located within the step, and the lane continues from there. Lanes are independent of each other.
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
    LAW_MEMORY_FLAG,
    MEMORY_FLAG,
    MIDDLE,
    MOVING,
    PISTON_GAIN,
    RATE,
    RELEASE,
    RELEASE_FIRST,
    RESPONSE_TIME,
    RIGID,
    SEGMENT_END,
    SLIPPING,
    STAGE,
    STAGE_TIME,
    START,
    STATE_SIZE,
    STEP,
    TIME,
)

DIVERGENCE_LIMIT = 1e9
"""The solution has diverged where the sum of the absolute states exceeds this or is NaN."""

SMOOTH_PRESSURE = 1e-4
"""Bound in bar on x2' times the squared coarse step, below which the step may be twice as long."""

STABLE_FRACTION = 0.3
"""Longest step for stability, as a fraction of RESPONSE_TIME: the minimum of the delay of the current, three time
constants of the piston, and the time constants of the effects."""

NO_EVENT, LOCKS, STOPS, STARTS, RELEASES, DIVERGES = range(6)


@kernel
def first_stage(b, active, fine, coarse):
    """Evaluate the rates at the start of the step and choose the step of each lane in s."""
    for i in range(STATE_SIZE * LANES):
        b[STAGE + i] = b[START + i]
    if active[MEMORY_FLAG]:
        memories.begin_step(b)
        if active[LAW_MEMORY_FLAG]:
            memories.begin_law_step(b)
    for i in range(LANES):
        b[STAGE_TIME + i] = b[TIME + i]
    hydraulics(b, active)
    driveline(b, active)
    for i in range(STATE_SIZE * LANES):
        b[FIRST + i] = b[RATE + i]
    if active[MEMORY_FLAG]:
        memories.store_first_rate(b)
        if active[LAW_MEMORY_FLAG]:
            memories.store_first_law_rate(b)
    for i in range(LANES):
        b[BREAKAWAY_FIRST + i] = b[BREAKAWAY + i]
        b[RELEASE_FIRST + i] = b[RELEASE + i]
        position = b[PISTON_GAIN + i] * b[START + 2 * LANES + i] - b[CLEARANCE_CHANGE + i]
        is_smooth = abs(b[FIRST + LANES + i]) * coarse * coarse < SMOOTH_PRESSURE
        longest = 2.0 * coarse if is_smooth else coarse
        # A quarter of the step is added as a margin, because the piston may accelerate.
        next_position = position + 1.25 * longest * b[PISTON_GAIN + i] * b[FIRST + 2 * LANES + i]
        onset = b[CONTACT_POSITION + i] - 1.0 / b[INVERSE_RAMP_WIDTH + i]
        in_ramp = (max(position, next_position) > onset) & (min(position, next_position) < b[CONTACT_POSITION + i])
        slip = b[START + 3 * LANES + i] * b[INVERSE_GEAR + i] - b[START + 4 * LANES + i]
        slip_rate = b[FIRST + 3 * LANES + i] * b[INVERSE_GEAR + i] - b[FIRST + 4 * LANES + i]
        locking = (b[SLIPPING + i] > 0.0) & ((slip + longest * slip_rate) * b[DIRECTION + i] < 0.0)
        # Steps are bounded by the shortest time constant. The lower limit bounds the run time; where it applies, the
        # solution may diverge.
        stable = max(STABLE_FRACTION * b[RESPONSE_TIME + i], fine * 0.02)
        step = min(stable, fine if (in_ramp | locking) else longest)
        remaining = b[SEGMENT_END + i] - b[TIME + i]
        b[STEP + i] = min(step, remaining)
        b[END_TIME + i] = b[SEGMENT_END + i] if step >= remaining else b[TIME + i] + step


@kernel
def other_stages(b, active):
    """Evaluate stages two to four, and the state vector at the end of the step."""
    for stage in range(3):
        fraction = 1.0 if stage == 2 else 0.5
        for s in range(STATE_SIZE):
            for i in range(LANES):
                b[STAGE + s * LANES + i] = b[START + s * LANES + i] + fraction * b[STEP + i] * b[RATE + s * LANES + i]
        if active[MEMORY_FLAG]:
            memories.advance_stage(b, fraction)
            if active[LAW_MEMORY_FLAG]:
                memories.advance_law_stage(b, fraction)
        for i in range(LANES):
            b[STAGE_TIME + i] = b[TIME + i] + fraction * b[STEP + i]
        hydraulics(b, active)
        driveline(b, active)
        if stage == 0:
            for i in range(STATE_SIZE * LANES):
                b[MIDDLE + i] = b[RATE + i]
        elif stage == 1:
            for i in range(STATE_SIZE * LANES):
                b[MIDDLE + i] += b[RATE + i]
        if active[MEMORY_FLAG]:
            memories.sum_middle_rates(b, stage)
            if active[LAW_MEMORY_FLAG]:
                memories.sum_middle_law_rates(b, stage)
    for s in range(STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            b[END + k] = b[START + k] + b[STEP + i] / 6.0 * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])
    if active[MEMORY_FLAG]:
        memories.finish_step(b)
        if active[LAW_MEMORY_FLAG]:
            memories.finish_law_step(b)


@kernel
def mark_events(b):
    """Set EVENT to 1 where a step ends at a breakpoint of the current, and to 2 where it contains a located event.

    Located events end a discrete state, or mark divergence. Returns the sum of EVENT over the lanes.
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
        is_bounded = size + abs(b[END + 2 * LANES + i]) < DIVERGENCE_LIMIT
        mark = 2.0 if (locks | releases | stops | starts | (not is_bounded)) else 0.0
        mark = max(mark, 1.0) if b[END_TIME + i] >= b[SEGMENT_END + i] else mark
        b[EVENT + i] = mark
        total += int(mark)
    return total


@kernel
def accept_step(b, active):
    """Move every lane to the end of its step, except lanes with a located event."""
    for s in range(STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            start, end = b[START + k], b[END + k]
            b[START + k] = start if b[EVENT + i] > 1.0 else end
    if active[MEMORY_FLAG]:
        memories.accept_step(b)
        if active[LAW_MEMORY_FLAG]:
            memories.accept_law_step(b)
    for i in range(LANES):
        start, end = b[TIME + i], b[END_TIME + i]
        b[TIME + i] = start if b[EVENT + i] > 1.0 else end


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


@kernel
def speed_crossing(b, i, input_factor):
    """Fraction of the step of lane i at which input_factor * Omega - omega crosses zero, by regula falsi (Illinois)."""
    speed, load = 3 * LANES + i, 4 * LANES + i
    low, at_low = 0.0, input_factor * b[START + speed] - b[START + load]
    high, at_high = 1.0, input_factor * dense_output(b, speed, 1.0) - dense_output(b, load, 1.0)
    if at_low == 0.0 or at_low * at_high > 0.0:
        return 1.0
    for _ in range(30):
        fraction = (low * at_high - high * at_low) / (at_high - at_low)
        value = input_factor * dense_output(b, speed, fraction) - dense_output(b, load, fraction)
        if (value > 0.0) == (at_low > 0.0):
            low, at_low, at_high = fraction, value, 0.5 * at_high
        else:
            high, at_high, at_low = fraction, value, 0.5 * at_low
        if abs(value) < 1e-11 or high - low < 1e-12:
            return fraction
    return high


@kernel
def linear_crossing(before, after):
    """Fraction of the step at which a linear quantity from `before` to `after` > 0 crosses zero; 0 if `before` >= 0."""
    return before / (before - after) if before < 0.0 else 0.0


@kernel
def locate_event(b, i):
    """First event of lane i in this step, and the fraction of the step at which it occurs."""
    size = 0.0
    for s in range(STATE_SIZE):
        size += abs(b[END + s * LANES + i])
    if not size < DIVERGENCE_LIMIT:
        return DIVERGES, 1.0
    event, fraction = NO_EVENT, 1.0
    if b[SLIPPING + i] > 0.0:
        slip = b[END + 3 * LANES + i] * b[INVERSE_GEAR + i] - b[END + 4 * LANES + i]
        if slip * b[DIRECTION + i] <= 0.0:
            event, fraction = LOCKS, speed_crossing(b, i, b[INVERSE_GEAR + i])
    elif b[RELEASE + i] > 0.0:
        event, fraction = RELEASES, linear_crossing(b[RELEASE_FIRST + i], b[RELEASE + i])
    if b[MOVING + i] > 0.0 and b[END + 4 * LANES + i] < 0.0:
        at = speed_crossing(b, i, 0.0)
        if at <= fraction:
            event, fraction = STOPS, at
    elif b[MOVING + i] == 0.0 and b[BREAKAWAY + i] > 0.0:
        at = linear_crossing(b[BREAKAWAY_FIRST + i], b[BREAKAWAY + i])
        if at <= fraction:
            event, fraction = STARTS, at
    return event, fraction


@kernel
def apply_event(b, i, event, fraction, state_size):
    """Move lane i to `fraction` of its step, and into the discrete state that follows the event."""
    for s in range(state_size):
        k = s * LANES + i
        b[START + k] = dense_output(b, k, fraction) if fraction < 1.0 else b[END + k]
    b[TIME + i] = b[TIME + i] + fraction * b[STEP + i] if fraction < 1.0 else b[END_TIME + i]
    if event == LOCKS:
        b[SLIPPING + i] = 0.0
        b[START + 4 * LANES + i] = b[START + 3 * LANES + i] * b[INVERSE_GEAR + i]
    elif event == RELEASES:
        b[SLIPPING + i] = 1.0
        b[DIRECTION + i] = 1.0 if b[RIGID + i] >= 0.0 else -1.0
    elif event == STOPS:
        b[MOVING + i] = 0.0
        b[START + 4 * LANES + i] = 0.0
    elif event == STARTS:
        b[MOVING + i] = 1.0
