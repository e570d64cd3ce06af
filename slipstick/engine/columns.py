"""The columns of all parts, with those of coefficients that runs share corrected for the scatter between runs.

A fit linearizes each run about its own parameters (Lindstrom and Bates, Biometrics 46, 673, 1990). A coefficient that
runs share makes up for a change of the parameters of a run, and where equations are not linear, for another change in
each run. With it the scatter of parameters would become smaller or larger, which the linear model counts as a gain: it
leaves out that columns change as well, so that the same signals are as likely as before (the Jacobian of signals and
parameters). So a coefficient makes up for the same change in all runs: that in a run at the means of the parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.engine.laws import Candidate
from slipstick.engine.model import State
from slipstick.engine.part_fit import PartFit, fit_part
from slipstick.engine.products import Products, assemble, expand, list_shared
from slipstick.engine.recordings import Pair, Recorded


@dataclass(frozen=True, eq=False)
class Columns:
    """The linear `models` of all parts; `shift` (n, q, f) of a run's q random columns is added to the column of each of
    the f coefficients that runs share."""

    models: Mapping[str, PartFit]
    shift: np.ndarray

    def release(self) -> "Columns":
        """Return what is left where no step follows."""
        return replace(self, models={name: model.release() for name, model in self.models.items()})

    def move(self, state: State) -> "Columns":
        """Return the same columns with the residuals at another state."""
        return replace(self, models={name: model.move(state) for name, model in self.models.items()})

    def take(self, rows: np.ndarray, recorded: Recorded, laws: Mapping[Pair, Candidate]) -> "Columns":
        """Return the columns of the runs `rows`, which are `recorded` with these laws."""
        return Columns({name: model.take(rows, recorded, laws) for name, model in self.models.items()},
                       self.shift[rows])

    def assemble(self, recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> Products:
        """Return the products of all parts."""
        products = assemble(recorded, self.models, laws, state)
        if not self.shift.any():
            return products
        turn = self._turn(laws, state)
        return replace(products, values=turn.transpose(0, 2, 1) @ products.values @ turn)

    def expand(self, recorded: Recorded, name: str, laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
        """Return the map (n, r + 1, c) from all coefficients, and 1 for the residual at 0, to the rows of a part."""
        return np.asarray(expand(recorded, self.models[name], laws, state) @ self._turn(laws, state))

    def _turn(self, laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
        """Return the map (n, c, c) from coefficients to those of the columns of the models."""
        n, random, shared = self.shift.shape
        turn = np.tile(np.eye(random + shared + 1), (n, 1, 1))
        turn[:, :random, random:-1] = self.shift
        turn[:, :random, -1] = self.shift @ list_shared(laws, state)
        return turn


def fit_columns(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> Columns:
    """Return the columns of all parts at a state."""
    models = {part.name: fit_part(recorded, part, state, laws) for part in recorded.parts}
    random, shared = state.points.shape[1], len(list_shared(laws, state))
    shift = np.zeros((len(recorded), random, shared))
    if shift.size and (state.points != state.means).any():
        middle = replace(state, points=np.tile(state.means, (len(recorded), 1)))
        there = {part.name: fit_part(recorded, part, middle, laws, holds=False) for part in recorded.parts}
        shift = _project(recorded, there, laws, middle) - _project(recorded, models, laws, state)
        shift[~np.isfinite(shift).all(axis=(1, 2))] = 0.0  # equations may diverge at the means alone
    return Columns(models, shift)


def _project(recorded: Recorded, models: Mapping[str, PartFit], laws: Mapping[Pair, Candidate],
             state: State) -> np.ndarray:
    """Return for how much (n, q, f) of each random term of a run each coefficient that runs share makes up."""
    random = len(recorded.random)
    products = assemble(recorded, models, laws, state).values[:, :random, :-1]
    precision = np.diag(1 / recorded.widest**2)
    is_finite = np.isfinite(products).all(axis=(1, 2))
    products = products[is_finite]
    projected = np.full((len(recorded), random, products.shape[2] - random), np.nan)
    # Where equations nearly diverge, all columns are the same to the last digit, and their products have no inverse.
    projected[is_finite] = np.linalg.pinv(products[:, :, :random] + precision, hermitian=True) @ products[:, :, random:]
    return projected


def join_columns(groups: Sequence[Columns], terms: Sequence[int]) -> Columns:
    """Return the columns of groups of parts as those of all.

    The groups have so many shared `terms`, whose coefficients come before those of all laws.
    """
    models = {name: model for each in groups for name, model in each.models.items()}
    count = [each.shift.shape[2] for each in groups]
    ends = np.cumsum([0, *(each.shift.shape[1] for each in groups)])
    shift = np.zeros((len(groups[0].shift), ends[-1], sum(count)))
    shared = np.split(np.arange(sum(terms)), np.cumsum(terms)[:-1])
    laws = np.split(np.arange(sum(terms), sum(count)), np.cumsum(np.subtract(count, terms))[:-1])
    for each, first, last, *own in zip(groups, ends[:-1], ends[1:], shared, laws, strict=True):
        shift[:, first:last, np.concatenate(own)] = each.shift
    return Columns(models, shift)
