"""Products of the whitened columns of all runs and parts: what the linear mixed model is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import Gram
from slipstick.engine.model import State, key_of_law, key_of_term, touches
from slipstick.engine.part_fit import PartFit
from slipstick.engine.recordings import Pair, Recorded

_BEYOND = 3.0
"""Scatter between runs that is possible, over the largest that is declared: what exceeds the declared one must show in
the parameter, and not as a law."""


@dataclass(frozen=True, eq=False)
class Products:
    """Products (n, c, c) of the columns of all runs: random, shared, then each of the `laws`, and the residual last.

    Coefficients of laws are raw. The residual is that of the model at 0.
    """

    recorded: Recorded
    values: np.ndarray
    sizes: tuple[int, ...]

    @property
    def first(self) -> int:
        """The place of the first coefficient of a law."""
        return len(self.recorded.random) + len(self.recorded.shared)

    def gram(self, roots: Sequence[np.ndarray]) -> tuple[Gram, np.ndarray]:
        """Return the linear mixed model with these roots (m, r) of the laws' priors, and the map (c, c') to raw
        ones."""
        random, shared = self.recorded.random, self.recorded.shared
        precision = 1 / np.array([term.std for term in (*random, *shared)]) ** 2
        target = np.array([term.target for term in (*random, *shared)])
        turn = scipy.linalg.block_diag(np.eye(len(precision)), *roots, np.ones((1, 1)))
        free = turn.shape[1] - 1 - len(precision)
        products = self._turn(self._turn(self.values, roots).transpose(0, 2, 1), roots)
        return Gram(products, len(random), np.append(precision, np.ones(free)), np.append(target, np.zeros(free)),
                    _BEYOND * self.recorded.widest), turn

    def _turn(self, values: np.ndarray, roots: Sequence[np.ndarray]) -> np.ndarray:
        """Return products (n, c, c) with roots in the place of the raw coefficients of laws in the last axis."""
        if not roots:
            return values
        ends = self.first + np.cumsum([0, *self.sizes])
        laws = [values[..., first:last] @ root for first, last, root in zip(ends[:-1], ends[1:], roots, strict=True)]
        return np.concatenate([values[..., :self.first], *laws, values[..., -1:]], axis=-1)

    def places(self, number: int, roots: Sequence[np.ndarray]) -> np.ndarray:
        """Return the places of a law's coefficients in the model with these roots."""
        first = self.first + sum(root.shape[1] for root in roots[:number])
        return np.arange(first, first + roots[number].shape[1])

    def join(self, cross: np.ndarray, own: np.ndarray) -> "Products":
        """Return the products with a further law: `cross` (n, m, c) with all columns, and `own` (n, m, m)."""
        n, m, c = cross.shape
        joined = np.empty((n, c + m, c + m))
        joined[:, :c - 1, :c - 1] = self.values[:, :-1, :-1]
        joined[:, :c - 1, -1] = joined[:, -1, :c - 1] = self.values[:, :-1, -1]
        joined[:, -1, -1] = self.values[:, -1, -1]
        rows = slice(c - 1, c - 1 + m)
        joined[:, rows, :c - 1] = cross[:, :, :-1]
        joined[:, :c - 1, rows] = cross[:, :, :-1].transpose(0, 2, 1)
        joined[:, rows, -1] = joined[:, -1, rows] = cross[:, :, -1]
        joined[:, rows, rows] = own
        return Products(self.recorded, joined, (*self.sizes, m))


def assemble(recorded: Recorded, models: Mapping[str, PartFit], laws: Mapping[Pair, Candidate],
             state: State) -> Products:
    """Return the products of all parts."""
    sizes = tuple(law.count for law in laws.values())
    count = len(recorded.random) + len(recorded.shared) + sum(sizes) + 1
    total = np.zeros((len(recorded), count, count))
    values = _list_values(recorded, laws, state)
    for model in models.values():
        rows, factors = _locate(recorded, model, laws)
        at_zero = _at_zero(model, rows, factors, values)
        against = (model.gram @ at_zero[:, :, None])[..., 0]
        total[:, :-1, :-1] += model.gram[:, rows[:, None], rows] * factors[:, :, None] * factors[:, None, :]
        total[:, :-1, -1] += factors * against[:, rows]
        total[:, -1, -1] += (at_zero * against).sum(axis=1)
    total[:, -1, :-1] = total[:, :-1, -1]
    return Products(recorded, total, sizes)


def expand(recorded: Recorded, model: PartFit, laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
    """Return the map (n, r + 1, c) from all coefficients, and 1 for the residual at 0, to the rows of a part."""
    rows, factors = _locate(recorded, model, laws)
    onto = np.zeros((len(recorded), model.gram.shape[1], len(rows) + 1))
    onto[:, rows, np.arange(len(rows))] = factors
    onto[:, :, -1] = _at_zero(model, rows, factors, _list_values(recorded, laws, state))
    return onto


def _locate(recorded: Recorded, model: PartFit, laws: Mapping[Pair, Candidate]) -> tuple[np.ndarray, np.ndarray]:
    """Return the row (c - 1,) of a part to which each coefficient belongs, and its factors (n, c - 1): 0 of another."""
    rows, factors = list[np.ndarray](), list[np.ndarray]()
    for term in recorded.terms:
        is_here = touches(term, model.part)
        rows.append(np.array([model.keys.index(key_of_term(term)) if is_here else 0]))
        factors.append(term.values[:, None] * is_here)
    for pair, law in laws.items():
        factor = np.zeros((len(recorded), law.count))
        row = np.zeros(law.count, int)
        if pair in model.places:
            row, factor = np.arange(model.places[pair].start, model.places[pair].stop), factor + 1.0
        elif model.part.name in law.variables:
            row = row + model.keys.index(key_of_law(law, model.part))
            factor = factor + law.size * law.variables[model.part.name].basis()[:, :, 0]
        rows.append(row)
        factors.append(factor)
    return np.concatenate(rows), np.concatenate(factors, axis=1)


def _list_values(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
    """Return the coefficients (n, c - 1) of each run at a state."""
    shared = list_shared(laws, state)
    return np.concatenate([state.points, np.broadcast_to(shared, (len(recorded), len(shared)))], axis=1)


def list_shared(laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
    """Return the coefficients (f,) at a state that all runs share: those of shared terms, and of laws."""
    return np.concatenate([state.shared, *(state.laws[pair] for pair in laws)])


def _at_zero(model: PartFit, rows: np.ndarray, factors: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the rows (n, r + 1) that make the residual at coefficients of 0."""
    out = np.zeros(model.gram.shape[:2])
    for row, change in zip(rows, (factors * values).T, strict=True):
        out[:, row] += change
    out[:, -1] += 1.0
    return out
