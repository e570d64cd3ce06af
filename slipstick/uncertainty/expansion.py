"""Polynomial chaos in the standard germ (section III.A, eqs. 5 and 6, appendix).

    y(mean + L theta) ~ sum over |i| <= order of c_i H_i(theta)
    c_i = sum over j of y(mean + L theta_j) H_i(theta_j) w_j

H_i are the orthonormal Hermite polynomials of theta ~ N(0, I), theta_j and w_j the full tensor Gauss rule.
They do not depend on mean or L: chaospy makes them once, and an expansion is one matrix product. An expansion
in x itself would have to be made anew for each candidate, and goes wrong for a small std.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from chaospy import Iid, Normal, generate_expansion, generate_quadrature

from slipstick.errors import InvalidValue
from slipstick.uncertainty.product import product

ORDER = 8
NODES = 9
HIGHEST_ORDER = 20  # sums of monomials keep 12 digits up to here, and lose them fast above
LARGEST = 100_000
"""Most nodes of a rule: beyond, a full tensor grid is the wrong tool."""


@dataclass(frozen=True, eq=False)
class Basis:
    """t orthonormal Hermite polynomials of d germs up to total degree `order`, and a tensor rule of q nodes.

    Shapes: `nodes` (q, d), `weights` (q,), `degrees` (t, d) the multi-index of each term, `projection` (t, q)
    with c = projection @ y. The polynomials are `monomials` (e, t), of the powers `exponents` (e, d).
    """

    order: int
    nodes: np.ndarray
    weights: np.ndarray
    degrees: np.ndarray
    projection: np.ndarray
    exponents: np.ndarray
    monomials: np.ndarray

    def at(self, germs: np.ndarray) -> np.ndarray:
        """All polynomials at the germs (m, d): shape (m, t)."""
        return _polynomials(germs, self.exponents, self.monomials)


@dataclass(frozen=True, eq=False)
class Expansion:
    """The model as polynomials of the germ: `coefficients` (t, n) in s, NaN where a condition has none."""

    basis: Basis
    coefficients: np.ndarray

    @property
    def missing(self) -> np.ndarray:
        """Conditions without an expansion, shape (n,): the model gave no time at one of the nodes."""
        missing: np.ndarray = np.isnan(self.coefficients[0])
        return missing

    @property
    def mean(self) -> np.ndarray:
        """Mean of the polynomial, shape (n,), s."""
        mean: np.ndarray = self.coefficients[0]
        return mean

    @property
    def std(self) -> np.ndarray:
        """Standard deviation of the polynomial, shape (n,), s."""
        std: np.ndarray = np.sqrt(np.sum(self.coefficients[1:] ** 2, axis=0))
        return std

    def at(self, germs: np.ndarray) -> np.ndarray:
        """The polynomial at the germs (m, d): shape (m, n), s."""
        return product(self.basis.at(germs), self.coefficients)


def expand(basis: Basis, times: np.ndarray) -> Expansion:
    """Project the model's times at the nodes (q, n), s, on the basis (eq. 6)."""
    return Expansion(basis, product(basis.projection, times))


@lru_cache(maxsize=32)
def hermite_basis(dimension: int, order: int = ORDER, nodes: int = NODES) -> Basis:
    """Make the basis of total degree `order` with `nodes` Gauss nodes an axis; cached.

    It has (order + dimension)! / (order! dimension!) terms and nodes^dimension nodes. Raises `InvalidValue`
    where the rule is too coarse: it would take polynomials of high order for others of low order.
    """
    if dimension < 1 or not 0 <= order <= HIGHEST_ORDER:
        raise InvalidValue(f"There is no expansion of order {order} in {dimension} inputs",
                           f"Take at least one input and an order from 0 to {HIGHEST_ORDER}")
    if nodes <= order:
        raise InvalidValue(f"{nodes} nodes an axis cannot tell the polynomials up to order {order} apart",
                           f"Take at least {order + 1} nodes, or a lower order")
    if nodes**dimension > LARGEST:
        raise InvalidValue(f"{nodes} nodes on each of {dimension} axes are more than {LARGEST} model runs",
                           "Lower order and nodes, or vary fewer inputs")
    germ = Iid(Normal(0, 1), dimension)
    polynomials = generate_expansion(order, germ, normed=True)
    grid, weights = generate_quadrature(nodes - 1, germ, rule="gaussian")
    exponents, monomials = np.asarray(polynomials.exponents, np.int64), np.asarray(polynomials.coefficients)
    if order == 0:  # chaospy then forgets how many inputs there are
        exponents = np.zeros((1, dimension), np.int64)
    values = _polynomials(grid.T, exponents, monomials)
    total = np.where(monomials != 0, exponents.sum(axis=1)[:, None], -1)
    projection = np.ascontiguousarray((values * weights[:, None]).T)
    return Basis(order, grid.T, weights, exponents[total.argmax(axis=0)], projection, exponents, monomials)


def _polynomials(germs: np.ndarray, exponents: np.ndarray, monomials: np.ndarray) -> np.ndarray:
    products = np.ones((len(germs), len(exponents)))
    for axis in range(germs.shape[1]):
        powers = germs[:, axis, None] ** np.arange(exponents.max() + 1)
        products *= powers[:, exponents[:, axis]]
    return product(products, monomials)
