"""Integration of the memories of effects and laws that are in use, by the method that integrates the speeds."""

import numpy as np

from slipstick.clutch import effects
from slipstick.clutch.events import SEGMENT_ENDS
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    END,
    EVENT,
    FIRST,
    FULL_STATE_SIZE,
    LANES,
    LAW_MEMORIES,
    LAW_MEMORY_FLAG,
    MEMORIES,
    MIDDLE,
    RATE,
    STAGE,
    START,
    STATE_SIZE,
    STEP,
)

_POSITIONS = [effect.name for effect in effects.CATALOGUE]
_FLAGS = np.array([_POSITIONS.index(name) for name in MEMORIES] + [LAW_MEMORY_FLAG] * len(LAW_MEMORIES))
"""Flag of each row of the state vector behind those of the model: whether it is in use."""


@kernel
def begin_step(b, active):
    """Set the memories at the first stage."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        if active[_FLAGS[s - STATE_SIZE]]:
            for i in range(LANES):
                b[STAGE + s * LANES + i] = b[START + s * LANES + i]


@kernel
def store_first_rate(b, active):
    """Store the rates of the first stage, and the initial values of relaxed memories set there at t = 0."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        if active[_FLAGS[s - STATE_SIZE]]:
            for i in range(LANES):
                b[FIRST + s * LANES + i] = b[RATE + s * LANES + i]
                b[START + s * LANES + i] = b[STAGE + s * LANES + i]


@kernel
def advance_stage(b, active, fraction):
    """Set the memories at a later stage, at `fraction` of the step."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        if active[_FLAGS[s - STATE_SIZE]]:
            for i in range(LANES):
                k = s * LANES + i
                b[STAGE + k] = b[START + k] + fraction * b[STEP + i] * b[RATE + k]


@kernel
def sum_middle_rates(b, active, is_first):
    """Store the rates of the first middle stage, and add those of the second."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        if active[_FLAGS[s - STATE_SIZE]]:
            for i in range(LANES):
                k = s * LANES + i
                before, rate = b[MIDDLE + k], b[RATE + k]
                b[MIDDLE + k] = rate if is_first else before + rate


@kernel
def finish_step(b, active):
    """Compute the memories at the end of the step."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        if active[_FLAGS[s - STATE_SIZE]]:
            for i in range(LANES):
                k = s * LANES + i
                b[END + k] = b[START + k] + 1 / 6 * b[STEP + i] * (b[FIRST + k] + 2.0 * b[MIDDLE + k] + b[RATE + k])


@kernel
def accept_step(b, active):
    """Move the memories to the end of the step, except in lanes with an event."""
    for s in range(STATE_SIZE, FULL_STATE_SIZE):
        if active[_FLAGS[s - STATE_SIZE]]:
            for i in range(LANES):
                k = s * LANES + i
                start, end = b[START + k], b[END + k]
                b[START + k] = start if b[EVENT + i] > SEGMENT_ENDS else end
