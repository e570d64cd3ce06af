"""The four sensors: effects on their readings, noise and quantisation."""

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from .engagements import Engagements, apply_effect

Signals = dict[str, np.ndarray]
BITS = 12
NOISE_MEMORY = 0.3  # correlation of the noise of successive samples


def read(name: str, quantities: Signals, engagements: Engagements) -> np.ndarray:
    """Return the noiseless readings (n, k) of a signal; effects may depend on any of the `quantities`."""
    reading = quantities[name]
    for acting in engagements.effects:
        if acting.effect.quantity == f"{name}_sensor":
            reading = apply_effect(acting, reading, quantities[acting.effect.abscissa])
    for acting in engagements.effects:
        if acting.effect.quantity == f"{name}_sensor_lag":
            assert acting.effect.response is not None
            late = acting.effect.response(reading, engagements.bench.period, acting.amplitude)
            reading = np.where(acting.acts[:, None], late, reading)
    return reading


def add_noise(readings: Signals, std: Mapping[str, np.ndarray | float], memory: Mapping[str, float],
              random: np.random.Generator) -> Signals:
    """Add noise of the `std`, in the unit of each signal (a number or (n, 1)), and round to `BITS` bits of its range.

    `memory` is the correlation of the noise of successive samples.
    """
    noisy = {}
    for name, reading in readings.items():
        white = random.standard_normal(reading.shape)
        white[:, 1:] *= np.sqrt(1 - memory[name] ** 2)
        noise = lfilter([1], [1, -memory[name]], white)
        step = np.ptp(reading) / 2**BITS
        noisy[name] = (np.round((reading + std[name] * noise) / step) * step).astype(np.float32)
    return noisy
