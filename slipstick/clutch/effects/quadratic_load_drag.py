"""Quadratic load drag: windage of the flywheel and brake on the load shaft."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    drag = c[0]
    return torque + drag * signals.output_speed * abs(signals.output_speed)


EFFECT = Effect(
    name="quadratic_load_drag",
    title="Quadratic load drag",
    quantity="load torque",
    depends_on="output speed",
    law="load torque + drag omega |omega|",
    coefficients=(
        Coefficient("drag", "N m s^2", 0.0, -0.13, 0.27, "drag torque at a load speed of 1 rad/s", 0.08,
                    scale={"load_torque": 1, "load_speed": -2}),
    ),
    source="White, Fluid Mechanics, chapter on flow past immersed bodies",
    signature="the load shaft accelerates less at higher speed; shifting times are longer at high motor speed",
    formula=_formula,
    shape=Shape("rises", "convex"),
)
