"""Return spring nonlinearity: the return springs of the piston stiffen under compression."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(rate: float, signals: Signals, c: tuple[float, ...]) -> float:
    stiffening = c[0]
    compression = min(1.0, max(0.0, 500.0 * signals.piston_state))
    return rate - stiffening * compression * compression * compression


EFFECT = Effect(
    name="return_spring",
    title="Return-spring nonlinearity",
    quantity="piston rate",
    depends_on="piston position",
    law="rate - stiffening (min(2 mm, max(0, x3)) / 2 mm)^3",
    coefficients=(
        Coefficient("stiffening", "m/s", 0.0, -0.18, 0.18, "piston rate lost to the cubic term at 2 mm", 0.045,
                    scale={"piston_rate": 1}),
    ),
    source="Shigley, Mechanical Engineering Design, chapter on springs: Belleville springs, here a cubic term",
    signature="the piston slows down at the end of its stroke: contact comes later than the fill suggests",
    formula=_formula,
    shape=Shape("falls", "concave"),
)
