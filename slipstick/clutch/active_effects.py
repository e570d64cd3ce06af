"""Active effects and laws of a call for the compiled integrator, and sensor effects on the integrated signals."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import SENSORS
from slipstick.clutch.lanes import (
    EFFECT_STATE_SIZE,
    FULL_STATE_SIZE,
    HYDRAULICS,
    HYDRAULICS_FLAG,
    LAW_FLAG,
    LAW_MEMORIES,
    LAW_MEMORY_FLAG,
    MEMORY_FLAG,
    QUANTITY_FLAG,
    STATE_SIZE,
)
from slipstick.clutch.laws import MeasuredLaw


class ActiveEffects(NamedTuple):
    """Effects and laws that a call has to evaluate."""

    flags: np.ndarray
    """bool: flags of effects, quantities and memories, indexed as in `lanes`"""
    coefficient_indices: np.ndarray
    """indices of their coefficients in the coefficient vectors"""
    shortest_time_constant: np.ndarray
    """(m,) s: their shortest time constant at each point"""
    state_size: int
    """length of the state vector: five, or with the memories of effects, or with those of laws too, if one is in use"""


def active_effects(coefficients: np.ndarray, laws: Sequence[MeasuredLaw] = ()) -> ActiveEffects:
    """Effects that are not neutral in at least one of the coefficient vectors (m, c), and the laws of all of them."""
    flags = np.zeros(MEMORY_FLAG + 1, np.bool_)
    indices, shortest = [np.empty(0, np.int64)], np.full(len(coefficients), np.inf)
    differs = np.any(coefficients != effects.neutral(), axis=0)
    for position, (effect, span) in enumerate(effects.spans()):
        # Most effects have neutral coefficients, which one comparison of all shows.
        if effect.quantity in SENSORS or not any(differs[span]) or effect.is_neutral(coefficients[:, span]):
            continue
        flags[[position, QUANTITY_FLAG[effect.quantity]]] = True
        flags[MEMORY_FLAG] |= effect.memory is not None
        indices.append(np.arange(span.start, span.stop))
        if effect.time_constant is not None:
            shortest = np.minimum(shortest, effect.time_constant(*coefficients[:, span].T))
    for law in laws:
        flags[[LAW_FLAG, QUANTITY_FLAG[law.quantity]]] = True
        flags[[LAW_MEMORY_FLAG, MEMORY_FLAG]] |= law.depends_on in LAW_MEMORIES
    flags[HYDRAULICS_FLAG] = np.any(flags[[QUANTITY_FLAG[name] for name in HYDRAULICS]])
    state_size = (FULL_STATE_SIZE if flags[LAW_MEMORY_FLAG] else EFFECT_STATE_SIZE if flags[MEMORY_FLAG]
                  else STATE_SIZE)
    return ActiveEffects(flags, np.concatenate(indices), shortest, state_size)


def sensor_reading(signal: np.ndarray, sensor: str, sample_times: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Reading of `sensor` for a signal (m, ..., k) at `sample_times` (k,) in s, with coefficient vectors (m, c)."""
    for effect, span in effects.spans():
        if effect.quantity == sensor and not effect.is_neutral(coefficients[:, span]):
            shape = (len(coefficients), *[1] * (signal.ndim - 1))
            columns = tuple(column.reshape(shape) for column in coefficients[:, span].T)
            signal = effect.formula(signal, sample_times, columns)
    return signal
