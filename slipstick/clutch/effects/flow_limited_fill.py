"""Flow-limited fill: the supply bounds how fast the piston can move forward."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(rate: float, signals: Signals, c: tuple[float, ...]) -> float:
    slowness = c[0]
    return rate / (1.0 + slowness * max(0.0, rate))


EFFECT = Effect(
    name="flow_limited_fill",
    title="Flow-limited fill",
    quantity="piston rate",
    law="rate / (1 + slowness max(0, rate))",
    coefficients=(
        Coefficient("slowness", "s/m", 0.0, -20.0, 200.0, "1 / the rate that no pressure can exceed", 10.0),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on valve control: flow saturates as the supply gives out",
    signature="contact comes later after strong fill pulses, hardly after weak ones",
    formula=_formula,
)
