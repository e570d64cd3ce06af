"""A law as it was measured: its values with their uncertainty."""

from dataclasses import dataclass

import numpy as np

from slipstick.engine.bases import Kind, Variable
from slipstick.engine.fit import Fit
from slipstick.engine.recordings import Pair

DEVIATIONS = 1.96
"""Standard deviations on either side within which 95 % of a normal variable are."""


@dataclass(frozen=True, eq=False)
class Law:
    """The `change` (m,) in `unit` of the quantity of a `pair`, at `x` (m,) in `on_unit`, with its `covariance` (m, m).

    Of a "curve", an "own" variable or a law "between" runs, x are values of the variable, between which the law is
    linear. Of "lags" and of the "past" of a signal, they are widths of plays, and dead times and time constants in
    samples of `period` s; the changes are their weights. A law is known up to so many flat forms (nothing, a constant,
    a line) that parameters replace: of these, it has none. A `relative` one is a share of the quantity, without a unit.
    """

    pair: Pair
    kind: Kind
    unit: str
    on_unit: str
    x: np.ndarray
    change: np.ndarray
    covariance: np.ndarray
    known_up_to: int
    jumps: bool = False
    period: float = 1.0
    relative: bool = False

    @property
    def std(self) -> np.ndarray:
        """Standard errors (m,) of the changes."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def variable(self, step: float) -> Variable:
        """Return what the law depends on, without values, at instants with a `step` in s."""
        return Variable(self.pair[1], self.on_unit, self.kind, self.x, jumps=self.jumps, fine=self.period / step)

    def at(self, x: np.ndarray) -> np.ndarray:
        """Return the changes at x, constant beyond the outermost values."""
        return np.asarray(np.interp(x, self.x, self.change))


def measure(fit: Fit, pair: Pair) -> Law:
    """Return a law of a fit as it was measured."""
    law = fit.laws[pair]
    first = fit.products.first + sum(each.count for each in list(fit.laws.values())[:list(fit.laws).index(pair)])
    places = np.arange(first, first + law.count)
    onto = law.size * fit.turn[places, :-1]
    variable = law.variable
    return Law(pair, variable.kind, "" if law.quantity.relative else law.quantity.unit, variable.unit, variable.knots,
               onto @ fit.fitted.coefficients, onto @ fit.fitted.covariance @ onto.T, fit.priors[pair].known_up_to,
               variable.jumps, fit.recorded.runs.step, law.quantity.relative)
