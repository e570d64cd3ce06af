"""Torque converter lag: the converter flow follows the speeds with a lag."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Memory, Signals
from slipstick.clutch.fastmath import compiled
from slipstick.clutch.lag import lag_rate, lagged, time_constant


@compiled
def _formula(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    return lagged(torque, signals.memory, c[0])


@compiled
def _rate(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    return lag_rate(torque, signals.memory, c[0])


EFFECT = Effect(
    name="converter_lag",
    title="Torque converter lag",
    quantity="converter torque",
    depends_on="lag",
    law="T, T' = (converter torque - T) / lag, T(0) = converter torque at t = 0",
    coefficients=(
        Coefficient("lag", "s", 0.0, 0.0, 6.0, "time constant of the torque", 1.0, scale={"time": 1}),
    ),
    source="Hrovat and Tobler, Journal of the Franklin Institute 319, 1985: dynamics of torque converters",
    signature="the input speed drops more as the torque builds up, and overshoots after lock-up",
    formula=_formula,
    memory=Memory(_rate, relaxed=True),
    time_constant=time_constant,
)
