"""Effects by kind: what a measured law is in words, with coefficients and their intervals.

A kind is a form with few coefficients over what the law depends on, and at most one shape, such as a threshold, a
period or the width of a play. It takes the place of the law in a fit, in which all parameters are estimated anew, so
that its evidence compares with that of the law: a law that no kind explains as well stays a measured one.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from slipstick.engine.bases import DELAYS, TIMES, WIDTHS, divide, flat_forms
from slipstick.engine.fit import SETTLED, Fit
from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import estimate, restricted_likelihood
from slipstick.engine.measured_law import DEVIATIONS
from slipstick.engine.priors import Prior
from slipstick.engine.recordings import Pair, clock_of
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import SENSOR
from slipstick.machine.kinds import MEMORIES, Kind
from slipstick.numerics.piecewise import hats

_WIDE = 3.0
"""Prior standard deviation of a coefficient, over that with which its form alone is as large as the law."""
_MOST = 3
"""Kinds that are fitted."""
_FLAT = 1e-6
"""Largest value of a column of which flat forms leave nothing."""
_SHARPENED = 20
"""Most fits with a shape, each at the one that is best about the fit before."""
_PARTS = 4
"""Parts of the distance of two knots over which a form with a shape is linear, as its corners lie between knots."""
_COMPARED, _CLOSER, _UNLIKELY = 21, 4, 8.0
"""Shapes that are compared at a time, most times that their range is narrowed, and the nats by which one that is out of
the question is behind the best."""


@dataclass(frozen=True)
class Coefficient:
    """A `value` with its 95 % interval, in a unit."""

    name: str
    value: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class KindOfLaw:
    """The kind that explains a law best: its `coefficients`, with its shape, and `nats` of evidence beyond the law.

    `kind` is its form, None of a memory, and `fit` the one with the form in the place of the law, whose parameters
    belong to the coefficients.
    """

    pair: Pair
    name: str
    kind: Kind | None
    coefficients: tuple[Coefficient, ...]
    nats: float
    fit: Fit


def find_kinds(fit: Fit, pairs: Sequence[Pair]) -> list[KindOfLaw]:
    """Return the kinds of the laws of `pairs` in a fit, of those that have one: each beside those before it."""
    kinds = list[KindOfLaw]()
    for pair in pairs:
        kind = find_kind(kinds[-1].fit if kinds else fit, pair)
        kinds += [] if kind is None else [kind]
    return kinds


def find_kind(fit: Fit, pair: Pair) -> KindOfLaw | None:
    """Return the kind of a law in a fit, or None where the law has more evidence than each.

    A kind has fewer coefficients than the law, so that it gains where it is right; an offset has one, and is a
    constant. Kinds are compared in the linear model about the fit, with the best shape of each; the best ones are
    fitted. A free shape always finds a little of the noise: each kind counts over all its shapes (marginal likelihood).
    """
    law, reach = fit.laws[pair], _WIDE * max(float(np.abs(fit.state.laws[pair]).max()), 1e-12)
    families = list(_list_families(law, fit.priors[pair].known_up_to,
                                    fit.recorded.machine.kinds_of(pair)))
    weighed = [(forms[0], family, _weigh_shape(forms, family.shapes)) for family in families
               if (forms := _weigh_all(fit, pair, family, reach))]
    weighed.sort(key=lambda each: -each[0].nats - each[2])
    tried = list[tuple[Fit, _Family, float]]()
    for each, family, shape in weighed[:_MOST]:
        with suppress(InvalidValue):  # a form from which the equations have no finite solution is none of the law
            fitted, family = _fit_form(fit, pair, each, family, reach)
            tried.append((fitted, family, fitted.evidence + shape))
    if not tried:
        return None
    best = max(nats for *_, nats in tried)
    # Where the constant of a law says nothing, a line is no more than what is proportional.
    fitted, family, _ = min((each for each in tried if each[2] > best - SETTLED), key=lambda each: each[1].count)
    if fitted.evidence < fit.evidence and law.count > 1:  # one coefficient is a constant, and has no law beside it
        return None
    forms = _weigh_all(fitted, pair, family, reach)
    share = np.exp([each.nats - forms[0].nats for each in forms])
    share /= share.sum()

    def average(name: str, values: list[float], variances: list[float], unit: str) -> Coefficient:
        """Return a coefficient over all shapes, each with its share (total variance)."""
        mean = float(share @ values)
        error = DEVIATIONS * float(np.sqrt(share @ (np.array(variances) + (np.array(values) - mean) ** 2)))
        return Coefficient(name, mean, mean - error, mean + error, unit)

    form = forms[0].form
    coefficients = [average(name, [law.size * float(each.values[place]) for each in forms],
                            [law.size**2 * float(each.variances[place]) for each in forms], _unit_of(law, degree))
                    for place, (name, degree) in enumerate(zip(form.names, form.degrees, strict=True))]
    if family.shape_name:
        shapes = np.array([each.form.shape for each in forms])
        coefficients.append(Coefficient(family.shape_name, float(share @ shapes), *_bound(shapes, share),
                                        "samples" if family.shape_name == "time" else law.variable.unit))
    if law.variable.kind == "lags":
        coefficients.append(_find_lateness(fitted, pair))
    return KindOfLaw(pair, family.kind, family.formed, tuple(coefficients), fitted.evidence - fit.evidence, fitted)


@dataclass(frozen=True, eq=False)
class _Family:
    """A kind over a law: its `shapes`, which may lie between these if the shape has a name, and its form at a shape."""

    kind: str
    shape_name: str
    shapes: np.ndarray
    form: Callable[[float], "_Form | None"]
    formed: Kind | None = None

    @property
    def count(self) -> int:
        """The number of coefficients that are declared."""
        return 1 if self.formed is None else len(self.formed.coefficients)


@dataclass(frozen=True, eq=False)
class _Form:
    """A kind at a `shape`: its columns (m, r), each multiplied by its `sizes` (r,), so that its largest value is 1."""

    names: tuple[str, ...]
    degrees: tuple[int, ...]
    shape: float
    columns: np.ndarray
    sizes: np.ndarray


@dataclass(frozen=True, eq=False)
class _Weighed:
    """A form in the linear model: its evidence in `nats`, and `values` and `variances` (r,) of its coefficients."""

    form: _Form
    nats: float
    values: np.ndarray
    variances: np.ndarray


def _list_families(law: Candidate, known_up_to: int, kinds: Sequence[Kind]) -> Iterator[_Family]:
    """Yield all kinds that a law may be of."""
    x, dependence = law.variable.knots, law.variable.kind
    if dependence in ("past", "lags"):
        others = len(WIDTHS) if dependence == "past" else len(DELAYS)
        first = (MEMORIES[0], "half width") if dependence == "past" else (MEMORIES[1], "time")
        for (name, shape_name), places in ((first, range(others)),
                                           ((MEMORIES[2], "time"), range(others, others + len(TIMES)))):
            within = slice(places.start, places.stop)

            def select(shape: float, within: slice = within) -> _Form:
                """Return what is between two memories of the law as their mean with weights."""
                column = np.zeros((law.count, 1))
                column[within] = hats(np.array([[shape]]), x[within])[0]
                return _Form(("share",), (1,), shape, column, np.ones(1))

            yield _Family(name, shape_name, x[within], select)
        return
    span, flat = float(np.ptp(x)), flat_forms(len(x))[:, :known_up_to]
    for kind in kinds if span > 0 else [each for each in kinds if not each.shape and each.degrees == (0,)]:
        if kind.needs_sign and not x[0] < 0 < x[-1]:
            continue

        def bend(shape: float, kind: Kind = kind) -> _Form | None:
            """Return the form without the flat forms that parameters replace, None where nothing is left."""
            columns = np.stack(kind.columns(x, shape), axis=1)
            sizes = 1 / np.maximum(np.abs(columns).max(axis=0), 1e-300)
            bent = columns * sizes - flat @ np.linalg.lstsq(flat, columns * sizes, rcond=None)[0]
            kept = np.flatnonzero(np.abs(bent).max(axis=0) > _FLAT)
            if not len(kept):
                return None
            names = tuple(kind.coefficients[place] for place in kept)
            return _Form(names, tuple(kind.degrees[place] for place in kept), shape, bent[:, kept], sizes[kept])

        yield _Family(kind.name, kind.shape, kind.shapes(x) if kind.shape else np.zeros(1), bend, kind)


def _weigh_all(fit: Fit, pair: Pair, family: _Family, reach: float) -> list[_Weighed]:
    """Return the likely forms of a kind in the place of a law, the best first, with as many coefficients as it has."""
    shapes = np.sort(family.shapes)
    for _ in range(_CLOSER):
        forms = [form for shape in shapes if (form := family.form(float(shape))) is not None]
        weighed = [_weigh(fit, pair, form, reach) for form in forms]
        if not weighed:
            return []
        best = max(weighed, key=lambda each: each.nats)
        likely = [place for place, each in enumerate(weighed) if each.nats > best.nats - _UNLIKELY]
        if not family.shape_name or len(likely) > _COMPARED // 2:
            break
        low, high = max(likely[0] - 1, 0), min(likely[-1] + 1, len(weighed) - 1)
        shapes = np.linspace(forms[low].shape, forms[high].shape, _COMPARED)
    alike = [weighed[place] for place in likely if weighed[place].form.names == best.form.names]
    return sorted(alike, key=lambda each: -each.nats)


def _bound(shapes: np.ndarray, share: np.ndarray) -> tuple[float, float]:
    """Return the ends of the central 95 % of shapes, each with its share of those half of the way to the next ones."""
    order = np.argsort(shapes)
    shapes, below = shapes[order], np.append(0.0, np.cumsum(share[order]))
    lower, upper = np.interp([0.025, 0.975], below, np.concatenate([
        shapes[:1], 0.5 * (shapes[:-1] + shapes[1:]), shapes[-1:]]))
    return float(lower), float(upper)


def _weigh_shape(forms: Sequence[_Weighed], shapes: np.ndarray) -> float:
    """Return the nats, at most 0, by which the likely forms, the best first, say more at the best shape than over all.

    All `shapes` of the kind are as likely before, and so is what is between them.
    """
    likely, count = sorted(forms, key=lambda each: each.form.shape), len(shapes)
    places = np.interp([each.form.shape for each in likely], np.sort(shapes), np.arange(count))
    widths = np.gradient(places) if len(likely) > 1 else np.ones(1)
    shares = np.exp([each.nats - forms[0].nats for each in likely])
    return min(0.0, float(np.log(max(float(widths @ shares), 1e-300) / count)))


def _weigh(fit: Fit, pair: Pair, form: _Form, reach: float) -> _Weighed:
    """Return a form in the place of a law, in the linear model."""
    roots, number = fit.roots, list(fit.laws).index(pair)
    roots[number] = reach * form.columns
    gram, variance = fit.products.gram(roots)[0], fit.fitted.variance
    estimated, places = estimate(gram, variance, fixed=True), fit.products.places(number, roots)
    return _Weighed(form, restricted_likelihood(gram, variance), reach * form.sizes * estimated.coefficients[places],
                    (reach * form.sizes) ** 2 * np.diag(estimated.covariance)[places])


def _fit_form(fit: Fit, pair: Pair, weighed: _Weighed, family: _Family, reach: float) -> tuple[Fit, _Family]:
    """Return the fit with a form in the place of a law, and its kind about that.

    The law is linear between its knots, and a form is not: it has more of them, or of the memories at some shapes the
    nearest one takes its shape. The best shape is found anew about the fit, as long as that gains: a clock and a lag
    hardly differ, so that the way may be long.
    """
    best, law, known_up_to = None, fit.laws[pair], fit.priors[pair].known_up_to
    knots = law.variable.knots
    if family.formed is not None and family.shape_name:
        knots = divide(knots, _PARTS)
    for _ in range(_SHARPENED if family.shape_name else 1):
        if family.formed is None:
            knots = knots.copy()
            knots[np.argmax(weighed.form.columns[:, 0])] = weighed.form.shape
        sharp = replace(law, variables={name: replace(each, knots=knots) for name, each in law.variables.items()})
        families = _list_families(sharp, known_up_to, () if family.formed is None else (family.formed,))
        about = next(each for each in families if each.kind == family.kind)
        form = about.form(weighed.form.shape)
        assert form is not None
        values = dict(zip(weighed.form.names, weighed.values, strict=True))
        near = form.columns @ [values.get(name, 0.0) / size for name, size in zip(form.names, form.sizes, strict=True)]
        state = replace(fit.state, laws={**fit.state.laws, pair: near})
        fit = fit.beside({pair: sharp}, {pair: Prior(reach, form=form.columns)}, state)
        if best is not None and fit.evidence < best.evidence + SETTLED:
            break
        best, family = fit, about
        weighed = _weigh_all(fit, pair, family, reach)[0]
    assert best is not None
    return best, family


def _find_lateness(fit: Fit, pair: Pair) -> Coefficient:
    """Return by how much a sensor reads late beside its lag: its clock and the lag hardly differ, and take turns."""
    first = next(iter(fit.laws[pair].variables))
    part = next(each for each in fit.recorded.parts if each.name == first)
    places = [term.place for term in fit.recorded.terms]
    place = places.index(clock_of(part, pair[0].removesuffix(SENSOR)))
    value, error = float(fit.fitted.coefficients[place]), float(np.sqrt(fit.fitted.covariance[place, place]))
    return Coefficient("late besides", value, value - DEVIATIONS * error, value + DEVIATIONS * error, "samples")


def _unit_of(law: Candidate, degree: int) -> str:
    """Return the unit of a coefficient that is multiplied by a power of what a law depends on."""
    if law.variable.kind == "lags":
        return "1"
    unit, on = ("1" if law.quantity.relative else law.quantity.unit or "1"), law.variable.unit
    if not degree or not on:
        return unit
    return f"{unit}/({on})" + (f"^{degree}" if degree > 1 else "")
