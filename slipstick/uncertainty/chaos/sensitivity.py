"""Sobol indices from the coefficients of an expansion (Sudret, Reliab. Eng. Syst. Saf. 93, 964, 2008).

The polynomials are orthonormal, so the variance is a sum of squares, and each square belongs to the germs in which its
term has a degree. The indices are those of the *germs*: the inputs' own where these are independent. Of inputs that
depend on one another each is made of several germs, in an order that the correlation does not fix: an index of one of
these germs says nothing about one input.
"""

import numpy as np

from slipstick.uncertainty.chaos.expansion import Expansion

_ROUNDING = 1e-24  # of the squared mean: a variance below is that of rounding


def first_order(expansion: Expansion) -> np.ndarray:
    """The share of the variance that each germ causes by itself, shape (n, d); NaN where there is no variance."""
    degrees = expansion.basis.degrees
    alone = (degrees > 0) & (np.count_nonzero(degrees, axis=1)[:, None] == 1)
    return _shares(expansion, alone)


def total(expansion: Expansion) -> np.ndarray:
    """The share of the variance in which each germ takes part, shape (n, d); NaN where there is no variance."""
    return _shares(expansion, expansion.basis.degrees > 0)


def _shares(expansion: Expansion, terms: np.ndarray) -> np.ndarray:
    squares = expansion.coefficients**2
    variance = squares[1:].sum(axis=0)
    variance = np.where(variance > _ROUNDING * squares[0], variance, 0.0)
    shares: np.ndarray = (squares.T @ terms) / np.where(variance > 0, variance, np.nan)[:, None]
    return shares
