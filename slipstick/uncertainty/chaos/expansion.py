"""Polynomial chaos in standardised germs (section III.A, eqs. 5 and 6, appendix).

    y(x(xi)) ~ sum over i of c_i P_i(xi)

P_i are products of the orthonormal polynomials of the germs, whose families are those of Table I, and c = projection
@ y at the nodes: a weighted sum (eq. 6) over the full tensor Gauss rule, or a regression on samples. The polynomials
depend on the shapes of the germs alone, not on mean and std of the inputs: an expansion in x itself would have to be
made anew for each candidate, and goes wrong for a small std.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.matrix_product import matrix_product
from slipstick.uncertainty.chaos import least_squares, rules
from slipstick.uncertainty.chaos.germs import Germ
from slipstick.uncertainty.chaos.polynomials import Polynomials
from slipstick.uncertainty.chaos.truncation import degrees

ORDER = 8
Rule = Literal["tensor", "regression"]
LARGEST = 20_000_000
"""Most entries of a projection, terms times nodes."""
_MOST_WORK = 10**10  # terms^2 times nodes: a regression of some seconds
_ROWS = 8192  # to evaluate at a time
_OVERSAMPLING = 2  # samples a term: a third buys no more than a higher order does (benchmarks/sparse_rules.csv)
_INTERPOLATED = 1e-9  # a sample that the polynomial passes through whatever its value says nothing of the error


@dataclass(frozen=True)
class ExpansionSettings:
    """How to expand; what is None follows from the rest. Raises `InvalidValue`.

    `order` and `norm` choose the polynomials (truncation.py). `rule` tensor runs the model at `nodes` Gauss nodes an
    axis (order + 1), and at `checks` samples more for the error; regression at `samples` (twice the terms), `seed`ed.
    By itself the rule is tensor for one or two inputs and regression for more: benchmarks/sparse_rules.csv.
    """

    order: int = ORDER
    norm: float = 1.0
    rule: Rule | None = None
    nodes: int | None = None
    checks: int = 16
    samples: int | None = None
    seed: int = 1

    def __post_init__(self) -> None:
        """Refuse a rule that takes polynomials of high order for others of low order."""
        if self.rule not in (None, "tensor", "regression"):
            raise InvalidValue(f"There is no rule '{self.rule}'", "Choose tensor or regression")
        if self.nodes is not None and self.nodes <= self.order:
            raise InvalidValue(f"{self.nodes} nodes an axis cannot tell the polynomials up to order {self.order} apart",
                               f"Take at least {self.order + 1} nodes, or a lower order")
        if self.checks < 0:
            raise InvalidValue(f"There are {self.checks} checks", "Take 0 for no estimate of the error, or more")


@dataclass(frozen=True, eq=False)
class Basis:
    """t polynomials of d germs, and the q nodes at which they want the model.

    Shapes: `nodes` (q, d) germs, `projection` (t, q) with c = projection @ y, and `error_weights` (q,) of the squared
    residuals at the nodes in the square of the error; all 0 where there is no estimate of it.
    """

    settings: ExpansionSettings
    polynomials: Polynomials
    nodes: np.ndarray
    projection: np.ndarray
    error_weights: np.ndarray

    @property
    def germs(self) -> tuple[Germ, ...]:
        """The germ of each axis."""
        return self.polynomials.germs

    @property
    def order(self) -> int:
        """The highest total degree."""
        return self.settings.order

    @property
    def degrees(self) -> np.ndarray:
        """The degree of each term in each germ, shape (t, d)."""
        return self.polynomials.degrees

    def at(self, germs: np.ndarray) -> np.ndarray:
        """All polynomials at the germs (m, d): shape (m, t)."""
        return self.polynomials.at(germs)


@dataclass(frozen=True, eq=False)
class Expansion:
    """The model as polynomials of the germs: `coefficients` (t, n) in s, NaN where a condition has none.

    `times` (q, n) are those of the model at the nodes.
    """

    basis: Basis
    coefficients: np.ndarray
    times: np.ndarray

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

    @property
    def error(self) -> np.ndarray:
        """Estimated root mean square over the inputs of polynomial minus model, shape (n,), s; NaN without checks.

        By regression the leave-one-out error, by the tensor rule that at the checks. Most conditions have a true
        error within a factor of two of it; a kink in a rare corner of the inputs, which no node meets, goes unnoticed
        (benchmarks/sparse_rules.csv).
        """
        weights = self.basis.error_weights
        if not weights.any():
            return np.full(len(self.mean), np.nan)
        residual = self.times - self.at(self.basis.nodes)
        error: np.ndarray = np.sqrt(matrix_product(weights[None], residual**2)[0])
        return error

    def at(self, germs: np.ndarray) -> np.ndarray:
        """The polynomial at the germs (m, d): shape (m, n), s."""
        parts = np.array_split(germs, 1 + len(germs) // _ROWS)  # at all germs at once the polynomials fill gigabytes
        return np.concatenate([matrix_product(self.basis.at(part), self.coefficients) for part in parts])


def expand(basis: Basis, times: np.ndarray) -> Expansion:
    """Project the model's times at the nodes (q, n), s, on the basis (eq. 6)."""
    return Expansion(basis, matrix_product(basis.projection, times), times)


@lru_cache(maxsize=8)
def make_basis(germs: tuple[Germ, ...], settings: ExpansionSettings) -> Basis:
    """The polynomials of the germs and where to run the model for them; cached. Raises `InvalidValue`."""
    polynomials = Polynomials.of(germs, degrees(len(germs), settings.order, settings.norm))
    rule = settings.rule or ("tensor" if len(germs) <= 2 else "regression")
    return (_by_tensor if rule == "tensor" else _by_regression)(polynomials, settings)


def _by_tensor(polynomials: Polynomials, settings: ExpansionSettings) -> Basis:
    terms, dimension = polynomials.degrees.shape
    count = settings.nodes or settings.order + 1
    _require_size(terms, count**dimension + settings.checks, "Take the regression, a lower order, or fewer inputs")
    nodes, weights = rules.tensor(polynomials.germs, count)
    projection = (polynomials.at(nodes) * weights[:, None]).T
    error_weights = np.zeros(len(nodes))
    if settings.checks:
        checks, weights = rules.samples(polynomials, settings.checks, settings.seed)
        nodes = np.concatenate([nodes, checks])
        projection = np.pad(projection, ((0, 0), (0, len(checks))))
        error_weights = np.concatenate([error_weights, weights])
    return Basis(settings, polynomials, nodes, np.ascontiguousarray(projection), error_weights)


def _by_regression(polynomials: Polynomials, settings: ExpansionSettings) -> Basis:
    terms = len(polynomials.degrees)
    count = settings.samples or _OVERSAMPLING * terms
    if count <= terms:
        raise InvalidValue(f"{count} samples cannot tell {terms} polynomials apart and leave one out",
                           f"Take {_OVERSAMPLING * terms} samples, or a lower order")
    _require_size(terms, count, "Lower the order or the norm, or vary fewer inputs")
    nodes, weights = rules.samples(polynomials, count, settings.seed)
    values = polynomials.at(nodes)
    projection = least_squares.projection(values, weights)
    leverage = np.sum(values * projection.T, axis=1)
    error_weights = weights / np.maximum(1 - leverage, _INTERPOLATED) ** 2
    return Basis(settings, polynomials, nodes, projection, error_weights)


def _require_size(terms: int, nodes: int, remedy: str) -> None:
    if terms * nodes > LARGEST or terms**2 * nodes > _MOST_WORK:
        raise InvalidValue(f"{terms} polynomials at {nodes} nodes are too many", remedy)
