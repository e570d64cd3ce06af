"""Sensor errors: each of the four sensors may have a lag, an offset or a gain error."""

import numpy as np

from slipstick.clutch.effects.effect import SENSORS, Coefficient, Effect, SensorFormula
from slipstick.clutch.lag import lagged_signal

_TITLES = {"lag": "Lag", "offset": "Offset", "gain": "Gain error"}
_OFFSET = {"pressure sensor": ("pressure", 0.007), "input speed sensor": ("speed", 0.005),
           "output speed sensor": ("load_speed", 0.016), "output torque sensor": ("load_torque", 0.0035)}
"""Scale of the signal, and the typical offset as its multiple."""


def _lag(values: np.ndarray, times: np.ndarray, c: tuple[np.ndarray, ...]) -> np.ndarray:
    return lagged_signal(values, times, c[0])


def _offset(values: np.ndarray, times: np.ndarray, c: tuple[np.ndarray, ...]) -> np.ndarray:
    shifted: np.ndarray = values + c[0]
    return shifted


def _gain(values: np.ndarray, times: np.ndarray, c: tuple[np.ndarray, ...]) -> np.ndarray:
    return values * (1.0 + c[0])


def _effect(sensor: str, fault: str, law: str, coefficient: Coefficient, signature: str,
            formula: SensorFormula) -> Effect:
    return Effect(
        name=f"{sensor} {fault}".replace(" ", "_"),
        title=f"{_TITLES[fault]} of the {sensor}",
        quantity=sensor,
        depends_on=fault,
        law=law,
        coefficients=(coefficient,),
        source="Fraden, Handbook of Modern Sensors, chapter on sensor characteristics",
        signature=signature,
        formula=formula,
    )


EFFECTS = tuple(effect for sensor, (scale, typical) in _OFFSET.items() for effect in (
    _effect(sensor, "lag", "y, y' = (signal - y) / lag, y = signal at the first sample",
            Coefficient("lag", "s", 0.0, 0.0, 2.0, "time constant of the reading", 0.2, scale={"time": 1}),
            "ramps appear late by a constant time; constant values are correct", _lag),
    _effect(sensor, "offset", "signal + offset",
            Coefficient("offset", SENSORS[sensor], 0.0, -20 * typical, 20 * typical, "reading at zero signal", typical,
                        scale={scale: 1}),
            "the reading is shifted by a constant amount, also at rest", _offset),
    _effect(sensor, "gain", "signal (1 + gain)",
            Coefficient("gain", "1", 0.0, -0.3, 0.3, "relative error of the slope", 0.02),
            "the error is proportional to the signal, and zero at rest", _gain),
))
