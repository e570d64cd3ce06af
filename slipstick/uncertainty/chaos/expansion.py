"""Polynomial chaos in standardised germs (section III.A, eqs. 5 and 6, appendix).

    y(x(xi)) ~ sum over i of c_i P_i(xi)

P_i are products of the orthonormal polynomials of the germs, whose families are those of Table I. The coefficients are
c = projection @ y(nodes). The projection is either a quadrature (eq. 6) over the tensor product of Gauss rules, or a
least-squares regression on samples. The polynomials depend on the shapes of the germs only, not on mean and std of the
inputs. Polynomials in x itself would have to be rebuilt for each candidate, and are ill-conditioned for a small std.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.numerics.matrix_product import matrix_product
from slipstick.uncertainty.chaos import least_squares, rules
from slipstick.uncertainty.chaos.germs import Germ
from slipstick.uncertainty.chaos.polynomials import Polynomials
from slipstick.uncertainty.chaos.truncation import degrees

ORDER = 8
"""Default order of up to five inputs; see `default_order`."""
Rule = Literal["tensor", "regression"]
LARGEST = 20_000_000
"""Largest number of entries of a projection matrix, terms times nodes."""
_MOST_WORK = 10**10  # largest terms^2 times nodes, a regression of some seconds
_OVERSAMPLING = 2  # samples per term: a higher order is a better use of runs than three (benchmarks/sparse_rules.csv)
_LEAST_SLACK = 1e-9  # lower limit of 1 - leverage: at a leverage of 1 the leave-one-out error is undefined


@dataclass(frozen=True)
class ExpansionSettings:
    """Settings of an expansion. Raises `InvalidValue`.

    `order` (default `default_order`) and `norm` select the polynomials (truncation.py). The `rule` "tensor" runs the
    model at `nodes` Gauss nodes per axis (default order + 1), and at `checks` additional samples for the error
    estimate. The rule "regression" runs the model at `samples` samples (default twice the number of terms). Both kinds
    of samples are drawn with `seed`. The default rule is tensor for one or two inputs and regression for more
    (benchmarks/sparse_rules.csv).
    """

    order: int | None = None
    norm: float = 1.0
    rule: Rule | None = None
    nodes: int | None = None
    checks: int = 16
    samples: int | None = None
    seed: int = 1

    def __post_init__(self) -> None:
        """Check the settings; too few nodes would alias polynomials of high order to low order."""
        if self.rule not in (None, "tensor", "regression"):
            raise InvalidValue(f"There is no rule '{self.rule}'", "Choose tensor or regression")
        if self.nodes is not None and self.order is not None and self.nodes <= self.order:
            raise InvalidValue(f"{self.nodes} nodes per axis do not resolve polynomials up to order {self.order}",
                               f"Take at least {self.order + 1} nodes, or a lower order")
        if self.checks < 0:
            raise InvalidValue(f"The number of checks is {self.checks}", "Take 0 for no error estimate, or more")


@dataclass(frozen=True, eq=False)
class Basis:
    """t polynomials of d germs, and the q nodes at which the model is to be run.

    Shapes: `nodes` (q, d) germs; `projection` (t, q), with c = projection @ y; and `error_weights` (q,), the weights of
    the squared residuals at the nodes in the squared error, all 0 if the error is not estimated.
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
        assert self.settings.order is not None  # as `make_basis` has set it
        return self.settings.order

    @property
    def degrees(self) -> np.ndarray:
        """The degree of each term in each germ, shape (t, d)."""
        return self.polynomials.degrees

    @cached_property
    def is_linear(self) -> np.ndarray:
        """1 for the term that is linear in an input, and 0 for others, shape (d, t)."""
        is_first = self.degrees.sum(axis=1) == 1
        return np.ascontiguousarray((is_first[:, None] & (self.degrees == 1)).T.astype(float))

    def at(self, germs: np.ndarray) -> np.ndarray:
        """All polynomials at the germs (m, d): shape (m, t)."""
        return self.polynomials.at(germs)


