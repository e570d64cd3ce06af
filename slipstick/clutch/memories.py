"""What the integrator does with the five states, for those that effects keep; called only if one of these is active.

Apart from the five, since loops over a number of rows that the compiler does not know stay scalar.
"""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import FULL_STATE_SIZE, END, EVENT, FIRST, LANES, MIDDLE, RATE, START, STAGE, STATE_SIZE, STEP


@kernel
def begin(b):
    """States at the first stage."""
    for i in range(STATE_SIZE * LANES, FULL_STATE_SIZE * LANES):
        b[STAGE + i] = b[START + i]


@kernel
def keep_first(b):
    """Keep the rates of the first stage, and at t = 0 the value that relaxed memories have been given there."""
    for i in range(STATE_SIZE * LANES, FULL_STATE_SIZE * LANES):
        b[FIRST + i] = b[RATE + i]
        b[START + i] = b[STAGE + i]


@kernel
def advance(b, share):
    """States at a later stage, `share` of the step on."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        for i in range(LANES):
            b[STAGE + s * LANES + i] = b[START + s * LANES + i] + share * b[STEP + i] * b[RATE + s * LANES + i]


@kernel
def keep(b, stage):
    """Keep the sum of the rates of the two middle stages."""
    for i in range(STATE_SIZE * LANES, FULL_STATE_SIZE * LANES):
        if stage == 0:
            b[MIDDLE + i] = b[RATE + i]
        elif stage == 1:
            b[MIDDLE + i] += b[RATE + i]


@kernel
def finish(b):
    """States at the end of the step."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            b[END + k] = b[START + k] + b[STEP + i] / 6.0 * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])


@kernel
def accept(b):
    """On to the end of the step, but for lanes in which a mode ends."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        for i in range(LANES):
            k = s * LANES + i
            start, end = b[START + k], b[END + k]
            b[START + k] = start if b[EVENT + i] > 1.0 else end
