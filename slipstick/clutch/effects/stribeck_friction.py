"""Slip-speed-dependent friction: boundary friction exceeds dynamic friction at low slip speed."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled, exp


@compiled
def _formula(friction: float, signals: Signals, c: tuple[float, ...]) -> float:
    strength, decay_speed = c[0], c[1]
    return friction * (1.0 + strength * exp(-abs(signals.plate_slip) / decay_speed))


EFFECT = Effect(
    name="stribeck_friction",
    title="Slip-speed-dependent friction",
    quantity="friction coefficient",
    depends_on="slip",
    law="alpha (1 + strength exp(-|plate slip| / decay_speed))",
    coefficients=(
        Coefficient("strength", "1", 0.0, -0.3, 1.0, "relative increase of alpha at zero slip", 0.15),
        Coefficient("decay_speed", "rad/s", 25.0, 0.025, 0.5, "e-folding plate slip of the increase", 0.13, True,
                    {"speed": 1}),
    ),
    source="Bo and Pavelescu, Wear 82(3), 1982: exponential law of friction against speed, here with exponent 1",
    signature="torque over pressure rises towards lock-up, with a hook at the end of the slip phase",
    formula=_formula,
    shape=Shape("either", near_zero=True),
)