@dataclass(frozen=True, eq=False)
class Expansion:
    """The model as polynomials of the germs: `coefficients` (t, n) in s, NaN for a condition without an expansion.

    `times` (q, n) in s are the shifting times of the model at the nodes.
    """

    basis: Basis
    coefficients: np.ndarray
    times: np.ndarray

    @property
    def missing(self) -> np.ndarray:
        """Mask of the conditions without an expansion, shape (n,): those with a time of NaN at any node."""
        return np.asarray(np.isnan(self.coefficients[0]))

    @property
    def mean(self) -> np.ndarray:
        """Mean of the polynomial, shape (n,), s."""
        return np.asarray(self.coefficients[0])

    @property
    def linear(self) -> np.ndarray:
        """Coefficients of the linear terms, shape (d, n), s; 0 for a condition without an expansion."""
        return np.asarray(np.nan_to_num(self.basis.is_linear @ self.coefficients))

    @property
    def std(self) -> np.ndarray:
        """Standard deviation of the polynomial, shape (n,), s."""
        return np.asarray(np.sqrt(np.sum(self.coefficients[1:] ** 2, axis=0)))

    @property
    def error(self) -> np.ndarray:
        """Estimated RMS difference of polynomial and model over the inputs, shape (n,), s; NaN without an estimate.

        The regression uses the leave-one-out error, the tensor rule the error at the checks. For most conditions the
        estimate is within a factor of two of the true error. It misses a kink in a region of low probability that
        contains no node (benchmarks/sparse_rules.csv).
        """
        weights = self.basis.error_weights
        if not weights.any():
            return np.full(len(self.mean), np.nan)
        residual = self.times - self.at(self.basis.nodes)
        return np.asarray(np.sqrt(matrix_product(weights[None], residual**2)[0]))

    def at(self, germs: np.ndarray) -> np.ndarray:
        """The polynomial at the germs (m, d): shape (m, n), s."""
        return self.basis.polynomials.sum(self.coefficients, germs)


def expand(basis: Basis, times: np.ndarray) -> Expansion:
    """Project the times of the model at the nodes (q, n), s, onto the basis (eq. 6)."""
    return Expansion(basis, matrix_product(basis.projection, times), times)


def default_order(dimension: int, norm: float = 1.0) -> int:
    """`ORDER`, or for many inputs the highest order of which a regression is not too large."""
    for order in range(ORDER, 1, -1):
        try:
            terms = len(degrees(dimension, order, norm))
            _require_size(terms, _OVERSAMPLING * terms, "Lower the order")
        except InvalidValue:
            continue
        return order
    return 1


@lru_cache(maxsize=8)
def make_basis(germs: tuple[Germ, ...], settings: ExpansionSettings) -> Basis:
    """The basis of the germs with its nodes; cached. Raises `InvalidValue`."""
    if settings.order is None:
        return make_basis(germs, replace(settings, order=default_order(len(germs), settings.norm)))
    polynomials = Polynomials.of(germs, degrees(len(germs), settings.order, settings.norm))
    rule = settings.rule or ("tensor" if len(germs) <= 2 else "regression")
    other, name, count = ("regression", "runs", settings.samples) if rule == "tensor" else (
        "tensor", "nodes", settings.nodes)
    if count is not None:
        raise InvalidValue(f"`{name}` is {count}, but the rule is {rule}" + " by default" * (settings.rule is None),
                           f"Omit `{name}`, or choose the rule {other}, which takes it")
    return _by_tensor(polynomials, settings, settings.nodes or settings.order + 1) if rule == "tensor" else \
        _by_regression(polynomials, settings)


def _by_tensor(polynomials: Polynomials, settings: ExpansionSettings, count: int) -> Basis:
    terms, dimension = polynomials.degrees.shape
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
        raise InvalidValue(f"{count} samples are too few for a leave-one-out regression on {terms} polynomials",
                           f"Take {_OVERSAMPLING * terms} samples, or a lower order")
    _require_size(terms, count, "Lower the order or the norm, or vary fewer inputs")
    nodes, weights = rules.samples(polynomials, count, settings.seed)
    values = polynomials.at(nodes)
    projection = least_squares.projection(values, weights)
    leverage = np.sum(values * projection.T, axis=1)
    error_weights = weights / np.maximum(1 - leverage, _LEAST_SLACK) ** 2
    return Basis(settings, polynomials, nodes, projection, error_weights)


def _require_size(terms: int, nodes: int, remedy: str) -> None:
    if terms * nodes > LARGEST or terms**2 * nodes > _MOST_WORK:
        raise InvalidValue(f"{terms} polynomials at {nodes} nodes are too many", remedy)
