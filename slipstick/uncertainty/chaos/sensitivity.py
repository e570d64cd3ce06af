"""Sobol indices from the coefficients of an expansion (Sudret, Reliab. Eng. Syst. Saf. 93, 964, 2008).

The polynomials are orthonormal, so the variance is the sum of the squared coefficients. Each square is attributed to
the germs in which its term has a positive degree. The indices are those of the *germs*. They equal the indices of the
inputs only if the inputs are independent: a dependent input is a combination of several germs, and the combination
depends on the order of the inputs, so that the index of a germ is not the index of an input.
"""

import numpy as np

from slipstick.uncertainty.chaos.expansion import Expansion

_ROUNDING = 1e-24  # variance relative to the squared mean, below which it is a rounding error


def first_order(expansion: Expansion) -> np.ndarray:
    """First-order Sobol index of each germ, shape (n, d); NaN where the variance is zero."""
    degrees = expansion.basis.degrees
    main_effects = (degrees > 0) & (np.count_nonzero(degrees, axis=1)[:, None] == 1)
    return _shares(expansion, main_effects)


def total(expansion: Expansion) -> np.ndarray:
    """Total Sobol index of each germ, interactions included, shape (n, d); NaN where the variance is zero."""
    return _shares(expansion, expansion.basis.degrees > 0)


def _shares(expansion: Expansion, terms: np.ndarray) -> np.ndarray:
    squares = expansion.coefficients**2
    variance = squares[1:].sum(axis=0)
    variance = np.where(variance > _ROUNDING * squares[0], variance, 0.0)
    return np.asarray((squares.T @ terms) / np.where(variance > 0, variance, np.nan)[:, None])
