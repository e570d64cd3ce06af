"""Valve hysteresis: friction and magnetic hysteresis hold the spool back at each reversal of the current."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(current: float, signals: Signals, c: tuple[float, ...]) -> float:
    width = min(c[0], signals.current_swing)
    rising = max(signals.current_reversal + width, signals.current - c[0])
    falling = min(signals.current_reversal - width, signals.current + c[0])
    return current + (rising if signals.current_direction > 0.0 else falling) - signals.current


EFFECT = Effect(
    name="valve_hysteresis",
    title="Valve hysteresis",
    quantity="valve current",
    depends_on="past current",
    law="y, the play operator applied to u: y is constant while |y - u| < width",
    coefficients=(
        Coefficient("width", "A", 0.0, 0.0, 0.075, "half the gap between the rising and the falling branch", 0.012,
                    scale={"current": 1}),
    ),
    source="Visintin, Differential Models of Hysteresis, 1994, chapter on the play operator",
    signature="at equal current the measured pressure is lower on the rising than on the falling branch",
    formula=_formula,
)
