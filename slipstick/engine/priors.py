"""Priors of laws: amplitude and smoothness of the largest marginal likelihood, beside the terms and the other laws."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.engine.bases import WALKS, flat_forms, form_root, smooth_root
from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import Gram, marginalise
from slipstick.engine.products import Products
from slipstick.engine.recordings import Pair

AMPLITUDES = np.geomspace(1e-4, 10, 101)
"""Grid of the amplitude of a law, in units of its size."""
_INDEPENDENT = 0.01
"""Share of the information on a flat form below which it is replaced by other terms."""


@dataclass(frozen=True)
class Prior:
    """Amplitude of a law, in units of its size, and standard deviation of its walk over that of its line.

    The law is known up to so many flat forms, which parameters replace: nothing, a constant, or a line. A prior with a
    `length`, in knots, is that of a smooth curve, and one with a `form` (m, r) is a combination of its columns; neither
    changes.
    """

    amplitude: float = 0.0
    walk: float = 0.0
    known_up_to: int = 0
    length: float = 0.0
    form: np.ndarray | None = None

    @property
    def is_kept(self) -> bool:
        """Whether the prior is not estimated."""
        return bool(self.length) or self.form is not None

    def root(self, law: Candidate) -> np.ndarray:
        """Return L (m, r) with L L' the covariance of the m coefficients of a law."""
        if self.form is not None:
            return self.amplitude * self.form
        if self.length:
            return self.amplitude * smooth_root(law.count, self.length)
        return self.amplitude * form_root(law.variable.families, self.walk, self.known_up_to)


def adapt_priors(products: Products, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior],
                 variance: np.ndarray) -> dict[Pair, Prior]:
    """Return the priors with amplitude and smoothness of each law of the largest evidence, beside the others."""
    adapted = dict(priors)
    for number, (pair, law) in enumerate(laws.items()):
        if not adapted[pair].is_kept:
            roots = [np.eye(law.count) if other == pair else adapted[other].root(each)
                     for other, each in laws.items()]
            gram, _ = products.gram(roots)
            adapted[pair] = choose_prior(gram, law, products.places(number, roots), variance,
                                         adapted[pair].known_up_to)[1]
    return adapted


def count_replaced(gram: Gram, law: Candidate, places: np.ndarray) -> int:
    """Return up to how many flat forms a law with raw coefficients at `places` of a model is known: those that all
    others replace, terms and laws.

    A form is replaced where these, with their priors, leave less than `_INDEPENDENT` of its information. Beside a law
    A, a parameter is multiplied by 1 + A, so that the constant of another law would replace A.
    """
    if len(places) > sum(law.variable.families[:1]):
        return 0
    total, others = gram.products.sum(axis=0), np.setdiff1d(np.arange(len(gram.precision)), places)
    inner = total[np.ix_(others, others)] + np.diag(gram.precision[others])
    forms = flat_forms(len(places))
    for number, form in enumerate(forms.T):
        # A line is replaced beside the constant, which is among the others then.
        cross, whole = total[np.ix_(others, places)] @ form, float(form @ total[np.ix_(places, places)] @ form)
        if whole - cross @ np.linalg.solve(inner, cross) > _INDEPENDENT * whole:
            return number
    return int(forms.shape[1])


def choose_prior(gram: Gram, law: Candidate, places: np.ndarray, variance: np.ndarray,
                 known_up_to: int = 0) -> tuple[float, Prior]:
    """Return the gain in evidence and the prior of a law whose raw coefficients have these `places` in a model."""
    marginal = marginalise(gram, variance)[0].sum(axis=0)
    others = np.setdiff1d(np.arange(len(gram.precision)), places)
    inner = marginal[np.ix_(others, others)] + np.diag(gram.precision[others])
    solved = np.linalg.solve(inner, np.column_stack([
        marginal[others, -1] + gram.precision[others] * gram.target[others], marginal[np.ix_(others, places)]]))
    pull = marginal[places, -1] - marginal[np.ix_(places, others)] @ solved[:, 0]
    information = marginal[np.ix_(places, places)] - marginal[np.ix_(places, others)] @ solved[:, 1:]
    best = 0.0, Prior(float(AMPLITUDES[0]), known_up_to=known_up_to)
    for walk in WALKS if len(places) > 2 else WALKS[:1]:
        root = form_root(law.variable.families, walk, known_up_to)
        if not root.shape[1]:
            continue
        values, axes = np.linalg.eigh(root.T @ information @ root)
        # Information is not negative but for rounding, which leaves no more of the pull than of it.
        along = np.where(values > -values[0], (axes.T @ (root.T @ pull)) ** 2, 0.0)
        square = AMPLITUDES[:, None] ** 2
        spread = square * np.maximum(values, 0)
        gain = 0.5 * (square * along / (1 + spread) - np.log1p(spread)).sum(axis=1)
        place = int(np.argmax(gain))
        if gain[place] > best[0]:
            best = float(gain[place]), Prior(float(AMPLITUDES[place]), walk, known_up_to)
    return best
