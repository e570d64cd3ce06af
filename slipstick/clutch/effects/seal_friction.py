"""Seal friction: the piston's seals rub against its motion."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(rate: float, signals: Signals, c: tuple[float, ...]) -> float:
    drag = c[0]
    return rate - drag * rate / (abs(rate) + 1e-3)


EFFECT = Effect(
    name="seal_friction",
    title="Seal friction of the piston",
    quantity="piston rate",
    law="rate - drag rate / (|rate| + 1 mm/s)",
    coefficients=(
        Coefficient("drag", "m/s", 0.0, -1e-3, 9e-4, "rate lost to the seals at all but small rates", 6e-4),
    ),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994: Coulomb friction, smooth about zero",
    signature="the piston creeps at the hold pressure: contact comes later, most after weak fill pulses",
    formula=_formula,
)
