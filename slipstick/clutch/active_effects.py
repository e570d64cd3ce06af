"""Active effects of a call: flags for the compiled integrator, and sensor effects on the integrated signals."""

from typing import NamedTuple

import numpy as np

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import SENSORS, Effect
from slipstick.clutch.lanes import FULL_STATE_SIZE, MEMORY_FLAG, QUANTITY_FLAG, STATE_SIZE


class ActiveEffects(NamedTuple):
    """Effects that a call has to evaluate."""

    flags: np.ndarray
    """bool: flags of effects, quantities and memories, indexed as in `lanes`"""
    coefficient_indices: np.ndarray
    """indices of their coefficients in the coefficient vectors"""
    shortest_time_constant: np.ndarray
    """(m,) s: their shortest time constant at each point"""
    state_size: int
    """length of the state vector: five, or with all memories if one is active"""


def active_effects(coefficients: np.ndarray) -> ActiveEffects:
    """Effects that are not neutral in at least one of the coefficient vectors (m, c)."""
    flags = np.zeros(MEMORY_FLAG + 1, np.bool_)
    indices, shortest = [np.empty(0, np.int64)], np.full(len(coefficients), np.inf)
    for position, effect in enumerate(effects.CATALOGUE):
        if effect.quantity in SENSORS or not _is_active(effect, coefficients):
            continue
        flags[[position, QUANTITY_FLAG[effect.quantity]]] = True
        flags[MEMORY_FLAG] |= effect.memory is not None
        indices.append(np.arange(effects.span(effect).start, effects.span(effect).stop))
        if effect.time_constant is not None:
            shortest = np.minimum(shortest, effect.time_constant(*_columns(effect, coefficients)))
    state_size = FULL_STATE_SIZE if flags[MEMORY_FLAG] else STATE_SIZE
    return ActiveEffects(flags, np.concatenate(indices), shortest, state_size)


def sensor_reading(signal: np.ndarray, sensor: str, sample_times: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Reading of `sensor` for a signal (m, ..., k) at `sample_times` (k,) in s, with coefficient vectors (m, c)."""
    for effect in effects.CATALOGUE:
        if effect.quantity == sensor and _is_active(effect, coefficients):
            shape = (len(coefficients), *[1] * (signal.ndim - 1))
            columns = tuple(column.reshape(shape) for column in _columns(effect, coefficients))
            signal = effect.formula(signal, sample_times, columns)
    return signal


def _is_active(effect: Effect, coefficients: np.ndarray) -> bool:
    amplitudes = np.array([not coefficient.shape for coefficient in effect.coefficients])
    return bool(np.any((coefficients[:, effects.span(effect)] != np.array(effect.neutral))[:, amplitudes]))


def _columns(effect: Effect, coefficients: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(coefficients[:, effects.span(effect)].T)
