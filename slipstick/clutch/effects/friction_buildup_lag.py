"""Friction build-up lag: oil must be squeezed out before the asperities carry the pressure."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Memory, Signals
from slipstick.clutch.fastmath import compiled
from slipstick.clutch.lag import lag_rate, lagged, time_constant


@compiled
def _formula(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    return lagged(pressure, signals.memory, c[0])


@compiled
def _rate(pressure: float, signals: Signals, c: tuple[float, ...]) -> float:
    return lag_rate(pressure, signals.memory, c[0])


EFFECT = Effect(
    name="friction_buildup_lag",
    title="Friction build-up lag",
    quantity="contact pressure",
    depends_on="lag",
    law="Q, Q' = (P - Q) / lag, Q(0) = P(0)",
    coefficients=(
        Coefficient("lag", "s", 0.0, 0.0, 2.0, "time constant of the load transfer to the asperities", 0.4,
                    scale={"time": 1}),
    ),
    source="Berger, Sadeghi and Krousgrill, ASME Journal of Tribology 118, 1996: squeeze film and asperity contact",
    signature="torque lags the pressure: plotted against pressure, it forms a loop between pulse and ramp",
    formula=_formula,
    also=(("friction coefficient", "lag"),),
    memory=Memory(_rate, relaxed=True),
    time_constant=time_constant,
)
