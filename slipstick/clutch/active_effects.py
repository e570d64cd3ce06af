"""The effects that act in a call: on the equations as the compiled integrator takes them, on the sensors afterwards."""

from typing import NamedTuple

import numpy as np

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import SENSORS, Effect
from slipstick.clutch.lanes import QUANTITY_FLAG, FULL_STATE_SIZE, MEMORY_FLAG, STATE_SIZE


class Acting(NamedTuple):
    """Which effects a call has to evaluate."""

    active: np.ndarray
    """bool: flags of effects, quantities and memories at the places that `lanes` gives them"""
    used: np.ndarray
    """places of the coefficients of the active ones in the vectors"""
    shortest: np.ndarray
    """(m,) s: their shortest time constant at each point"""
    states: int
    """how many states there are: five, or all where one is a memory"""


def acting(coefficients: np.ndarray) -> Acting:
    """What acts where any of the coefficient vectors (m, c) is not neutral."""
    active = np.zeros(MEMORY_FLAG + 1, np.bool_)
    used, shortest = [np.empty(0, np.int64)], np.full(len(coefficients), np.inf)
    for position, effect in enumerate(effects.CATALOGUE):
        if effect.quantity in SENSORS or not _acts(effect, coefficients):
            continue
        active[[position, QUANTITY_FLAG[effect.quantity]]] = True
        active[MEMORY_FLAG] |= effect.memory is not None
        used.append(np.arange(effects.span(effect).start, effects.span(effect).stop))
        if effect.time_constant is not None:
            shortest = np.minimum(shortest, effect.time_constant(*_columns(effect, coefficients)))
    return Acting(active, np.concatenate(used), shortest, FULL_STATE_SIZE if active[MEMORY_FLAG] else STATE_SIZE)


def shown(signal: np.ndarray, sensor: str, sample_times: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """What `sensor` shows of a signal (m, ..., k) at `sample_times` (k,) in s with coefficient vectors (m, c)."""
    for effect in effects.CATALOGUE:
        if effect.quantity == sensor and _acts(effect, coefficients):
            spread = (len(coefficients), *[1] * (signal.ndim - 1))
            columns = tuple(column.reshape(spread) for column in _columns(effect, coefficients))
            signal = effect.formula(signal, sample_times, columns)
    return signal


def _acts(effect: Effect, coefficients: np.ndarray) -> bool:
    amplitudes = np.array([not one.shape for one in effect.coefficients])
    return bool(np.any((coefficients[:, effects.span(effect)] != np.array(effect.neutral))[:, amplitudes]))


def _columns(effect: Effect, coefficients: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(coefficients[:, effects.span(effect)].T)
