"""Friction build-up lag: oil has to be squeezed out before the asperities carry the pressure."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Memory, Signals
from slipstick.clutch.fastmath import compiled
from slipstick.clutch.lag import approach, lagged, time_constant


@compiled
def _formula(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    return lagged(pressure, signals.memory, c[0])


@compiled
def _rate(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    return approach(pressure, signals.memory, c[0])


EFFECT = Effect(
    name="friction_buildup_lag",
    title="Friction build-up lag",
    quantity="contact pressure",
    law="Q, Q' = (P - Q) / lag, Q(0) = P(0)",
    coefficients=(
        Coefficient("lag", "s", 0.0, 0.0, 0.1, "time in which the asperities take over the pressure", 0.02),
    ),
    source="Berger, Sadeghi and Krousgrill, ASME Journal of Tribology 118, 1996: squeeze film and asperity contact",
    signature="torque follows the pressure late: over pressure it draws a loop as the pulse ends and the ramp begins",
    formula=_formula,
    memory=Memory(_rate, relaxed=True),
    time_constant=time_constant,
)
