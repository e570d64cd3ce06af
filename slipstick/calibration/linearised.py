"""The engagements linearised about a point each: all that the mixed model needs, in small matrices.

An engagement with autocorrelated noise e_t = rho e_{t-1} + innovation enters a likelihood through three products of
its Jacobian's columns and its residual: over all samples, over samples with two neighbours, and over neighbours. For
any rho, J' R^-1 J is a sum of them (R the correlation matrix of the noise), so the autocorrelation can be estimated
without another simulation.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.calibration.noise import Noise
from slipstick.calibration.observations import Observations

_SAMPLES = 4_000_000
"""Samples simulated at a time, so that they stay below 200 MB."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """`products` (channels, 3, n, d + 1, d + 1) about `points` (n, d): of the d columns and, last, of the residual.

    `counts` (channels, 2, n) are the numbers of samples and of pairs of neighbours.
    """

    points: np.ndarray
    products: np.ndarray
    counts: np.ndarray

    def weigh(self, noise: Noise) -> np.ndarray:
        """Products under the inverse covariance of the noise, summed over channels: (n, d + 1, d + 1)."""
        return np.asarray(np.einsum("ct,ctnpr->npr", noise.weights, self.products))


def linearise(observations: Observations, points: np.ndarray, axes: np.ndarray, lock_up_noise: float) -> Linearised:
    """Linearise about `points` (n, d), one an engagement, by central differences along the columns of `axes` (n, d, d).
    """
    n, d = points.shape
    size = max(1, _SAMPLES // ((2 * d + 1) * len(observations.signals.time)))
    parts = [_linearise_block(observations, points[places], axes[places], places, lock_up_noise)
             for places in np.array_split(np.arange(n), -(-n // size))]
    return Linearised(points, np.concatenate([part[0] for part in parts], axis=2),
                      np.concatenate([part[1] for part in parts], axis=2))


def _linearise_block(observations: Observations, points: np.ndarray, axes: np.ndarray, places: np.ndarray,
                     lock_up_noise: float) -> tuple[np.ndarray, np.ndarray]:
    m, d = points.shape
    steps = axes.transpose(2, 0, 1)
    response = observations.simulate(np.concatenate([points[None], points + steps, points - steps]), places)
    signals, times = observations.residuals(response, places)
    counted = observations.counted(observations.lock_up(response, places), places, lock_up_noise)
    products, counts = np.zeros((len(signals) + 1, 3, m, d + 1, d + 1)), np.zeros((len(signals) + 1, 2, m))
    for channel, residuals in enumerate([*signals, times[..., None]]):
        is_counted = counted[channel] if channel < len(signals) else np.ones((m, 1), bool)
        along = (residuals[d + 1:] - residuals[1:d + 1]) / 2
        rows = np.concatenate([along, residuals[:1]]).transpose(1, 0, 2)
        products[channel], counts[channel] = neighbour_products(rows, is_counted)
    back = np.zeros((m, d + 1, d + 1))
    back[:, :d, :d], back[:, d, d] = np.linalg.inv(axes), 1
    return back.transpose(0, 2, 1) @ products @ back, counts


def neighbour_products(rows: np.ndarray, counted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Three products (3, m, p, p) of rows (m, p, k) over the samples `counted` (m, k), and the counts (2, m)."""
    rows = rows * counted[:, None]
    pairs, inner = neighbours(counted)
    across = rows[:, :, :-1] @ rows[:, :, 1:].transpose(0, 2, 1)
    products = [rows @ rows.transpose(0, 2, 1), (rows * inner[:, None]) @ rows.transpose(0, 2, 1),
                across + across.transpose(0, 2, 1)]
    return np.array(products), np.array([counted.sum(axis=1), pairs.sum(axis=1)])


def neighbours(counted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of samples (m, k) which pairs (m, k - 1) count, and which samples (m, k) have two neighbours that count."""
    pairs, inner = counted[:, 1:] & counted[:, :-1], np.zeros_like(counted)
    inner[:, 1:-1] = pairs[:, 1:] & pairs[:, :-1]
    return pairs, inner
