"""The experiments linearised about a point: all that a fit, a score or a held-out test needs, in small matrices.

Of each experiment the N values enter only through the products of its residual and its Jacobian's columns, summed
over a channel: matrices of (p + 1) x (p + 1), whatever N is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.clutch import effects, ensemble
from slipstick.clutch.laws import MeasuredLaw
from slipstick.study.comparison import Comparison
from slipstick.study.design import Design

_AT_ONCE = 1000
"""Engagements simulated before their samples are averaged: those of all would take gigabytes."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """`gram` (channels, n, p + 1, p + 1): products of the p columns of the Jacobian and, last, of the residual.

    Both in units of the noise; the residual is measured - simulated. `residuals` (n, N) are in the channels' units.
    """

    gram: np.ndarray
    residuals: np.ndarray

    def weighted(self, noise: np.ndarray) -> np.ndarray:
        """Summed over the channels, (n, p + 1, p + 1), where `noise` (channels,) is a variance over the sensor's."""
        return np.asarray(np.einsum("cnpr,c->npr", self.gram, 1 / noise))


@dataclass(frozen=True)
class Probe:
    """A first move of one coefficient of an effect away from neutral, by `step` of its `typical` value on the bench.

    `shape` gives the effect's shape coefficients the values at which it is tried.
    """

    effect: str
    coefficient: str
    typical: float
    step: float
    shape: tuple[tuple[str, float], ...] = ()

    def moved(self, coefficients: np.ndarray) -> np.ndarray:
        """Effect coefficients (n, c) after the move."""
        moved = coefficients.copy()
        for name, value in self.shape:
            moved[:, effects.index(self.effect, name)] = value
        place = effects.index(self.effect, self.coefficient)
        moved[:, place] += self.step * self.typical
        return moved


def predict(comparison: Comparison, vectors: np.ndarray, coefficients: np.ndarray,
            laws: Sequence[MeasuredLaw] = ()) -> np.ndarray:
    """Simulate s x n engagements, experiment after experiment in each of the s rows: (s, n, N) in the channels' units.

    `vectors` (s, n, 20), `coefficients` (s, n, c).
    """
    (s, n), found = vectors.shape[:2], []
    rows = max(1, _AT_ONCE // n)
    for first in range(0, s, rows):
        some = slice(first, min(s, first + rows))
        m = some.stop - first
        conditions = comparison.recordings.conditions.take(np.tile(np.arange(n), m))
        flat, acting = (one[some].reshape(m * n, -1) for one in (vectors, coefficients))
        response = ensemble.simulate(comparison.bench.physics.curves, flat, acting, conditions, comparison.times,
                                     paired=True, laws=laws)
        found.append(comparison.predicted(response).reshape(m, n, -1))
    return np.concatenate(found)


def predict_at(comparison: Comparison, design: Design, points: np.ndarray) -> np.ndarray:
    """As `predict`, at points (s, n, p) of the design."""
    s, n, p = points.shape
    vectors, coefficients = design.vectors(points.reshape(s * n, p))
    return predict(comparison, vectors.reshape(s, n, -1), coefficients.reshape(s, n, -1), design.laws)


def linearise(comparison: Comparison, design: Design, point: np.ndarray, probes: Sequence[Probe] = (),
              columns: Sequence[int] | None = None) -> Linearised:
    """Linearise about `point` (n, p), one row an experiment: one-sided differences, inwards at an upper bound.

    A scattering parameter is moved to either side, as far as an experiment leaves it open: what it does to the model
    there counts, and not at the point, where kinks (contact, lock-up) would make the determinant rough. The columns of
    `probes` come after those of the design, of which `columns` may name some; all by default.
    """
    n, p = point.shape
    unknowns = design.unknowns
    chosen = list(range(p)) if columns is None else list(columns)
    both = [place for place in chosen if unknowns[place].both]
    upper, steps = (np.array([getattr(one, name) for one in unknowns]) for name in ("upper", "step"))
    shifts = np.where(point + steps > upper, -steps, steps).T
    points = np.tile(point, (len(both) + len(chosen) + 1, 1, 1))
    for row, column in enumerate(both):
        points[row, :, column] -= shifts[column]
    for row, column in enumerate(chosen, len(both)):
        points[row, :, column] += shifts[column]
    vectors, coefficients = design.vectors(points.reshape(-1, p))
    vectors, coefficients = (one.reshape(len(points), n, -1) for one in (vectors, coefficients))
    if probes:
        probed = np.array([one.moved(coefficients[-1]) for one in probes])
        coefficients = np.concatenate([probed, coefficients])
        vectors = np.concatenate([np.tile(vectors[-1], (len(probes), 1, 1)), vectors])
    predicted = predict(comparison, vectors, coefficients, design.laws)
    probed, backward, (*forward, base) = np.split(predicted, [len(probes), len(probes) + len(both)])
    behind = dict(zip(both, backward, strict=True))
    slopes = [(ahead - behind.get(column, base)) / (shifts[column] * (2 if column in behind else 1))[:, None]
              for column, ahead in zip(chosen, forward, strict=True)]
    slopes += [(its - base) / one.step for one, its in zip(probes, probed, strict=True)]
    # A move that blows an engagement up says nothing of it.
    return assemble(comparison, np.nan_to_num(np.array(slopes)), comparison.measured - base)


def assemble(comparison: Comparison, slopes: np.ndarray, residuals: np.ndarray) -> Linearised:
    """From the Jacobian's columns (p, n, N) and the residuals (n, N), in the channels' units."""
    weights = (comparison.weights / comparison.scale)[:, None]
    rows = np.concatenate([slopes, residuals[None]]).transpose(1, 0, 2) * weights
    gram = [rows[:, :, columns] @ rows[:, :, columns].transpose(0, 2, 1) for columns in comparison.channels.values()]
    return Linearised(np.array(gram), residuals)
