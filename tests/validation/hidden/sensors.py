"""The four sensors: effects on their readings, noise and quantisation."""

from collections.abc import Iterable, Mapping

import numpy as np
from scipy.signal import lfilter

from .bench import Bench
from .effect import Effect
from .responses import RESPONSES, lagged

Signals = dict[str, np.ndarray]
BITS = 12
NOISE_MEMORY = 0.3  # correlation of the noise of successive samples

_SENSORS = {  # block, unit, full scale, typical lag in s, typical offset, typical relative gain error
    "pressure": ("pressure", "bar", 14.0, 0.008, 0.2, 0.04),
    "input_speed": ("input speed", "rad/s", 200.0, 0.012, 1.5, 0.02),
    "output_speed": ("output speed", "rad/s", 60.0, 0.012, 0.4, 0.02),
    "output_torque": ("torque", "N m", 1000.0, 0.006, 12.0, 0.04),
}


def _effects() -> Iterable[Effect]:
    for name, (block, unit, full_scale, lag, offset, gain) in _SENSORS.items():
        yield Effect(f"{name}_sensor_lag", block, f"{name}_sensor_lag", "sequence", "difference", "s", lag,
                     lambda s, r: s + 0 * r)
        yield Effect(f"{name}_sensor_offset", block, f"{name}_sensor", "sequence", "difference", unit, offset,
                     lambda s, r: s * (0.95 + 0.1 * r))
        yield Effect(f"{name}_sensor_gain", block, f"{name}_sensor", name, "difference", "1", gain,
                     lambda s, x, full_scale=full_scale: s * x * (0.95 + 0.1 * np.abs(x) / full_scale))


SENSORS = tuple(_effects())


def read(true: Signals, quantities: Signals, bench: Bench) -> Signals:
    """Return the noiseless readings (n, k) of the `true` signals; effects may depend on any of the `quantities`."""
    readings = {}
    for name, signal in true.items():
        reading = signal
        for effect, strength in bench.effects:
            if effect.quantity == f"{name}_sensor":
                reading = reading + bench.change(effect, strength, quantities[effect.abscissa])
        for effect, strength in bench.effects:
            if effect.quantity == f"{name}_sensor_lag":  # two poles, whose delays add up to the lag
                lag = strength * bench.setup.scale.get("time", 1.0)
                reading = lagged(lagged(reading, 0.75 * lag, bench.setup), 0.25 * lag, bench.setup)
            for kind, response in RESPONSES.items():
                if effect.quantity == f"{name}_sensor_{kind}":
                    reading = response(reading, strength, name, bench.setup)
        readings[name] = reading
    return readings


def measured(readings: Signals, std: Mapping[str, float], memory: Mapping[str, float],
             random: np.random.Generator) -> Signals:
    """Add noise and round to `BITS` bits of the range of each signal.

    `std` is relative to the range; `memory` is the correlation of the noise of successive samples.
    """
    noisy = {}
    for name, reading in readings.items():
        signal_range = np.ptp(reading)
        white = random.standard_normal(reading.shape)
        white[:, 1:] *= np.sqrt(1 - memory[name] ** 2)
        noise = lfilter([1], [1, -memory[name]], white)
        step = signal_range / 2**BITS
        noisy[name] = (np.round((reading + std[name] * signal_range * noise) / step) * step).astype(np.float32)
    return noisy
