"""Shapes that several effects of the list `lunar` have."""

import numpy as np
from scipy.interpolate import PchipInterpolator

_BRANCHES = PchipInterpolator(
    [-0.5, 0.0, 0.22, 0.27, 0.5, 0.55, 0.88, 1.0, 1.5], [0.0, 0.0, 0.4, 1.0, 0.8, 0.5, 0.45, 0.05, 0.05])
_PULLED = PchipInterpolator(
    [0.0, 0.07, 0.14, 0.18, 0.3, 0.7, 0.93, 0.98, 1.5], [0.0, 0.5, 1.0, 0.65, 0.65, 1.1, 0.9, 0.0, 0.0])


def sigmoid(z: np.ndarray) -> np.ndarray:
    """Return a smooth step from 0 to 1 at 0."""
    return 1 / (1 + np.exp(-np.clip(z, -30, 30)))


def regimes(x: np.ndarray, rounding: float, *corners: tuple[float, float]) -> np.ndarray:
    """Return a line that is 0 at first and has another slope from each corner on, which is rounded.

    A corner has a place and the slope behind it.
    """
    level, before = np.zeros_like(x, dtype=float), 0.0
    for at, slope in corners:
        level = level + (slope - before) * rounding * np.logaddexp(0, (x - at) / rounding)
        before = slope
    return level


def stopping(x: np.ndarray, end: float, straggle: float) -> np.ndarray:
    """Return what a particle leaves in its way: 0.3 at 0, ever more up to nearly 1 at `end`, and 0 behind it.

    It falls over about four times `straggle`.
    """
    left = np.maximum(1 - x / end, 0)
    return (0.05 / (left + 0.05)) ** 0.4 * sigmoid((end - x) / straggle + 1)


def doses(x: np.ndarray, rise: float, decay: float, *given: tuple[float, float]) -> np.ndarray:
    """Return what is in the blood after the doses `given`, each with a place and the height of its own hump.

    A dose is taken up over `rise` and broken down over `decay`.
    """
    top = np.log(decay / rise) / (1 / rise - 1 / decay)
    height = np.exp(-top / decay) - np.exp(-top / rise)
    late = ((np.maximum(x - at, 0), amount) for at, amount in given)
    return sum(amount * (np.exp(-z / decay) - np.exp(-z / rise)) / height for z, amount in late)


def absorbed(x: np.ndarray, knee: float, at: float, width: float) -> np.ndarray:
    """Return what saturates at 1 over `knee`, and is hardly there at one place, half of which is as wide as `width`."""
    return np.tanh(np.maximum(x, 0) / knee) - 0.9 / (1 + ((x - at) / width) ** 2)


def flips(x: np.ndarray, *places: tuple[float, float]) -> np.ndarray:
    """Return 1, and from each of the `places` on the other one of 1 and -1; each has a place and a width."""
    return np.prod([-np.tanh((x - at) / width) for at, width in places], axis=0)


def shock(x: np.ndarray, at: float, width: float, fall: float) -> np.ndarray:
    """Return a drag past the speed of sound: slowly from 0 to -0.3 before `at`, 1.1 behind it, and 0.3 far from it.

    It falls to 0.7 over `fall`, like a hyperbola.
    """
    behind = sigmoid((x - at) / width)
    return behind * (0.3 + 0.8 / (1 + np.maximum(x - at, 0) / fall)) - 0.3 * (1 - behind) * np.clip(x / at, 0, 1)


def pulled(x: np.ndarray, last: float) -> np.ndarray:
    """Return the force of a rod that is pulled until it breaks at `last`: up to 1, a drop, 1.1, 0.9, and 0 behind."""
    return _PULLED(np.clip(x / last, 0, 1.5))


def ordering(x: np.ndarray, at: float, before: float, after: float) -> np.ndarray:
    """Return the heat of a change of order: a pointed top of 0.8 at `at`, and 0.45 less behind it than before it.

    Half of the top is left at `before` in front of it.
    """
    z = (x - at) / np.where(x < at, before, after)
    return 1 / (1 + (z**2 + 0.002) ** 0.25) - 0.45 * sigmoid((x - at) / (0.04 * after))


def dosage(x: np.ndarray, low: float, steep: float, high: float, abrupt: float, left: float) -> np.ndarray:
    """Return an effect that sets in at `low`, and of which from `high` on only a part is `left`.

    Both steps are those of binding, with the powers `steep` and `abrupt`.
    """
    z = np.maximum(x, 0)
    first, second = ((z / at) ** power for at, power in ((low, steep), (high, abrupt)))
    return first / (1 + first) * (1 - (1 - left) * second / (1 + second))


def branches(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the swing of a cylinder in a flow: up to 0.4, a jump to 1, down to 0.8, a jump to 0.5, and the end.

    The second branch begins at a fourth of the way from `start` to `end`, and the last one, nearly level, at the half.
    """
    return _BRANCHES(np.clip((x - start) / (end - start), -0.5, 1.5))


def seizing(x: np.ndarray, film: float, seizure: float) -> np.ndarray:
    """Return the friction of a bearing over positive `x`: 1 at 0, less beyond `film`, slowly more, and a jump by 0.8.

    The jump is at `seizure`, before which it has risen to 0.4.
    """
    z = np.maximum(x, 0)
    run = 0.4 * np.minimum(z / seizure, 1.5)
    return 1 / (1 + (z / film) ** 2.5) + run + 0.8 * sigmoid((x - seizure) / (0.04 * seizure))


def relaxing(x: np.ndarray, rounding: float, pace: float, left: float, *steps: tuple[float, float]) -> np.ndarray:
    """Return the sum of `steps`, each with a place and a height, of which only a part is `left` after a `pace`."""
    return sum(height * sigmoid((x - at) / rounding) * (left + (1 - left) * np.exp(-np.maximum(x - at, 0) / pace))
               for at, height in steps)


def activity(x: np.ndarray, pace: float, at: float, width: float, left: float) -> np.ndarray:
    """Return how active a ferment is: ever more over `pace` up to 1 before `at`, where it is destroyed over `width`.

    Behind, it comes back, from 0 to what is `left`, over four times `pace`.
    """
    destroyed = sigmoid((x - at) / width)
    back = left * (1 - np.exp(-np.maximum(x - at, 0) / (4 * pace)))
    return np.exp(np.minimum(x - at, 0) / pace) * (1 - destroyed) + back * destroyed
