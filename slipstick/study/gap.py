"""The gap between model and recordings on held-out conditions, before and after an effect is added.

closure = 1 - (MSE_after - V) / (MSE_before - V): MSE that of the shifting time or of a signal on conditions that the
fit has not seen, V what sensor noise and the scatter of all parameters from run to run alone would leave, by the model
with the effect.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from slipstick.study import variation
from slipstick.study.comparison import Comparison
from slipstick.study.held_out import folds, without
from slipstick.study.linearised import predict_at
from slipstick.study.mixed import MixedFit

_DRAWS = 16
"""Of the scatter, by which the mean and the spread of an experiment are predicted."""
_BOOTSTRAP = 1000
_TAIL = 0.05  # beyond either end of an interval


@dataclass(frozen=True, eq=False)
class Prediction:
    """Held-out predictions: `square` (n, channels) mean squared errors, and the `variance` (n, channels) expected.

    In the channels' units, squared. `time` (n,) is the predicted shifting time in s.
    """

    square: np.ndarray
    variance: np.ndarray
    time: np.ndarray


def predict(comparison: Comparison, found: MixedFit, seed: int) -> Prediction:
    """Predict every experiment by the fits to conditions of other kinds, the mean over the folds it is left out in."""
    n, channels = len(comparison.measured), comparison.channels
    square, variance, time, count = np.zeros((n, len(channels))), np.zeros((n, len(channels))), np.zeros(n), np.zeros(n)
    d, spread = len(found.design.parameters), variation.covariance(comparison.recordings.conditions, found)
    draws = ndtri(qmc.Sobol(d, rng=seed).random(_DRAWS)) @ np.linalg.cholesky(spread).T
    draws[:, list(found.design.scattering)] += found.state.modes.mean(axis=0)
    noise = [comparison.noise[name] ** 2 for name in channels]
    for rows in folds(comparison.recordings.conditions, seed):
        places = np.flatnonzero(rows)
        part = comparison.take(places)
        points = np.tile(without(found, rows), (_DRAWS, len(places), 1))
        points[:, :, :d] += draws[:, None, :]
        predicted = predict_at(part, found.design, points)
        mean = predicted.mean(axis=0)
        wrong = (part.measured - mean) ** 2 * part.weights
        scattered = predicted.var(axis=0, ddof=1) * part.weights
        for at, columns in enumerate(channels.values()):
            kept = part.weights[:, columns].sum(axis=1)
            square[places, at] += wrong[:, columns].sum(axis=1) / kept
            variance[places, at] += scattered[:, columns].sum(axis=1) / kept + noise[at]
        time[places] += mean[:, -1]
        count[places] += 1
    return Prediction(square / count[:, None], variance / count[:, None], time / count)


def closures(comparison: Comparison, before: Prediction, after: Prediction, seed: int) -> dict[str, dict[str, Any]]:
    """By channel: RMS errors before and after, what is expected of a right model, and the share of the gap closed.

    The share and its interval are None where the gap before is within its own error.
    """
    n = len(before.square)
    drawn = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), _BOOTSTRAP) / n
    found = {}
    for at, name in enumerate(comparison.channels):
        wide, narrow, expected = before.square[:, at], after.square[:, at], after.variance[:, at]
        gap = drawn @ (wide - expected)
        sure = np.quantile(gap, _TAIL) > 0
        shares = 1 - (drawn @ (narrow - expected)) / gap if sure else np.array([])
        found[name] = {
            "rms_before": float(np.sqrt(wide.mean())), "rms_after": float(np.sqrt(narrow.mean())),
            "rms_expected": float(np.sqrt(expected.mean())),
            "closure": float(1 - (narrow - expected).mean() / (wide - expected).mean()) if sure else None,
            "lower": float(np.quantile(shares, _TAIL)) if sure else None,
            "upper": float(np.quantile(shares, 1 - _TAIL)) if sure else None,
        }
    return found
