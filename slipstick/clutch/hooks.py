"""Compiled effect hooks of the equations: one function per quantity, with all effects and laws on that quantity.

A quantity without an active effect or a law costs one branch outside the loop over lanes, and so does an inactive
effect.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import Effect, Memory, Signals
from slipstick.clutch.fastmath import inlined, inserted, kernel
from slipstick.clutch.lanes import (
    CLUTCH_TORQUE,
    COEFFICIENTS,
    CONTACT,
    FRICTION,
    GEAR,
    INPUT_SPEED,
    LANES,
    LAW_FLAG,
    LAW_MEMORY_FLAG,
    MEMORIES,
    MEMORY_FLAG,
    MEMORY_INPUT,
    MOTOR_SPEED,
    OUTPUT_SPEED,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_RATE,
    QUANTITY_FLAG,
    QUANTITY_ROW,
    RAMP,
    RATE,
    RUN,
    SEGMENT_CURRENT,
    SEGMENT_DIRECTION,
    SEGMENT_REVERSAL,
    SEGMENT_SLOPE,
    SEGMENT_SWING,
    SEGMENT_TIME,
    SLIPPING,
    STAGE,
    STAGE_TIME,
    STATE_SIZE,
)
from slipstick.clutch.law_kernels import apply_laws, law_memory_rates

Hook = Callable[[Any, Any], None]


def hook(quantity: str) -> Hook:
    """Compile f(b, active), which applies all active effects on `quantity`, in catalogue order, and laws to its row."""
    chain: Hook = _no_effect
    for position, effect in reversed(list(enumerate(effects.CATALOGUE))):
        if effect.quantity == quantity:
            link = _link if effect.memory is None else _memory_link
            chain = link(effect, position, chain)
    flag, row = QUANTITY_FLAG[quantity], np.uint64(QUANTITY_ROW[quantity])

    # The guard is inlined, because thirteen calls per stage slowed down a simulation without effects by 2 %.
    @partial(inlined, variant=quantity)
    def guarded(b, active):
        if active[flag]:
            chain(b, active)
            if active[LAW_FLAG]:
                apply_laws(b, row)

    return guarded


def memory_rates() -> Hook:
    """Compile f(b, active), which computes the rates of the memories after all torques are known."""
    chain: Hook = _no_effect
    for position, effect in reversed(list(enumerate(effects.CATALOGUE))):
        if effect.memory is not None:
            chain = _rate_link(effect, effect.memory, position, chain)

    @inlined
    def guarded(b, active):
        if active[MEMORY_FLAG]:
            chain(b, active)
            if active[LAW_MEMORY_FLAG]:
                law_memory_rates(b)

    return guarded


@kernel
def _no_effect(b, active):
    pass


@kernel
def _signals(b, i, clutch_torque, friction_power, memory):
    slip = b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i]
    current = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i])
    return Signals(b[STAGE_TIME + i], b[PRESSURE + i], b[PRESSURE_RATE + i], b[PISTON_STATE + i], b[INPUT_SPEED + i],
                   b[OUTPUT_SPEED + i], slip, b[MOTOR_SPEED + i], current, b[SEGMENT_DIRECTION + i],
                   b[SEGMENT_REVERSAL + i], b[SEGMENT_SWING + i], b[RUN + i], 1.0 - b[SLIPPING + i], clutch_torque,
                   friction_power, memory)


@kernel
def _four_coefficients(b, k):
    return b[k], b[k + LANES], b[k + 2 * LANES], b[k + 3 * LANES]


def _first_row(effect: Effect) -> int:
    return COEFFICIENTS + int(effects.span(effect).start) * LANES


def _link(effect: Effect, position: int, rest: Hook) -> Hook:
    formula, row, first = inserted(effect.formula), QUANTITY_ROW[effect.quantity], _first_row(effect)

    @partial(kernel, variant=effect.name)
    def link(b, active):
        if active[position]:
            for i in range(LANES):
                b[row + i] = formula(b[row + i], _signals(b, i, 0.0, 0.0, 0.0), _four_coefficients(b, first + i))
        rest(b, active)

    return link


def _memory_link(effect: Effect, position: int, rest: Hook) -> Hook:
    formula, row, first = inserted(effect.formula), QUANTITY_ROW[effect.quantity], _first_row(effect)
    column = MEMORIES.index(effect.name)
    state, value = STAGE + (STATE_SIZE + column) * LANES, MEMORY_INPUT + column * LANES
    relaxation_time = 0.0 if effect.memory is not None and effect.memory.relaxed else -1.0

    @partial(kernel, variant=effect.name)
    def link(b, active):
        if active[position]:
            for i in range(LANES):
                unchanged, stored = b[row + i], b[state + i]
                memory = unchanged if b[STAGE_TIME + i] <= relaxation_time else stored
                b[value + i], b[state + i] = unchanged, memory
                b[row + i] = formula(unchanged, _signals(b, i, 0.0, 0.0, memory), _four_coefficients(b, first + i))
        rest(b, active)

    return link


def _rate_link(effect: Effect, memory: Memory, position: int, rest: Hook) -> Hook:
    rate, first, column = inserted(memory.rate), _first_row(effect), MEMORIES.index(effect.name)
    state, value = STAGE + (STATE_SIZE + column) * LANES, MEMORY_INPUT + column * LANES
    rate_row = RATE + (STATE_SIZE + column) * LANES

    @partial(kernel, variant=effect.name)
    def link(b, active):
        if active[position]:
            for i in range(LANES):
                slip = b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i]
                power = b[SLIPPING + i] * b[RAMP + i] * b[FRICTION + i] * b[CONTACT + i] * abs(slip)
                signals = _signals(b, i, b[CLUTCH_TORQUE + i], power, b[state + i])
                b[rate_row + i] = rate(b[value + i], signals, _four_coefficients(b, first + i))
        rest(b, active)

    return link
