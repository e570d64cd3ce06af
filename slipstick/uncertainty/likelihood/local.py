"""Local approximation of a problem around one candidate, in which an expansion replaces the model.

A model without knots is neither perfectly smooth nor cheap. An expansion fitted to a few hundred runs, over a region
somewhat larger than the scatter of the inputs, is both, and suits gradient-based optimization. The direction of the
integration lines is fixed to that of the candidate: a change of direction would change the inputs at which the model is
evaluated, and thus make the likelihood discontinuous.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from slipstick.numerics.matrix_product import matrix_product
from slipstick.uncertainty.chaos.expansion import Basis, Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.likelihood import centre_slopes, steepest_direction
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

_ORDERS, _LOWEST_ORDER = {1: 10, 2: 8, 3: 6, 4: 5, 5: 5, 6: 4, 7: 4, 8: 3, 9: 3, 10: 3}, 2  # by the number of inputs
_WIDER = 1.3  # std of the region of the expansion, relative to the std of the candidate
_NARROWEST = 0.02  # smallest std of the region, in multiples of nominal
_REACH = 1.5  # largest distance of a mean from the centre of the region, in stds of the region
_LOST = 0.2  # largest fraction of runs of a condition that may not lock


@dataclass(frozen=True, eq=False)
class PolynomialModel:
    """A `ShiftingTimeModel` given by a Hermite `expansion` in (x - mean) / std, with `mean` and `std` (d,)."""

    expansion: Expansion
    mean: np.ndarray
    std: np.ndarray

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        """Times (m, n) in s at the points (m, d)."""
        return self.expansion.at((points - self.mean) / self.std)

    @property
    def error(self) -> float | None:
        """Leave-one-out RMS error in s over inputs and conditions; None if no condition has an expansion."""
        errors = self.expansion.error[~self.expansion.missing]
        return float(np.sqrt(np.mean(errors**2))) if errors.size else None

    def slopes(self, points: np.ndarray) -> np.ndarray:
        """Derivatives of the times with respect to the inputs at the points (m, d): shape (d, m, n), s."""
        values = self.expansion.basis.at((points - self.mean) / self.std)
        return np.array([matrix_product(values, coefficients) for coefficients in self._slope_coefficients])

    @cached_property
    def _slope_coefficients(self) -> np.ndarray:
        """Coefficients of the derivatives, shape (d, t, n); the derivative of H_n is sqrt(n) H_(n - 1)."""
        degrees, coefficients = self.expansion.basis.degrees, self.expansion.coefficients
        row_of = {tuple(term): row for row, term in enumerate(degrees.tolist())}
        slopes = np.zeros((len(self.mean), *coefficients.shape))
        for row, term in enumerate(degrees):
            for axis in np.flatnonzero(term):
                lower = row_of[tuple((term - np.eye(len(term), dtype=int)[axis]).tolist())]
                slopes[axis, lower] += np.sqrt(term[axis]) / self.std[axis] * coefficients[row]
        return slopes


def polynomial_problem(problem: InferenceProblem, space: Unknowns,
                       vector: np.ndarray) -> tuple[InferenceProblem, Unknowns]:
    """The problem with an expansion around a vector of unknowns (k,), and the part of `space` in which it is valid."""
    d = len(space.axes)
    inputs = space.candidate(vector).inputs
    std = np.maximum(_WIDER * inputs.marginal_std, _NARROWEST)
    region = Inputs(inputs.mean, std)
    basis = make_basis(region.germs, ExpansionSettings(_ORDERS.get(d, _LOWEST_ORDER), rule="regression"))
    expansion = expand(basis, _impute(basis, problem.model(region.at_germs(basis.nodes), problem.conditions)))
    lower, upper = space.lower.copy(), space.upper.copy()
    lower[:d] = np.maximum(lower[:d], inputs.mean - _REACH * std)
    upper[:d] = np.minimum(upper[:d], inputs.mean + _REACH * std)
    upper[d:2 * d] = np.minimum(upper[d:2 * d], np.log(std))
    local = replace(problem, model=PolynomialModel(expansion, inputs.mean, std), knots=None)
    return (replace(local, direction=steepest_direction(inputs, centre_slopes(local, inputs)[1])),
            replace(space, lower=np.minimum(lower, vector), upper=np.maximum(upper, vector)))


def _impute(basis: Basis, times: np.ndarray) -> np.ndarray:
    """Times (q, n) of the runs in s; NaN is replaced by the least-squares prediction from the other runs.

    With many inputs, one of several hundred runs may not lock. The condition would have no expansion otherwise.
    """
    hat, imputed = matrix_product(basis.at(basis.nodes), basis.projection), times.copy()
    for condition in np.flatnonzero(np.isnan(times).any(axis=0)):
        lost = np.isnan(times[:, condition])
        if lost.mean() <= _LOST:
            known = hat[lost][:, ~lost] @ times[~lost, condition]
            imputed[lost, condition] = np.linalg.solve(np.eye(len(known)) - hat[lost][:, lost], known)
    return imputed
