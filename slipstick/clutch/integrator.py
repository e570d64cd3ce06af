"""Fourth-order Runge-Kutta over all lanes at once; each lane has its own time, step and discrete state.

The three states of eq. 1 follow its exact solution (`flow`); the speeds, and what effects change in eq. 1, are
integrated.
Steps end at the breakpoints of the current and where f_reg has a kink (`steps`). The discrete state (rest, slip or
stick) and the sign of the slip are constant during a step. An event that ends a discrete state is located within the
step, and the lane continues from there (`events`). Lanes are independent of each other.
"""

from slipstick.clutch import memories
from slipstick.clutch.driveline import driveline
from slipstick.clutch.events import SEGMENT_ENDS
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.flow import change_stage, finish_change, flow, store_change, store_force
from slipstick.clutch.hydraulics import hydraulics
from slipstick.clutch.lanes import (
    BREAKAWAY,
    BREAKAWAY_FIRST,
    END,
    END_TIME,
    EVENT,
    FIRST,
    HYDRAULICS_FLAG,
    LANES,
    MEMORY_FLAG,
    MIDDLE,
    MIDPOINT,
    RATE,
    RELEASE,
    RELEASE_FIRST,
    STAGE,
    STAGE_TIME,
    START,
    STATE_SIZE,
    STEP,
    STIFFNESS,
    TIME,
)
from slipstick.clutch.steps import choose_steps


@kernel
def first_stage(b, active, fine, coarse):
    """Evaluate the rates at the start of the step and choose the step of each lane in s."""
    for i in range(STATE_SIZE * LANES):
        b[STAGE + i] = b[START + i]
    if active[MEMORY_FLAG]:
        memories.begin_step(b, active)
    for i in range(LANES):
        b[STAGE_TIME + i] = b[TIME + i]
    hydraulics(b, active)
    driveline(b, active)
    if active[HYDRAULICS_FLAG]:
        store_force(b)
    for i in range(STATE_SIZE * LANES):
        b[FIRST + i] = b[RATE + i]
    if active[MEMORY_FLAG]:
        memories.store_first_rate(b, active)
    for i in range(LANES):
        b[BREAKAWAY_FIRST + i] = b[BREAKAWAY + i]
        b[RELEASE_FIRST + i] = b[RELEASE + i]
    choose_steps(b, active, fine, coarse)


@kernel
def other_stages(b, active):
    """Evaluate stages two to four, and the state vector at the end of the step."""
    flow(b)
    for stage in range(3):
        fraction = 1.0 if stage == 2 else 0.5
        for k in range(3 * LANES):
            b[STAGE + k] = b[END + k] if stage == 2 else b[MIDPOINT + k]
        if active[HYDRAULICS_FLAG]:
            change_stage(b, stage)
        for s in range(3, STATE_SIZE):
            for i in range(LANES):
                b[STAGE + s * LANES + i] = b[START + s * LANES + i] + fraction * b[STEP + i] * b[RATE + s * LANES + i]
        if active[MEMORY_FLAG]:
            memories.advance_stage(b, active, fraction)
        for i in range(LANES):
            b[STAGE_TIME + i] = b[TIME + i] + fraction * b[STEP + i]
        hydraulics(b, active)
        driveline(b, active)
        if active[HYDRAULICS_FLAG]:
            store_change(b, stage)
        if stage == 0:
            for i in range(STATE_SIZE * LANES):
                b[MIDDLE + i] = b[RATE + i]
        elif stage == 1:
            store_stiffness(b)
            for i in range(STATE_SIZE * LANES):
                b[MIDDLE + i] += b[RATE + i]
        if active[MEMORY_FLAG] and stage < 2:
            memories.sum_middle_rates(b, active, stage == 0)
    if active[HYDRAULICS_FLAG]:
        finish_change(b)
    for s in range(3, STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            b[END + k] = b[START + k] + 1 / 6 * b[STEP + i] * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])
    if active[MEMORY_FLAG]:
        memories.finish_step(b, active)


@kernel
def store_stiffness(b):
    """Estimate how fast the speeds decay, by the rates of both middle stages, which are at the same time.

    Their speeds differ by half a step times the difference of the first two rates (Hairer and Wanner, Solving Ordinary
    Differential Equations II, section IV.2).
    """
    for i in range(LANES):
        j, k = 3 * LANES + i, 4 * LANES + i
        change = abs(b[RATE + j] - b[MIDDLE + j]) + abs(b[RATE + k] - b[MIDDLE + k])
        distance = 0.5 * b[STEP + i] * (abs(b[MIDDLE + j] - b[FIRST + j]) + abs(b[MIDDLE + k] - b[FIRST + k]))
        b[STIFFNESS + i] = change / (distance + 1e-9)


@kernel
def accept_step(b, active):
    """Move every lane to the end of its step, except lanes with a located event."""
    for s in range(STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            start, end = b[START + k], b[END + k]
            b[START + k] = start if b[EVENT + i] > SEGMENT_ENDS else end
    if active[MEMORY_FLAG]:
        memories.accept_step(b, active)
    for i in range(LANES):
        start, end = b[TIME + i], b[END_TIME + i]
        b[TIME + i] = start if b[EVENT + i] > SEGMENT_ENDS else end
