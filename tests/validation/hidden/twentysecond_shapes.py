"""Shapes that several effects of the list `solar` have.

Most are curves through the places that the parts of a mechanism pass on their way from a `start` to an `end`, monotone
between them and level outside.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BSpline, PchipInterpolator, make_interp_spline

_TOGGLED = PchipInterpolator([0, 0.22, 0.42, 0.6, 0.7, 0.8, 1], [0, 1, 0, -0.75, -0.65, 1.05, 1.1])
_STRUCK = PchipInterpolator([0, 0.36, 0.42, 0.5, 0.56, 1], [0, 0.08, 0.95, 0.2, 0.2, 0.7])
_POSISTOR = PchipInterpolator([0, 0.18, 0.44, 0.5, 0.57, 0.62, 1], [0.8, 0.35, 0.05, 0.12, 0.92, 1, 0.5])
_JETS = PchipInterpolator(
    [0, 0.12, 0.34, 0.41, 0.5, 0.6, 0.82, 0.89, 1], [0, 0.6, 1, -0.2, -0.1, 0.3, 0.6, -0.25, -0.25])
_TWIN = PchipInterpolator([0, 0.12, 0.22, 0.31, 0.42, 0.62, 0.76, 1], [0.2, 0.4, 1, -0.1, -0.2, 0.55, 0.55, -0.05])
_DUCKBILL = PchipInterpolator(
    [0, 0.12, 0.28, 0.35, 0.58, 0.66, 0.74, 0.86, 1], [0.45, 0.12, 0, 0.75, 1, 0.85, 0, 0.25, 0.6])
_RELEASED = PchipInterpolator([0, 0.2, 0.34, 0.43, 0.5, 0.68, 0.86, 1], [0, 0.08, 0.4, 1, -0.35, -0.25, 0.2, 0.7])
_RIDDEN = PchipInterpolator([0, 0.18, 0.26, 0.62, 0.7, 1], [0, 0, 0.5, 1, -0.35, 0.05])
_PULSE = PchipInterpolator(
    [0, 0.12, 0.18, 0.28, 0.42, 0.56, 0.62, 0.74, 1], [-0.1, -0.1, 1, 0.6, 0.42, 0.35, -0.7, -0.3, -0.12])


def _along(curve: PchipInterpolator, x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the curve, whose own places are from 0 to 1."""
    return curve(np.clip((np.asarray(x, dtype=float) - start) / (end - start), 0, 1))


def toggled(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the force of a lever that goes over its dead centre: up to 1, down to -0.75, and 1.1 at its stop."""
    return _along(_TOGGLED, x, start, end)


def struck(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the force on a part with play: hardly any, a blow of nearly 1, and from 0.2 up to 0.7."""
    return _along(_STRUCK, x, start, end)


def posistor(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the resistance of a ceramic: down from 0.8 to nearly 0, a leap to 1 at the middle, and down to 0.5."""
    return _along(_POSISTOR, x, start, end)


def jets(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the head of two jet pumps, which grow as a root up to 1 and up to 0.6, and break off in their throats."""
    return _along(_JETS, x, start, end)


def twin(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return a narrow hump of 1 and a broad one of about 0.55, with a hollow in between that is below both ends."""
    return _along(_TWIN, x, start, end)


def duckbill(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the flow through two lips: a leak that closes, up to 1, none as they turn over, and a leak again."""
    return _along(_DUCKBILL, x, start, end)


def ridden(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the lift of a part that climbs a step of 0.5, rides on a ramp to 1, falls to -0.35, and is drawn back."""
    return _along(_RIDDEN, x, start, end)


def pulse(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return a pulse behind a capacitor: a leap to 1 that decays to 0.35, a leap down to -0.7, and a decay of it."""
    return _along(_PULSE, x, start, end)


def released(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return how far a part is drawn: ever more up to 1, where it is let go, past its rest to -0.35, and to 0.7."""
    return _along(_RELEASED, x, start, end)


def rounded(shape: Callable[[np.ndarray, float, float], np.ndarray], width: float) -> BSpline:
    """Return a shape from 0 to 1, averaged by a bell curve of a `width`, with four derivatives without jumps.

    What the valve's current depends on needs it, because the pressure depends on the rate of the current.
    """
    places, away = np.linspace(-0.1, 1.1, 601), np.linspace(-4, 4, 81)
    weights = np.exp(-(away**2) / 2)
    return make_interp_spline(places, shape(places[:, None] + width * away, 0, 1) @ weights / weights.sum(), k=5)


def nested(x: np.ndarray, at: float, width: float, inner: float, narrow: float) -> np.ndarray:
    """Return a broad valley about `at`, flat at its bottom of about -0.7, from which a narrow peak rises `inner`.

    The peak is 1.1 high above the valley, and half of it is as wide as `narrow` to each side.
    """
    return -0.7 / (1 + ((x - at) / width) ** 4) + 1.1 / (1 + ((x - inner) / narrow) ** 2)
