"""Integration of the memories of effects; called only if an effect with a memory is active.

They are separate from the five model states because loops over a variable number of rows compile to scalar code.
"""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    END,
    EVENT,
    FIRST,
    FULL_STATE_SIZE,
    LANES,
    MIDDLE,
    RATE,
    STAGE,
    START,
    STATE_SIZE,
    STEP,
)


@kernel
def begin_step(b):
    """Set the memories at the first stage."""
    for i in range(STATE_SIZE * LANES, FULL_STATE_SIZE * LANES):
        b[STAGE + i] = b[START + i]


@kernel
def store_first_rate(b):
    """Store the rates of the first stage, and the initial values of relaxed memories set there at t = 0."""
    for i in range(STATE_SIZE * LANES, FULL_STATE_SIZE * LANES):
        b[FIRST + i] = b[RATE + i]
        b[START + i] = b[STAGE + i]


@kernel
def advance_stage(b, fraction):
    """Set the memories at a later stage, at `fraction` of the step."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        for i in range(LANES):
            b[STAGE + s * LANES + i] = b[START + s * LANES + i] + fraction * b[STEP + i] * b[RATE + s * LANES + i]


@kernel
def sum_middle_rates(b, stage):
    """Store the sum of the rates of the two middle stages."""
    for i in range(STATE_SIZE * LANES, FULL_STATE_SIZE * LANES):
        if stage == 0:
            b[MIDDLE + i] = b[RATE + i]
        elif stage == 1:
            b[MIDDLE + i] += b[RATE + i]


@kernel
def finish_step(b):
    """Compute the memories at the end of the step."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            b[END + k] = b[START + k] + b[STEP + i] / 6.0 * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])


@kernel
def accept_step(b):
    """Move the memories to the end of the step, except in lanes with an event."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            start, end = b[START + k], b[END + k]
            b[START + k] = start if b[EVENT + i] > 1.0 else end
