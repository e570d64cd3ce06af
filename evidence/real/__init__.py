"""Real recordings of machines that others measured and published: what the engine says of them, beside what is known.

    python -m evidence real FOLDER [MACHINE ...]

FOLDER has one folder for each machine, as its module says. The recordings are not part of this repository. A module has

    read(folder) -> dict[str, Recorded]            the recordings by variant: of a kind, or with another declaration
    compare(variant, answer) -> Iterator[Row]      values beside those that are published
    draw(answers) -> bytes                         picture of the page, as SVG, from the answers by variant; optional
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.engine.fit import Fit
from slipstick.engine.recordings import Pair
from slipstick.engine.study import estimate_parameters
from slipstick.numerics.piecewise import hats


@dataclass(frozen=True)
class Row:
    """A `value` with its standard `error`, in `unit`, beside the `published` value, each where there is one."""

    what: str
    value: float
    error: float | None = None
    unit: str = ""
    published: float | None = None


def compare_parameters(fit: Fit, known: Mapping[str, tuple[str, float]]) -> Iterator[Row]:
    """Yield the parameters of a fit for which a unit and a published value are known, by name."""
    for each in estimate_parameters(fit):
        if each.name in known:
            unit, published = known[each.name]
            yield Row(each.name, each.mean, each.error, unit, published)


def sum_terms(fit: Fit, pair: Pair, x: np.ndarray, factors: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return a law at x (m,), if the fit has it, plus parameters by name times factors (m,), and its standard errors.

    What parameters and law share is uncertain in either, and not in their sum.
    """
    terms, count = [term.name for term in (*fit.recorded.random, *fit.recorded.shared)], len(fit.turn) - 1
    value, slopes = np.zeros(len(x)), np.zeros((len(x), count))
    for each in estimate_parameters(fit):
        if each.name in factors:
            place = terms.index(each.name)
            term = (*fit.recorded.random, *fit.recorded.shared)[place]
            value += each.mean * factors[each.name]
            slopes[:, place] += (each.mean if term.is_factor else term.size) * factors[each.name]
    if pair in fit.laws:
        law, first = fit.laws[pair], fit.products.first
        for other in list(fit.laws)[:list(fit.laws).index(pair)]:
            first += fit.laws[other].count
        weights = law.size * hats(x[None], law.variable.knots)[0].T
        slopes[:, first:first + law.count] += weights
        value += weights @ (fit.turn[first:first + law.count, :-1] @ fit.fitted.coefficients)
    slopes = slopes @ fit.turn[:-1, :-1]
    return value, np.sqrt(np.einsum("mi,ij,mj->m", slopes, fit.fitted.covariance, slopes))
