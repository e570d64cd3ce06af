"""Flow-limited fill: the supply flow limits the forward speed of the piston."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(rate: float, signals: Signals, c: tuple[float, ...]) -> float:
    slowness = c[0]
    return rate / (1.0 + slowness * max(0.0, rate))


EFFECT = Effect(
    name="flow_limited_fill",
    title="Flow-limited fill",
    quantity="piston rate",
    depends_on="piston rate",
    law="rate / (1 + slowness max(0, rate))",
    coefficients=(
        Coefficient("slowness", "s/m", 0.0, -0.45, 4.5, "reciprocal of the limiting piston rate", 0.22,
                    scale={"piston_rate": -1}),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on valve control: flow saturation at the supply limit",
    signature="contact comes later after strong fill pulses, and hardly changes after weak ones",
    formula=_formula,
    shape=Shape("falls"),
)
