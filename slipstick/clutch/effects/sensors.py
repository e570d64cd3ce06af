"""What sensors do to a signal: each of the four may lag, be off by a constant, or have another gain."""

import numpy as np

from slipstick.clutch.effects.effect import SENSORS, Coefficient, Effect, SensorFormula
from slipstick.clutch.lag import delayed

_OFFSET = {"bar": 0.1, "rad/s": 1.0, "N m": 5.0}


def _lag(values: np.ndarray, times: np.ndarray, c: tuple[np.ndarray, ...]) -> np.ndarray:
    return delayed(values, times, c[0])


def _offset(values: np.ndarray, times: np.ndarray, c: tuple[np.ndarray, ...]) -> np.ndarray:
    shifted: np.ndarray = values + c[0]
    return shifted


def _gain(values: np.ndarray, times: np.ndarray, c: tuple[np.ndarray, ...]) -> np.ndarray:
    return values * (1.0 + c[0])


def _effect(sensor: str, fault: str, law: str, coefficient: Coefficient, signature: str,
            formula: SensorFormula) -> Effect:
    return Effect(
        name=f"{sensor} {fault}".replace(" ", "_"),
        title=f"{fault.capitalize()} of the {sensor}",
        quantity=sensor,
        law=law,
        coefficients=(coefficient,),
        source="Fraden, Handbook of Modern Sensors, chapter on sensor characteristics",
        signature=signature,
        formula=formula,
    )


EFFECTS = tuple(effect for sensor, unit in SENSORS.items() for effect in (
    _effect(sensor, "lag", "y, y' = (reading - y) / lag, at first y = reading",
            Coefficient("lag", "s", 0.0, 0.0, 0.1, "time in which the reading follows", 0.01),
            "the signal comes late by the same time wherever it is steep; held values are right", _lag),
    _effect(sensor, "offset", "reading + offset",
            Coefficient("offset", unit, 0.0, -20 * _OFFSET[unit], 20 * _OFFSET[unit], "reading at zero", _OFFSET[unit]),
            "the signal is off by the same amount throughout, at rest too", _offset),
    _effect(sensor, "gain", "reading (1 + gain)",
            Coefficient("gain", "1", 0.0, -0.3, 0.3, "error of the slope, as a share", 0.02),
            "the signal is off in proportion to itself, at rest not at all", _gain),
))
