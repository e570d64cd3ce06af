"""Truncation of the basis of an expansion: total degree or hyperbolic cross."""

import numpy as np

from slipstick.errors import InvalidValue

HIGHEST_ORDER = 40
MOST_TERMS = 2000
"""Largest number of terms: above it the expansion itself takes longer than the runs of most models."""


def degrees(dimension: int, order: int, norm: float = 1.0) -> np.ndarray:
    """The multi-indices i >= 0 with (sum over axes of i^norm)^(1/norm) <= order: shape (t, dimension).

    A `norm` of 1 selects the total degree, with (order + dimension)! / (order! dimension!) terms. A smaller norm
    removes interactions (Blatman and Sudret, J. Comput. Phys. 230, 2345, 2011). The terms are sorted by total degree,
    so that the constant comes first. Raises `InvalidValue`.
    """
    if dimension < 1 or not 0 <= order <= HIGHEST_ORDER:
        raise InvalidValue(f"There is no expansion of order {order} in {dimension} inputs",
                           f"Take at least one input and an order from 0 to {HIGHEST_ORDER}")
    if not 0 < norm <= 1:
        raise InvalidValue(f"The norm of the truncation is {norm}",
                           "Take 1 for the total degree, or a value between 0 and 1")
    powers = (np.arange(order + 1) / max(order, 1)) ** norm
    terms = np.zeros((1, 0), np.int64)
    for _ in range(dimension):
        sums = powers[terms].sum(axis=1)
        rows, degree = np.nonzero(sums[:, None] + powers <= 1 + 1e-12)
        terms = np.column_stack([terms[rows], degree])
        if len(terms) > MOST_TERMS:
            raise InvalidValue(f"An expansion of order {order} in {dimension} inputs has more than {MOST_TERMS} terms",
                               "Lower the order or the norm, or vary fewer inputs")
    return np.asarray(terms[np.lexsort([*-terms.T[::-1], terms.sum(axis=1)])])
