"""A problem near one candidate, where polynomials stand for the model.

A model without knots is neither smooth to the last digit nor cheap. Around a candidate, over somewhat more than the
scatter of its inputs, polynomials fitted to a few hundred runs are both, and can be climbed along gradients. The
direction of the lines of integration is that of the candidate, throughout: turned lines sample other inputs.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from slipstick.matrix_product import matrix_product
from slipstick.uncertainty.chaos.expansion import Basis, Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.likelihood import centre_slopes, steepest_direction
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

_ORDERS, _LOWEST_ORDER = {1: 10, 2: 8, 3: 6, 4: 5, 5: 5, 6: 4, 7: 4, 8: 3, 9: 3, 10: 3}, 2  # by the number of inputs
_WIDER = 1.3  # the region of the polynomials against the scatter of the candidate
_NARROWEST = 0.02  # std of that region in multiples of nominal
_REACH = 1.5  # stds of the region by which a mean may move within it
_LOST = 0.2  # share of the runs that may give a condition no time


@dataclass(frozen=True, eq=False)
class PolynomialModel:
    """A model (uncertainty.likelihood.Model) by the polynomials of a Hermite `expansion` in (x - mean) / std, (d,)."""

    expansion: Expansion
    mean: np.ndarray
    std: np.ndarray

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        """Times (m, n) in s at the points (m, d)."""
        return self.expansion.at((points - self.mean) / self.std)

    @property
    def error(self) -> float | None:
        """Root mean square error in s over inputs and conditions, by leaving one run out; None without polynomials."""
        known = self.expansion.error[~self.expansion.missing]
        return float(np.sqrt(np.mean(known**2))) if known.size else None

    def slopes(self, points: np.ndarray) -> np.ndarray:
        """Derivatives of the times in the inputs at the points (m, d): shape (d, m, n), s."""
        values = self.expansion.basis.at((points - self.mean) / self.std)
        return np.array([matrix_product(values, coefficients) for coefficients in self._derived])

    @cached_property
    def _derived(self) -> np.ndarray:
        """Coefficients of the derivatives, shape (d, t, n): that of H_n is sqrt(n) H_(n - 1)."""
        degrees, coefficients = self.expansion.basis.degrees, self.expansion.coefficients
        row = {tuple(term): number for number, term in enumerate(degrees.tolist())}
        derived = np.zeros((len(self.mean), *coefficients.shape))
        for number, term in enumerate(degrees):
            for axis in np.flatnonzero(term):
                lower = row[tuple((term - np.eye(len(term), dtype=int)[axis]).tolist())]
                derived[axis, lower] += np.sqrt(term[axis]) / self.std[axis] * coefficients[number]
        return derived


def polynomial_problem(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> tuple[InferenceProblem, Unknowns]:
    """The problem with polynomials about a vector of unknowns (k,), and the part of `space` they hold in."""
    d = len(space.axes)
    inputs = space.candidate(vector).inputs
    std = np.maximum(_WIDER * inputs.marginal_std, _NARROWEST)
    region = Inputs(inputs.mean, std)
    terms = make_basis(region.germs, ExpansionSettings(_ORDERS.get(d, _LOWEST_ORDER), rule="regression"))
    expansion = expand(terms, _bridged(terms, problem.model(region.at_germs(terms.nodes), problem.conditions)))
    lower, upper = space.lower.copy(), space.upper.copy()
    lower[:d] = np.maximum(lower[:d], inputs.mean - _REACH * std)
    upper[:d] = np.minimum(upper[:d], inputs.mean + _REACH * std)
    upper[d:2 * d] = np.minimum(upper[d:2 * d], np.log(std))
    near = replace(problem, model=PolynomialModel(expansion, inputs.mean, std), knots=None)
    return (replace(near, direction=steepest_direction(inputs, centre_slopes(near, inputs)[1])),
            replace(space, lower=np.minimum(lower, vector), upper=np.maximum(upper, vector)))


def _bridged(basis: Basis, times: np.ndarray) -> np.ndarray:
    """Times (q, n) of the runs, s; where a few do not lock, what least squares on the others has in their place.

    Out in the tails of many inputs some run of hundreds does not lock: that must not cost a condition its polynomial.
    """
    hat, bridged = matrix_product(basis.at(basis.nodes), basis.projection), times.copy()
    for condition in np.flatnonzero(np.isnan(times).any(axis=0)):
        lost = np.isnan(times[:, condition])
        if lost.mean() <= _LOST:
            known = hat[lost][:, ~lost] @ times[~lost, condition]
            bridged[lost, condition] = np.linalg.solve(np.eye(len(known)) - hat[lost][:, lost], known)
    return bridged
