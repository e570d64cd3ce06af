"""A problem near one candidate, where polynomials stand for the model.

A model without knots is neither smooth to the last digit nor cheap. Around a candidate, over somewhat more than the
scatter of its inputs, polynomials fitted to a few hundred runs are both, and can be climbed along gradients.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipstick.uncertainty.expansion import Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood import Problem
from slipstick.uncertainty.unknowns import Unknowns

_ORDERS, _LOWEST_ORDER = {1: 10, 2: 8, 3: 6, 4: 5, 5: 5}, 4  # by the number of inputs
_WIDER = 1.3  # the region of the polynomials against the scatter of the candidate
_NARROWEST = 0.02  # std of that region in multiples of nominal
_REACH = 1.5  # stds of the region by which a mean may move within it


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A model (uncertainty.likelihood.Model) by the polynomials of an expansion about `mean`, scaled by `std` (d,)."""

    expansion: Expansion
    mean: np.ndarray
    std: np.ndarray

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        """Times (m, n) in s at the points (m, d)."""
        return self.expansion.at((points - self.mean) / self.std)


def localised(problem: Problem, space: Unknowns, vector: np.ndarray) -> tuple[Problem, Unknowns]:
    """The problem with polynomials about a vector of unknowns (k,), and the part of `space` they hold in."""
    d = len(space.axes)
    inputs = space.candidate(vector).inputs
    std = np.maximum(_WIDER * inputs.marginal_std, _NARROWEST)
    region = Inputs(inputs.mean, std)
    terms = make_basis(region.germs, ExpansionSettings(_ORDERS.get(d, _LOWEST_ORDER), rule="regression"))
    expansion = expand(terms, problem.model(region.at_germs(terms.nodes), problem.conditions))
    lower, upper = space.lower.copy(), space.upper.copy()
    lower[:d] = np.maximum(lower[:d], inputs.mean - _REACH * std)
    upper[:d] = np.minimum(upper[:d], inputs.mean + _REACH * std)
    upper[d:2 * d] = np.minimum(upper[d:2 * d], np.log(std))
    return (replace(problem, model=Polynomial(expansion, inputs.mean, std)),
            replace(space, lower=np.minimum(lower, vector), upper=np.maximum(upper, vector)))
