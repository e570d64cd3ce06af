"""Seal friction: the seals of the piston resist its motion."""

from math import sqrt

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(rate: float, signals: Signals, c: tuple[float, ...]) -> float:
    drag = c[0]
    # Friction only opposes motion: a rate below the drag becomes small, but never changes its sign.
    return rate - drag * rate / sqrt(rate * rate + drag * drag + 1e-14)


EFFECT = Effect(
    name="seal_friction",
    title="Seal friction of the piston",
    quantity="piston rate",
    depends_on="direction",
    law="rate - drag rate / sqrt(rate^2 + drag^2)",
    coefficients=(
        Coefficient("drag", "m/s", 0.0, 0.0, 0.18, "rate lost to the seals, except at small rates", 0.045,
                    scale={"piston_rate": 1}),
    ),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994: Coulomb friction, smooth at zero",
    signature="the piston creeps at the hold pressure: contact comes later, most after weak fill pulses",
    formula=_formula,
)
