"""Errors of sensors: what is read too much, by laws over the signal itself, over another one, or over time."""

from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.naming.bases import doubled, from_zero, gain_basis, gain_points
from slipstick.naming.scene import TYPICAL, WITHIN, Pair, Scene
from slipstick.naming.sensor_lags import change_read_late, late_columns, read_late
from slipstick.numerics.piecewise import hats, slope

_FAULTS = ("offset", "gain", "lag", "run order", "time")
_FURTHER = (*WITHIN, "motor speed")
"""What the error of any sensor is asked for besides where something is missing."""
_ERRORS_OVER: dict[str, tuple[str, ...]] = {
    "pressure sensor": (*_FAULTS, "input speed"), "input speed sensor": _FAULTS, "output speed sensor": _FAULTS,
    "output torque sensor": (*_FAULTS, "pressure", "output speed")}
"""What the error of each sensor may depend on. Sensors of pressure and torque that turn with a shaft, or that are
pressed by what they are mounted in, read other signals too."""
NOT_TOLD_FROM_GAIN = ("pressure sensor",)
"""Sensors whose constant gain error a parameter of their block replaces: only that it changes with the signal shows."""
_OF_SIGNAL = "gain", "lag"
"""Errors of a sensor that depend on its own signal."""


def pairs_of(scene: Scene, rare: bool, *sensors: str) -> list[Pair]:
    """The errors of sensors, over all on which they may depend and that was measured, with or without `rare` pairs.

    Further channels are usual: whoever records a temperature expects errors over it, and the run order resembles it.
    The slip has noise of the speed sensors, so that an error of these over it would explain their noise.
    """
    further = (*scene.channels, *(_FURTHER if rare else ()))
    return [(sensor, on) for sensor in sensors for on in dict.fromkeys((*_ERRORS_OVER[sensor], *further))
            if scene.knows(on) and f"{on} sensor" != sensor and not (on == "slip" and "speed" in sensor)]


def reading(scene: Scene, sensor: str, on: str, signal: np.ndarray, finer: int = 0) -> np.ndarray:
    """Basis (n, m, k) of the "offset", "gain" or "lag" of a `sensor` that reads `signal` (n, k), in its unit.

    Over the run order, a further channel or time it is an offset that drifts, which need not be 0 on average. It may
    also depend on another signal. A `finer` gain, lag or drift has more columns.
    """
    if on == "time":
        return np.asarray(hats(scene.abscissa(on), error_knots(scene, on, finer)) * drift(scene, sensor))
    if on in WITHIN:
        # Without the first hat: an error where the other signal is 0 is an offset.
        return np.asarray(hats(scene.abscissa(on), error_knots(scene, on, finer))[:, 1:] * drift(scene, sensor))
    if on in scene.of_runs:
        onto = scene.between(on, centred=False, finer=finer) * drift(scene, sensor)
        return np.asarray(onto[:, :, None] * np.ones(signal.shape)[:, None])
    if on == "lag":
        return late_columns(scene, signal, largest(scene, sensor), finer)
    if on == "gain":
        basis = gain_basis(signal, largest(scene, sensor), finer)
        return basis[:, 1:] if sensor in NOT_TOLD_FROM_GAIN else basis
    if on == "offset":
        return np.ones_like(signal)[:, None]
    raise KeyError(on)


def read_too_much(scene: Scene, sensor: str, on: str, signal: np.ndarray, c: np.ndarray, finer: int = 0) -> np.ndarray:
    """What a `sensor` of a `signal` (n, k) reads too much, (n, k), with coefficients `c` of its basis `reading`.

    Without the basis where that is far larger than what comes of it.
    """
    size = largest(scene, sensor)
    if on == "lag":
        return read_late(scene, signal, size, c, finer)
    if on == "gain":
        c, share = _of_gain(sensor, c), np.abs(signal) / size
        return np.asarray(signal * (np.interp(share, gain_points(finer), c) if finer else c[0] + c[1] * share))
    if on in WITHIN:
        values = c if on == "time" else np.concatenate([[0.0], c])
        error = np.interp(scene.abscissa(on), error_knots(scene, on, finer), values)
        return np.asarray(error * drift(scene, sensor) * np.ones(signal.shape))
    return np.asarray(c @ reading(scene, sensor, on, signal, finer))


def error(scene: Scene, signal: np.ndarray, laws: Sequence[tuple[Pair, np.ndarray]], sensor: str,
          finer: Mapping[Pair, int]) -> np.ndarray:
    """What a `sensor` of a `signal` (n, k) reads too much by those of the `laws` that are its errors, (n, k)."""
    read = [read_too_much(scene, *pair, signal, c, finer.get(pair, 0)) for pair, c in laws if pair[0] == sensor]
    return np.asarray(np.sum(read, axis=0)) if read else np.zeros(signal.shape)


def as_read(scene: Scene, change: np.ndarray, signal: np.ndarray, laws: Sequence[tuple[Pair, np.ndarray]], sensor: str,
            finer: Mapping[Pair, int]) -> np.ndarray:
    """Changes (n, m, k) of a `signal` (n, k) as the `sensor` with these laws reads them.

    Where its error depends on the signal, columns without it would lead a fit astray.
    """
    changed = change
    for (quantity, on), c in laws:
        if quantity == sensor and on in _OF_SIGNAL:
            changed = changed + _along(scene, sensor, on, signal, c, finer.get((quantity, on), 0), change)
    return changed


def _along(scene: Scene, sensor: str, on: str, signal: np.ndarray, c: np.ndarray, finer: int,
           change: np.ndarray) -> np.ndarray:
    """Changes (n, m, k) of what `read_too_much` gives with those of the signal, `change` (n, m, k)."""
    size = largest(scene, sensor)
    if on == "lag":
        return change_read_late(scene, signal, size, c, finer, change)
    c, share = _of_gain(sensor, c), np.abs(signal) / size
    points = gain_points(finer)
    steepness = (np.interp(share, points, c) + share * slope(share, points, c)) if finer else c[0] + 2 * c[1] * share
    return np.asarray(steepness[:, None] * change)


def _of_gain(sensor: str, c: np.ndarray) -> np.ndarray:
    """Coefficients of the whole `gain_basis` from those of a `sensor`, which may be without the first."""
    return np.concatenate([[0.0], c]) if sensor in NOT_TOLD_FROM_GAIN else c


def error_knots(scene: Scene, on: str, finer: int = 0) -> np.ndarray:
    """Knots (m,) of errors of sensors over time or over another signal, from 0 on, in its unit."""
    if on == "time":
        return np.linspace(0, scene.time[-1], doubled(scene.settings.fine_knots, finer))
    x = scene.abscissa(on)
    return from_zero(x, np.ones(x.shape, bool), doubled(scene.settings.knots, finer))


def drift(scene: Scene, sensor: str) -> float:
    """The unit of errors of a `sensor` that depend on run order or signals, so that coefficients are about 1."""
    return TYPICAL * largest(scene, sensor)


def largest(scene: Scene, sensor: str) -> float:
    """The largest magnitude of the signal of a `sensor`, in its unit."""
    return float(np.abs(scene.smooth[sensor.removesuffix(" sensor").replace(" ", "_")]).max())
