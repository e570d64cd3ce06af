"""Where fits of the simulation begin: coefficients that suit given parameters, or those of the linear mixed model."""

import numpy as np

from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.terms import Terms
from slipstick.engine.linear_model import Gram
from slipstick.naming.curved import CurvedFit
from slipstick.naming.linear_model import columns_of, gram_of

_MULTIPLES = (-3.0, -1.0, -0.3, 0.0, 0.1, 0.3, 1.0, 3.0)
"""Of the typical value of an amplitude, from which the best one starts the fit."""
_STEP = 1e-3
"""Step of the derivative with respect to a term, over its typical coefficients."""
_LINEAR = 0.1
"""Share of a change up to which derivatives are believed: next to lock-up speeds are far from linear in parameters."""


def search_start(block: SimulatedBench, points: np.ndarray,
                 taken: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (n, q) that differ between engagements as `points` do, and shared values (p + c,) that suit them.

    Coefficients are over their spans: for one term after the other the multiple of its typical values that fits.
    The mean of the parameters gives back what it has `taken` (q, t) of each term: laws of blocks are known up to a
    constant, which parameters have.
    """
    shared = block.neutral
    taken = np.zeros((len(block.random), len(block.terms.names))) if taken is None else taken
    for place, term in enumerate(block.terms.names):
        tried = []
        for multiple in _MULTIPLES:
            moved, shifted = shared + _typical(block, term, multiple), points - multiple * taken[:, place]
            # The median does not mind a few engagements that no start suits.
            each = (((block.measured - block.at(moved).base(shifted)) * block.counted) ** 2).sum(axis=1)
            tried.append((float(np.median(each)), moved, shifted))
        _, shared, points = min(tried, key=lambda trial: trial[0])
    return points, shared


class About:
    """The linear mixed model about a fit of the simulation, to which columns can be added."""

    def __init__(self, block: SimulatedBench, fitted: CurvedFit) -> None:
        """Compute the columns of the parameters and of the coefficients."""
        self.block, self.fitted = block, fitted
        self.columns = columns_of(block.at(fitted.shared), fitted.points, fitted.shared, (), fitted.predicted, ())

    def beside(self, columns: np.ndarray) -> Gram:
        """The products with further `columns` (n, m, K)."""
        own = self.columns
        return gram_of(self.block, [*own.each, columns], own.z, self.fitted.noise, columns.shape[1])

    def column(self, terms: Terms, term: str) -> np.ndarray:
        """The derivative (n, K) with respect to one of `terms` that the fit does not have, over its typical size.

        By a small step: what a parameter has taken of an effect is not in a large one, which is not linear.
        """
        other = SimulatedBench(self.block.traces, terms, self.block.widest)
        moved = shared_of(self.block, self.fitted.shared, other) + _typical(other, term, _STEP)
        return np.asarray((other.rows_at(self.fitted.points[None], moved)[0] - self.fitted.predicted) / _STEP)

    def taken(self, terms: Terms) -> np.ndarray:
        """What parameters (n, q) can make good of each of `terms` that the fit does not have, (n, q, t).

        At its typical coefficients, up to a tenth of what it changes, with the least change of the parameters in units
        of their scatter.
        """
        columns = [self.column(terms, term) for term in self._new(terms)]
        products = self.beside(np.stack(columns, axis=1)).products
        q, new, std = self.columns.own.shape[1], slice(-1 - len(columns), -1), np.sqrt(self.fitted.variance)
        own, onto = products[:, :q, :q] * np.outer(std, std), products[:, :q, new] * std[:, None]
        off = np.maximum(_LINEAR**2 * np.einsum("ntt->nt", products[:, new, new]), 1.0)
        changes = [np.linalg.solve(own + off[:, t, None, None] * np.eye(q), onto[:, :, t:t + 1])
                   for t in range(len(columns))]
        return np.asarray(std[:, None] * np.concatenate(changes, axis=2))

    def _new(self, terms: Terms) -> list[str]:
        """Those of `terms` that the fit does not have."""
        return [term for term in terms.names if term not in self.block.terms.names]


def shared_of(block: SimulatedBench, shared: np.ndarray, other: SimulatedBench) -> np.ndarray:
    """Shared values (p + c,) of the `other` block: those of a `block` with `shared` values, or neutral ones."""
    values = dict(zip(block.fixed, shared, strict=True))
    return np.array([values.get(name, 0.0) for name in other.fixed])


def _typical(block: SimulatedBench, term: str, multiple: float = 1.0) -> np.ndarray:
    """A multiple of the typical coefficients of a term within their bounds, and 0 for all others (p + c,)."""
    typical = np.zeros(len(block.fixed))
    typical[block.coefficients] = [
        (np.clip(unknown.neutral + multiple * (unknown.typical - unknown.neutral), unknown.lower, unknown.upper)
         - unknown.neutral) / unknown.span if unknown.term == term else 0.0 for unknown in block.terms.unknowns]
    return typical
