"""Integration of the memories of effects and laws; called only if one is in use.

They are separate from the five model states, and those of laws from those of effects, because loops over a variable
number of rows compile to scalar code.
"""

from functools import partial

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    EFFECT_STATE_SIZE,
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


def _kernels(first, last):
    """Compile the steps of an integration of these rows of the state vector."""
    of_rows = partial(kernel, variant=f"{first}:{last}")

    @of_rows
    def begin_step(b):
        """Set the memories at the first stage."""
        for i in range(first * LANES, last * LANES):
            b[STAGE + i] = b[START + i]

    @of_rows
    def store_first_rate(b):
        """Store the rates of the first stage, and the initial values of relaxed memories set there at t = 0."""
        for i in range(first * LANES, last * LANES):
            b[FIRST + i] = b[RATE + i]
            b[START + i] = b[STAGE + i]

    @of_rows
    def advance_stage(b, fraction):
        """Set the memories at a later stage, at `fraction` of the step."""
        for s in range(first, last):
            for i in range(LANES):
                k = s * LANES + i
                b[STAGE + k] = b[START + k] + fraction * b[STEP + i] * b[RATE + k]

    @of_rows
    def sum_middle_rates(b, stage):
        """Store the sum of the rates of the two middle stages."""
        for i in range(first * LANES, last * LANES):
            if stage == 0:
                b[MIDDLE + i] = b[RATE + i]
            elif stage == 1:
                b[MIDDLE + i] += b[RATE + i]

    @of_rows
    def finish_step(b):
        """Compute the memories at the end of the step."""
        for s in range(first, last):
            for i in range(LANES):
                k = s * LANES + i
                b[END + k] = b[START + k] + b[STEP + i] / 6.0 * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])

    @of_rows
    def accept_step(b):
        """Move the memories to the end of the step, except in lanes with an event."""
        for s in range(first, last):
            for i in range(LANES):
                k = s * LANES + i
                start, end = b[START + k], b[END + k]
                b[START + k] = start if b[EVENT + i] > 1.0 else end

    return begin_step, store_first_rate, advance_stage, sum_middle_rates, finish_step, accept_step


(begin_step, store_first_rate, advance_stage, sum_middle_rates, finish_step,
 accept_step) = _kernels(STATE_SIZE, EFFECT_STATE_SIZE)
(begin_law_step, store_first_law_rate, advance_law_stage, sum_middle_law_rates, finish_law_step,
 accept_law_step) = _kernels(EFFECT_STATE_SIZE, FULL_STATE_SIZE)
