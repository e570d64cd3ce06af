"""Nodes and weights of an expansion: Gauss rules, their tensor product, and samples for a regression."""

import numpy as np
import scipy

from slipstick.uncertainty.chaos.germs import Germ
from slipstick.uncertainty.chaos.polynomials import Polynomials

_FEWEST, _FINER = 16, 4
"""Samples are drawn from a Gauss rule with at least 16 nodes, and 4 per polynomial."""


def gauss(germ: Germ, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (count,) of the Gauss rule of a germ, from its recurrence (Golub and Welsch 1969).

    The weights are computed as 1 / sum of P_n^2, which is accurate far out in the tails; the eigenvectors are not.
    """
    alpha, beta = germ.recurrence(count)
    nodes: np.ndarray = scipy.linalg.eigvalsh_tridiagonal(alpha, np.sqrt(beta[1:]))
    values = Polynomials.of((germ,), np.arange(count)[:, None]).at(nodes[:, None])
    weights = 1 / np.sum(values**2, axis=1)
    return nodes, weights / weights.sum()


def tensor(germs: tuple[Germ, ...], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Tensor product of Gauss rules with `count` nodes per axis: nodes (count^d, d) and weights (count^d,)."""
    rules = {germ: gauss(germ, count) for germ in germs}
    nodes, weights = (np.stack(np.meshgrid(*(rules[germ][which] for germ in germs), indexing="ij"), axis=-1)
                      for which in (0, 1))
    return nodes.reshape(-1, len(germs)), weights.reshape(-1, len(germs)).prod(axis=1)


def samples(polynomials: Polynomials, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Seeded samples (count, d) for least squares with the t polynomials P_i, and their weights, which sum to 1.

    The sampling density is the density of the germs times the mean of P_i^2 over the terms. The weights are
    proportional to the inverse of that mean. With these samples a regression of any order is well conditioned from few
    samples (Cohen and Migliorati, SMAI J. Comput. Math. 3, 181, 2017). The density is a mixture: a Sobol point selects
    the term i, and then draws each axis from the distribution with density P_i^2, discretised on a fine Gauss rule.
    """
    degrees = polynomials.degrees
    terms, dimension = degrees.shape
    uniform = scipy.stats.qmc.Sobol(dimension + 1, rng=seed).random(1 << (count - 1).bit_length())[:count]
    of_sample = degrees[(uniform[:, -1] * terms).astype(np.int64)]
    nodes, highest = np.empty((count, dimension)), int(degrees.max())
    for axis, germ in enumerate(polynomials.germs):
        fine, weights = gauss(germ, max(_FEWEST, _FINER * (highest + 1)))
        values = Polynomials.of((germ,), np.arange(highest + 1)[:, None]).at(fine[:, None])
        cumulative = np.cumsum(weights[:, None] * values**2, axis=0)
        index = np.sum(cumulative[:, of_sample[:, axis]] < uniform[:, axis], axis=0)
        nodes[:, axis] = fine[np.minimum(index, len(fine) - 1)]
    weights = 1 / np.sum(polynomials.at(nodes) ** 2, axis=1)
    return nodes, weights / weights.sum()
