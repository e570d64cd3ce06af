"""Centrifugal pressure head: oil rotating with the drum adds pressure on the piston."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    head = c[0]
    return pressure + head * signals.input_speed * signals.input_speed


EFFECT = Effect(
    name="centrifugal_pressure",
    title="Centrifugal pressure head",
    quantity="chamber pressure",
    depends_on="input speed",
    law="pressure + head Omega^2",
    coefficients=(
        Coefficient("head", "bar s^2", 0.0, -0.14, 0.14, "half the density times the difference of the squared radii",
                    0.028, scale={"pressure": 1, "speed": -2}),
    ),
    source="White, Fluid Mechanics, section on pressure distribution in rigid-body motion",
    signature="contact comes earlier and torque is higher at high motor speed; the measured pressure is unchanged",
    formula=_formula,
    shape=Shape("rises", "convex"),
)
