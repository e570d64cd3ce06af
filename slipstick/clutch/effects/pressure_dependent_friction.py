"""Pressure-dependent friction: the friction coefficient of the lining varies with the pressure."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(friction: float, signals: Signals, c: tuple[float, ...]) -> float:
    slope = c[0]
    return friction * (1.0 + slope * 0.1 * (signals.pressure - 5.0))


EFFECT = Effect(
    name="pressure_dependent_friction",
    title="Pressure-dependent friction",
    quantity="friction coefficient",
    depends_on="pressure",
    law="alpha (1 + slope (pressure - 5 bar) / 10 bar)",
    coefficients=(
        Coefficient("slope", "1", 0.0, -0.5, 0.5, "relative change of alpha over 10 bar", -0.15),
    ),
    source="Maki, Wet clutch tribology, doctoral thesis, Lulea University of Technology, 2005: friction against load",
    signature="at equal slip speed, torque over pressure depends on the pressure and so on the current profile",
    formula=_formula,
    shape=Shape("either"),
)
