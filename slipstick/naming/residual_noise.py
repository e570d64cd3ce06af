"""The noise of a sensor, bounded by what a block leaves of its signal.

Differences of neighbouring samples tell the noise at high frequencies. Where it is strongly correlated they say little
about its power at low ones: correlations of 0.85 and 0.999 hardly differ in them, but by a factor of 10,000 in that
power, and a block that assumes the larger one loses what slow changes of the signal say. The residuals of a block are
the noise and what the block lacks, so that they bound the power from above.
"""

import numpy as np

Noise = tuple[float, float]
"""Standard deviation in the unit of the signal, and autocorrelation from sample to sample."""

_TOO_MUCH = 2.0
"""Ratio of powers from which a noise is corrected. Estimates from 54 engagements with correlations below 0.75 differ by
less from the true ones."""


def bounded(noise: Noise, left: np.ndarray, counted: np.ndarray) -> Noise:
    """`noise`, or that of the residuals `left` (n, k) where `counted` (n, k), if it has far less power than `noise`."""
    pairs = counted[:, 1:] & counted[:, :-1]
    before, after = left[:, :-1][pairs], left[:, 1:][pairs]
    variance = float((left[counted] ** 2).mean())
    # Not over the squares of one side alone: residuals that grow would have a correlation above 1.
    rho = (before * after).sum() / max(np.sqrt((before**2).sum() * (after**2).sum()), 1e-300)
    its = float(np.sqrt(variance)), float(rho)
    return its if _TOO_MUCH * power(its) < power(noise) else noise


def power(noise: Noise) -> float:
    """Power at low frequencies, in the square of the unit: the sum of all autocovariances."""
    std, rho = noise
    return std**2 * (1 + rho) / (1 - rho) if rho < 1 else np.inf
