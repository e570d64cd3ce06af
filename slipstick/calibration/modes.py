"""The parameters of each engagement for common means and variances: its conditional modes, found by search and descent.

The misfit of an engagement has local minima in the parameters of the piston. The search therefore tries several shares
of a Gauss-Newton step, and restarts the engagements that fit worst about the common means.
"""

import itertools

import numpy as np

from slipstick.blocks.clutch import PISTON
from slipstick.calibration.linearised import Linearised, linearise, neighbours
from slipstick.calibration.noise import Noise
from slipstick.calibration.observations import Observations

SHARES = np.array([1.0, 0.5, 0.2, 0.05])
"""Of a step that are tried: where the model is curved a whole step goes too far."""
FIRST, _SMALLEST, _LARGEST = 5e-3, 5e-4, 0.1
"""Steps of the differences, in multiples of nominal values: before a posterior is known, and the limits after."""
_SEARCHES = 8
"""Steps of the search. The fit goes on from there."""
_LEVELS, _WORST = (-2, -1, 0, 1, 2), 8
"""Standard deviations at which the worst eighth of the engagements is restarted: local minima are found in fewer."""


def axes(posterior: np.ndarray) -> np.ndarray:
    """Steps of the differences (n, d, d): one standard deviation along each principal axis of a posterior (n, d, d).

    Where contact or the onset of torque falls on another sample, the slope of the model jumps. What counts is the slope
    over the range that an engagement leaves open, and not that at a point.
    """
    values, vectors = np.linalg.eigh(posterior)
    steps = np.clip(np.sqrt(np.maximum(values, 0)), _SMALLEST, _LARGEST)
    return np.asarray(vectors * steps[:, None])


def search_modes(observations: Observations, points: np.ndarray, variance: np.ndarray,
                 noise: Noise) -> tuple[np.ndarray, Linearised]:
    """Modes (n, d) from `points` (n, d) for variances (d,) about the median engagement, and the linearisation there.

    Medians, because single engagements may be in a local minimum at first.
    """
    (n, d), (lower, upper) = points.shape, observations.bounds
    first, precision = points, np.diag(1 / variance)
    steps = np.tile(FIRST * np.eye(d), (n, 1, 1))
    for search in range(_SEARCHES):
        about = linearise(observations, points, steps, noise.std[-1])
        centre, weighted = np.median(points, axis=0), about.weigh(noise)
        posterior = np.linalg.inv(weighted[:, :-1, :-1] + precision)
        pull = weighted[:, :-1, -1] + (centre - points) @ precision
        target = np.clip(points + (posterior @ pull[..., None])[..., 0], lower, upper)
        shares = np.append(SHARES, 0.0)[:, None, None]
        tried, everyone = points + shares * (target - points), np.arange(n)
        points, height = _select_best(observations, tried, everyone, centre, variance, noise)
        places = everyone if search == 0 else np.argsort(height)[n - max(1, n // _WORST):]
        restarts = _restarts(observations, first[places], centre, variance, (-1, 0, 1) if search == 0 else _LEVELS)
        others, other_height = _select_best(observations, np.clip(restarts, lower, upper), places, centre, variance,
                                            noise)
        better = other_height < height[places]
        points[places[better]], steps = others[better], axes(posterior)
    return points, linearise(observations, points, steps, noise.std[-1])


def _select_best(observations: Observations, tried: np.ndarray, places: np.ndarray, centre: np.ndarray,
                 variance: np.ndarray, noise: Noise) -> tuple[np.ndarray, np.ndarray]:
    """Of points (s, m, d) of the engagements `places` those that fit best, (m, d), and their heights (m,)."""
    heights = misfit(observations, tried, noise, places) + ((tried - centre) ** 2 / variance).sum(axis=2)
    return tried[heights.argmin(axis=0), np.arange(len(places))], heights.min(axis=0)


def _restarts(observations: Observations, first: np.ndarray, centre: np.ndarray, variance: np.ndarray,
              levels: tuple[int, ...]) -> np.ndarray:
    """Points (s, m, d) with the piston `levels` standard deviations from the centre, and all else as at first."""
    columns = [place for place, name in enumerate(observations.free) if name in PISTON]
    # No more than three at a time: with more parameters of the piston free, the number of points would explode.
    shifts = np.array(list(itertools.product(levels, repeat=min(3, len(columns)))), float)
    shifts = np.pad(shifts, ((0, 0), (0, len(columns) - shifts.shape[1])))
    restarts = np.tile(first, (len(shifts), 1, 1))
    restarts[:, :, columns] = (centre[columns] + shifts * np.sqrt(variance[columns]))[:, None]
    return restarts


def misfit(observations: Observations, points: np.ndarray, noise: Noise, places: np.ndarray) -> np.ndarray:
    """Squares (s, m) of the residuals of the engagements `places` at points (s, m, d), over the noise's covariance."""
    response = observations.simulate(points, places)
    signals, times = observations.residuals(response, places)
    # The same samples for all points of an engagement, or a point would gain by leaving out more.
    counted = observations.counted(observations.lock_up(response, places), places, noise.std[-1])
    squares = (times / noise.std[-1]) ** 2
    for residuals, is_counted, (every, inner, across) in zip(signals, counted, noise.weights, strict=False):
        pairs, interior = neighbours(is_counted)
        squares += np.einsum("snk,snk,nk->sn", residuals, residuals, every * is_counted + inner * interior,
                             optimize=True)
        squares += 2 * across * np.einsum("snk,snk,nk->sn", residuals[..., 1:], residuals[..., :-1],
                                          pairs.astype(float), optimize=True)
    return np.asarray(squares)
