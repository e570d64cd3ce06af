"""Load friction decreasing with speed: brake and seals resist more at rest than in motion."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled, exp


@compiled
def _formula(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    excess, share, decay_speed = c[0], c[1], c[2]
    return torque + (excess + share * torque) * exp(-abs(signals.output_speed) / decay_speed)


EFFECT = Effect(
    name="falling_load_friction",
    title="Load friction decreasing with speed",
    quantity="load torque",
    depends_on="output speed",
    law="load torque + (excess + share load torque) exp(-|omega| / decay_speed)",
    coefficients=(
        Coefficient("excess", "N m", 0.0, -0.028, 0.056, "seals: friction torque at rest above that at speed", 0.01,
                    scale={"load_torque": 1}),
        Coefficient("share", "1", 0.0, -0.5, 2.0, "brake: the same, as a fraction of the load torque", 0.3),
        Coefficient("decay_speed", "rad/s", 8.0, 0.032, 0.48, "e-folding load speed of the excess", 0.13, True,
                    {"load_speed": 1}),
    ),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994: Stribeck friction",
    signature="the load starts to move later, and then accelerates faster than the model predicts",
    formula=_formula,
    shape=Shape("falls", "convex"),
    also=(("brake torque", "output speed"),),
)
