"""Supply pressure droop: a pump that turns slowly cannot hold the pressure that the valve asks for."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    droop = c[0]
    return pressure * (1.0 - droop * (200.0 / signals.motor_speed - 1.0))


EFFECT = Effect(
    name="supply_droop",
    title="Supply pressure droop with motor speed",
    quantity="line pressure",
    law="line pressure (1 - droop (200 rad/s / motor speed - 1))",
    coefficients=(
        Coefficient("droop", "1", 0.0, -0.3, 0.3, "share of the pressure lost at 100 rad/s against 200 rad/s", 0.05),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on pumps: leakage against delivery in proportion to speed",
    signature="the measured pressure is lower at low motor speed, by the same share at every current",
    formula=_formula,
)
