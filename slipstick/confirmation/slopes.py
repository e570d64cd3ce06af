"""Slopes of simulated engagements, kept in a fit for as long as they predict what the simulation gives."""

from dataclasses import dataclass, fields

import numpy as np

_CURVED = 0.01
"""Nats that a prediction by slopes may lack before they are simulated again. With a tenth of it, ten times it and 0,
the evidence of fits of the shipped recordings with their effect differs by less than 3 nats of 109,000, as with other
steps of the differences, and coefficients by less than a fifth of their errors; that of fits without the effect, which
is known to hundreds of nats, by less than 0.02 %. With 0, slopes take half as many simulations again."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of rows (n, K), `own` (n, q, K) in the parameters and `common` (n, p, K) in the coefficients.

    They are those at `points` (n, q) and coefficients `shared` (n, p), where the rows are `predicted` (n, K): each
    engagement may be known at other values.
    """

    points: np.ndarray
    shared: np.ndarray
    predicted: np.ndarray
    own: np.ndarray
    common: np.ndarray

    def miss(self, points: np.ndarray, shared: np.ndarray, predicted: np.ndarray, counted: np.ndarray) -> np.ndarray:
        """Engagements (n,) whose rows `predicted` (n, K) at other values the slopes do not predict where `counted`.

        What they lack, in standard deviations of the noise, is what a fit by them lacks of its log-likelihood.
        """
        left = predicted - self.predicted - np.einsum("nq,nqk->nk", points - self.points, self.own)
        left -= np.einsum("np,npk->nk", shared - self.shared, self.common)
        return np.asarray(0.5 * (left**2 * counted).sum(axis=1) > _CURVED)

    def renewed(self, rows: np.ndarray, its: "Slopes") -> "Slopes":
        """With those of `its` engagements in the place of `rows` (n,)."""
        found = []
        for one in fields(self):
            values = getattr(self, one.name).copy()
            values[rows] = getattr(its, one.name)
            found.append(values)
        return Slopes(*found)
