"""Valve hysteresis: friction and magnetism hold the valve back each time the current turns."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(current: float, signals: Signals, c: tuple[float, ...]) -> float:
    width = min(c[0], signals.current_swing)
    rising = max(signals.current_turn + width, signals.current - c[0])
    falling = min(signals.current_turn - width, signals.current + c[0])
    return current + (rising if signals.current_direction > 0.0 else falling) - signals.current


EFFECT = Effect(
    name="valve_hysteresis",
    title="Valve hysteresis",
    quantity="valve current",
    law="the play operator: the current within +-width of it, moved only when at an end",
    coefficients=(
        Coefficient("width", "A", 0.0, 0.0, 0.06, "half the gap between rising and falling branch", 0.01),
    ),
    source="Visintin, Differential Models of Hysteresis, 1994, chapter on the play operator",
    signature="at the same current the measured pressure is lower while the current rises than after it fell",
    formula=_formula,
)
