"""Supply pressure droop: a slow pump cannot maintain the pressure that the valve commands."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    droop = c[0]
    return pressure * (1.0 - droop * (200.0 / signals.motor_speed - 1.0))


EFFECT = Effect(
    name="supply_droop",
    title="Supply pressure droop at low motor speed",
    quantity="line pressure",
    depends_on="motor speed",
    law="line pressure (1 - droop (200 rad/s / motor speed - 1))",
    coefficients=(
        Coefficient("droop", "1", 0.0, -0.3, 0.3, "relative pressure loss at 100 rad/s, against 200 rad/s", 0.05),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on pumps: constant leakage, delivery proportional to speed",
    signature="the measured pressure is lower at low motor speed, by the same fraction at every current",
    formula=_formula,
    shape=Shape("rises", "concave"),
)
