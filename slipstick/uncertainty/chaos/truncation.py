"""Which products of polynomials an expansion keeps: all up to a total degree, or a hyperbolic part of them."""

import numpy as np

from slipstick.errors import InvalidValue

HIGHEST_ORDER = 40
MOST_TERMS = 2000
"""Beyond, making the expansion takes longer than most models take to run."""


def degrees(dimension: int, order: int, norm: float = 1.0) -> np.ndarray:
    """The multi-indices i >= 0 with (sum over axes of i^norm)^(1/norm) <= order: shape (t, dimension).

    `norm` 1 keeps the total degree, (order + dimension)! / (order! dimension!) terms; one below 1 drops interactions,
    the more the nearer to 0 (Blatman and Sudret, J. Comput. Phys. 230, 2345, 2011). Lowest total degree first, and so
    the constant at the head. Raises `InvalidValue`.
    """
    if dimension < 1 or not 0 <= order <= HIGHEST_ORDER:
        raise InvalidValue(f"There is no expansion of order {order} in {dimension} inputs",
                           f"Take at least one input and an order from 0 to {HIGHEST_ORDER}")
    if not 0 < norm <= 1:
        raise InvalidValue(f"The norm of the truncation is {norm}", "Take 1 for the total degree, or less but above 0")
    shares = (np.arange(order + 1) / max(order, 1)) ** norm
    kept = np.zeros((1, 0), np.int64)
    for _ in range(dimension):
        used = shares[kept].sum(axis=1)
        rows, degree = np.nonzero(used[:, None] + shares <= 1 + 1e-12)
        kept = np.column_stack([kept[rows], degree])
        if len(kept) > MOST_TERMS:
            raise InvalidValue(f"An expansion of order {order} in {dimension} inputs has more than {MOST_TERMS} terms",
                               "Lower the order or the norm, or vary fewer inputs")
    by_degree: np.ndarray = kept[np.lexsort([*-kept.T[::-1], kept.sum(axis=1)])]
    return by_degree
