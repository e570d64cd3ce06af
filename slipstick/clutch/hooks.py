"""Where the catalogue meets the equations: one compiled function a quantity, holding all effects on it.

An effect whose coefficients are neutral throughout a call is passed over by one branch outside the loop over lanes.
"""

from collections.abc import Callable
from typing import Any

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import Effect, Signals
from slipstick.clutch.fastmath import kernel
from slipstick.clutch.lanes import (
    COEFFICIENTS,
    GEAR,
    INPUT_SPEED,
    LANES,
    MOTOR_SPEED,
    OUTPUT_SPEED,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_RATE,
    QUANTITY,
    STAGE_TIME,
)

Hook = Callable[[Any, Any], None]


def hook(quantity: str) -> Hook:
    """Compile f(b, active), which lets every active effect on `quantity` change its row, in catalogue order."""
    chain: Hook = _nothing
    for position, effect in reversed(list(enumerate(effects.CATALOGUE))):
        if effect.quantity == quantity:
            chain = _link(effect, position, chain)
    return chain


@kernel
def _nothing(b, active):
    pass


def _link(effect: Effect, position: int, rest: Hook) -> Hook:
    formula, row = effect.formula, QUANTITY[effect.quantity]
    first = COEFFICIENTS + effects.span(effect).start * LANES

    @kernel
    def link(b, active):
        if active[position]:
            for i in range(LANES):
                slip = b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i]
                signals = Signals(b[STAGE_TIME + i], b[PRESSURE + i], b[PRESSURE_RATE + i], b[PISTON_STATE + i],
                                  b[INPUT_SPEED + i], b[OUTPUT_SPEED + i], slip, b[MOTOR_SPEED + i])
                c = (b[first + i], b[first + LANES + i], b[first + 2 * LANES + i], b[first + 3 * LANES + i])
                b[row + i] = formula(b[row + i], signals, c)
        rest(b, active)

    return link
