"""Effects by kind: what a measured law is in words, with coefficients and their intervals.

A kind is a form with few coefficients over what the law depends on, and at most one shape, such as a threshold, a
period or the width of a play. It takes the place of the law in a fit, in which all parameters are estimated anew, so
that its evidence compares with that of the law: a law that no kind explains as well stays a measured one.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipstick.engine.bases import DELAYS, TIMES, WIDTHS, flat_forms
from slipstick.engine.fit import Fit, Prior
from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import restricted_likelihood
from slipstick.engine.recordings import Pair
from slipstick.machine.kinds import KINDS

_WIDE = 3.0
"""Prior standard deviation of a coefficient, over that with which its form alone is as large as the law."""
_MOST = 3
"""Kinds that are fitted."""
_FLAT = 1e-6
"""Largest value of a column of which flat forms leave nothing."""
_DEVIATIONS = 1.96
"""Standard deviations on either side within which 95 % of a normal variable are."""


@dataclass(frozen=True)
class Coefficient:
    """A `value` with its 95 % interval, in a unit. That of a shape lies between values that were compared."""

    name: str
    value: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class KindOfLaw:
    """The kind that explains a law best: its `coefficients`, with its shape, and `nats` of evidence beyond the law."""

    pair: Pair
    name: str
    coefficients: tuple[Coefficient, ...]
    nats: float


def find_kind(fit: Fit, pair: Pair) -> KindOfLaw | None:
    """Return the kind of a law in a fit, or None where the law has more evidence than each.

    A kind has fewer coefficients than the law, so that it gains where it is right. Kinds are compared in the linear
    model about the fit, with the best shape of each; the best ones are fitted.
    """
    law, reach = fit.laws[pair], _WIDE * max(float(np.abs(fit.state.laws[pair]).max()), 1e-12)
    weighed = [(_weigh(fit, pair, form, reach), form) for form in _list_forms(law, fit.priors[pair].known_up_to)]
    weighed.sort(key=lambda each: -each[0])
    best = dict[str, _Form]()
    for _, form in weighed:
        best.setdefault(form.kind, form)
    tried = [(_fit_form(fit, pair, form, reach), form) for form in [*best.values()][:_MOST]]
    if not tried:
        return None
    fitted, form = max(tried, key=lambda each: each[0].evidence)
    if fitted.evidence < fit.evidence:
        return None
    places = fitted.products.places(list(fitted.laws).index(pair), fitted.roots)
    values = law.size * reach * form.sizes * fitted.fitted.coefficients[places]
    errors = _DEVIATIONS * law.size * reach * form.sizes * np.sqrt(np.diag(fitted.fitted.covariance)[places])
    coefficients = [
        Coefficient(name, float(value), float(value - error), float(value + error), _unit_of(law, degree))
        for name, degree, value, error in zip(form.names, form.degrees, values, errors, strict=True)]
    if form.shape_name:
        least = next(nats for nats, each in weighed if each is form) - 0.5 * _DEVIATIONS**2
        near = sorted((each.shape, nats > least) for nats, each in weighed if each.kind == form.kind)
        within = [place for place, (_, is_near) in enumerate(near) if is_near]
        low, high = near[max(within[0] - 1, 0)][0], near[min(within[-1] + 1, len(near) - 1)][0]
        coefficients.append(Coefficient(form.shape_name, form.shape, low, high,
                                        "samples" if form.shape_name == "time" else law.variable.unit))
    return KindOfLaw(pair, form.kind, tuple(coefficients), fitted.evidence - fit.evidence)


@dataclass(frozen=True, eq=False)
class _Form:
    """A kind at a `shape`: its columns (m, r), each multiplied by its `sizes` (r,), so that its largest value is 1."""

    kind: str
    names: tuple[str, ...]
    degrees: tuple[int, ...]
    shape_name: str
    shape: float
    columns: np.ndarray
    sizes: np.ndarray


def _list_forms(law: Candidate, known_up_to: int) -> Iterator[_Form]:
    """Yield all forms that a law may have, without the flat forms that parameters replace."""
    x, dependence = law.variable.knots, law.variable.kind
    if dependence in ("past", "lags"):
        others = len(WIDTHS) if dependence == "past" else len(DELAYS)
        for place in range(others + len(TIMES)):
            name, shape_name = (("first-order lag", "time") if place >= others else
                                ("play", "half width") if dependence == "past" else ("dead time", "time"))
            yield _Form(name, ("share",), (1,), shape_name, float(x[place]), np.eye(law.count)[:, [place]], np.ones(1))
        return
    span, flat = float(np.ptp(x)), flat_forms(len(x))[:, :known_up_to]
    for kind in KINDS if span > 0 else KINDS[:1]:
        if kind.needs_sign and not x[0] < 0 < x[-1]:
            continue
        for shape in kind.shapes(x) if kind.shape else [0.0]:
            columns = np.stack(kind.columns(x, float(shape)), axis=1)
            sizes = 1 / np.maximum(np.abs(columns).max(axis=0), 1e-300)
            bent = columns * sizes - flat @ np.linalg.lstsq(flat, columns * sizes, rcond=None)[0]
            kept = np.flatnonzero(np.abs(bent).max(axis=0) > _FLAT)
            if len(kept):
                yield _Form(kind.name, tuple(kind.coefficients[place] for place in kept),
                            tuple(kind.degrees[place] for place in kept), kind.shape, float(shape), bent[:, kept],
                            sizes[kept])


def _weigh(fit: Fit, pair: Pair, form: _Form, reach: float) -> float:
    """Return the evidence in nats with a form in the place of a law, in the linear model."""
    roots = fit.roots
    roots[list(fit.laws).index(pair)] = reach * form.columns
    return restricted_likelihood(fit.products.gram(roots)[0], fit.fitted.variance)


def _fit_form(fit: Fit, pair: Pair, form: _Form, reach: float) -> Fit:
    """Return the fit with a form in the place of a law, from the form that is next to it."""
    near = form.columns @ np.linalg.lstsq(form.columns, fit.state.laws[pair], rcond=None)[0]
    state = replace(fit.state, laws={**fit.state.laws, pair: near})
    return fit.beside({}, {pair: Prior(reach, form=form.columns)}, state)


def _unit_of(law: Candidate, degree: int) -> str:
    """Return the unit of a coefficient that is multiplied by a power of what a law depends on."""
    if law.variable.kind == "lags":
        return "1"
    unit, on = ("1" if law.quantity.relative else law.quantity.unit or "1"), law.variable.unit
    if not degree or not on:
        return unit
    return f"{unit}/({on})" + (f"^{degree}" if degree > 1 else "")
