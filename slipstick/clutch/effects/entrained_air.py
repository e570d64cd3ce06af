"""Entrained air: at low pressure part of the oil flow compresses air bubbles, and the piston lags behind."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(clearance: float, signals: Signals, c: tuple[float, ...]) -> float:
    stroke, pressure = c[0], max(0.0, signals.pressure)
    return clearance + stroke * pressure / (1.0 + pressure)


EFFECT = Effect(
    name="entrained_air",
    title="Entrained air",
    quantity="clearance",
    depends_on="pressure",
    law="clearance + stroke p / (1 bar + p), p = max(0, pressure)",
    coefficients=(
        Coefficient("stroke", "m", 0.0, -0.5, 0.5, "air volume at zero pressure, as a piston stroke", 0.05,
                    scale={"stroke": 1}),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on fluid properties: isothermal compression of entrained air",
    signature="contact comes later, most where the pressure is high when the plates meet",
    formula=_formula,
    shape=Shape("rises", "concave"),
    also=(("piston rate", "pressure"),),
)
