"""Where the catalogue meets the equations: one compiled function a quantity, holding all effects on it.

A quantity that no effect changes in a call costs one branch outside the loop over lanes, and so does an effect whose
coefficients are neutral throughout.
"""

from collections.abc import Callable
from typing import Any

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import Effect, Memory, Signals
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    QUANTITY_FLAG,
    CLUTCH_TORQUE,
    COEFFICIENTS,
    CONTACT,
    FRICTION,
    GEAR,
    INPUT_SPEED,
    LANES,
    SEGMENT_CURRENT,
    SEGMENT_DIRECTION,
    SEGMENT_SLOPE,
    SEGMENT_SWING,
    SEGMENT_TIME,
    SEGMENT_REVERSAL,
    MEMORIES,
    MOTOR_SPEED,
    OUTPUT_SPEED,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_RATE,
    QUANTITY_ROW,
    RAMP,
    RATE,
    MEMORY_FLAG,
    RUN,
    SLIPPING,
    STAGE_TIME,
    STAGE,
    STATE_SIZE,
    MEMORY_INPUT,
)

Hook = Callable[[Any, Any], None]


def hook(quantity: str) -> Hook:
    """Compile f(b, active), which lets every active effect on `quantity` change its row, in catalogue order."""
    chain: Hook = _nothing
    for position, effect in reversed(list(enumerate(effects.CATALOGUE))):
        if effect.quantity == quantity:
            link = _link(effect, position, chain) if effect.memory is None else _remember(effect, position, chain)
            chain = link
    return _only_if(QUANTITY_FLAG[quantity], chain)


def memories() -> Hook:
    """Compile f(b, active), which fills the rates of the states that effects keep, once all torques are known."""
    chain: Hook = _nothing
    for position, effect in reversed(list(enumerate(effects.CATALOGUE))):
        if effect.memory is not None:
            chain = _move(effect, effect.memory, position, chain)
    return _only_if(MEMORY_FLAG, chain)


@kernel
def _nothing(b, active):
    pass


def _only_if(flag: int, chain: Hook) -> Hook:
    # Small enough to be copied into the equations, which a chain is not.
    @kernel
    def guarded(b, active):
        if active[flag]:
            chain(b, active)

    return guarded if chain is not _nothing else _nothing


@kernel
def _signals(b, i, clutch_torque, friction_power, memory):
    slip = b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i]
    current = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i])
    return Signals(b[STAGE_TIME + i], b[PRESSURE + i], b[PRESSURE_RATE + i], b[PISTON_STATE + i], b[INPUT_SPEED + i],
                   b[OUTPUT_SPEED + i], slip, b[MOTOR_SPEED + i], current, b[SEGMENT_DIRECTION + i], b[SEGMENT_REVERSAL + i],
                   b[SEGMENT_SWING + i], b[RUN + i], 1.0 - b[SLIPPING + i], clutch_torque, friction_power, memory)


@kernel
def _four(b, k):
    return b[k], b[k + LANES], b[k + 2 * LANES], b[k + 3 * LANES]


def _coefficients(effect: Effect) -> int:
    return COEFFICIENTS + int(effects.span(effect).start) * LANES


def _link(effect: Effect, position: int, rest: Hook) -> Hook:
    formula, row, first = effect.formula, QUANTITY_ROW[effect.quantity], _coefficients(effect)

    @kernel
    def link(b, active):
        if active[position]:
            for i in range(LANES):
                b[row + i] = formula(b[row + i], _signals(b, i, 0.0, 0.0, 0.0), _four(b, first + i))
        rest(b, active)

    return link


def _remember(effect: Effect, position: int, rest: Hook) -> Hook:
    formula, row, first = effect.formula, QUANTITY_ROW[effect.quantity], _coefficients(effect)
    place = MEMORIES.index(effect.name)
    state, value = STAGE + (STATE_SIZE + place) * LANES, MEMORY_INPUT + place * LANES
    before = 0.0 if effect.memory is not None and effect.memory.relaxed else -1.0

    @kernel
    def link(b, active):
        if active[position]:
            for i in range(LANES):
                given, kept = b[row + i], b[state + i]
                memory = given if b[STAGE_TIME + i] <= before else kept
                b[value + i], b[state + i] = given, memory
                b[row + i] = formula(given, _signals(b, i, 0.0, 0.0, memory), _four(b, first + i))
        rest(b, active)

    return link


def _move(effect: Effect, memory: Memory, position: int, rest: Hook) -> Hook:
    rate, first, place = memory.rate, _coefficients(effect), MEMORIES.index(effect.name)
    state, moves, value = STAGE + (STATE_SIZE + place) * LANES, RATE + (STATE_SIZE + place) * LANES, MEMORY_INPUT + place * LANES

    @kernel
    def move(b, active):
        if active[position]:
            for i in range(LANES):
                slip = b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i]
                power = b[SLIPPING + i] * b[RAMP + i] * b[FRICTION + i] * b[CONTACT + i] * abs(slip)
                signals = _signals(b, i, b[CLUTCH_TORQUE + i], power, b[state + i])
                b[moves + i] = rate(b[value + i], signals, _four(b, first + i))
        rest(b, active)

    return move
