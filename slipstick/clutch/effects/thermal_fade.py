"""Thermal fade: friction decreases as the lining absorbs the heat of the engagement."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Memory, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(friction: float, signals: Signals, c: tuple[float, ...]) -> float:
    fade = c[0]
    return friction / (1.0 + fade * signals.memory)


@compiled
def _heat(friction: float, signals: Signals, c: tuple[float, ...]) -> float:
    return 1e-3 * signals.friction_power


EFFECT = Effect(
    name="thermal_fade",
    title="Thermal fade",
    quantity="friction coefficient",
    depends_on="heat",
    law="alpha / (1 + fade E), E' = friction power, E(0) = 0",
    coefficients=(
        Coefficient("fade", "1/kJ", 0.0, -0.54, 2.7, "relative friction loss caused by the first kJ of heat", 0.27,
                    scale={"energy": -1}),
    ),
    source="Ingram, Reddyhoff and Spikes, Tribology Letters 41, 2011: thermal behaviour of a slipping wet clutch",
    signature="torque over pressure falls during an engagement, most at high speed and large load inertia",
    formula=_formula,
    shape=Shape("falls"),
    memory=Memory(_heat),
)
