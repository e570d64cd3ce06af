"""Numbers of measured laws, with the standard errors that these have."""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import scipy

from evidence.real import Row
from evidence.real.picture import Band, Panel
from slipstick.engine.fit import Fit
from slipstick.engine.measured_law import measure
from slipstick.engine.recordings import Pair
from slipstick.engine.selection import Identification
from slipstick.engine.study import estimate_parameters


def state_parameters(answer: Identification) -> Iterator[Row]:
    """Yield the parameters that are no begins of runs, and the mean chi-square of each block."""
    for fit in answer.fits:
        declared = {each.name: each for each in fit.recorded.machine.parameters}
        for known in estimate_parameters(fit):
            if declared[known.name].first_of is None:
                yield Row(known.name, known.mean, known.error, declared[known.name].unit)
        for block, chi in fit.chi_square.items():
            yield Row(f"chi-square of {block}", float(chi.mean()), float(chi.std() / np.sqrt(len(chi))), "")


def state_mean(what: str, values: np.ndarray, unit: str = "", published: float | None = None) -> Row:
    """Return the mean of independent values (n,) with its standard error."""
    return Row(what, float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(len(values))), unit, published)


def list_signals(answer: Identification) -> dict[str, np.ndarray]:
    """Return what the only block gives (n, o, k) as recorded, and as it is explained with all laws.

    To the latter belongs what the run differs from it by on average: the noise of a sensor may be so slow.
    """
    [fit] = answer.fits
    [model] = fit.models.values()
    constant = np.ma.array(model.residual, mask=~model.part.counted).mean(axis=2, keepdims=True).filled(0.0)
    return {"recorded": model.part.measured, "explained": model.predicted + constant}


@dataclass(frozen=True)
class Expected:
    """A law that should be named, stated at `places` (m,) beyond the first of them; a `form` of it may be known.

    The form is a function of places and parameters, written as `formula` with these names. A variable that `is_stepped`
    is at these places alone, but for instants at which it changes.
    """

    pair: Pair
    places: tuple[float, ...]
    formula: str = ""
    form: Callable[..., np.ndarray] | None = None
    is_stepped: bool = False


def state_law(law: Expected, fit: Fit) -> Iterator[Row]:
    """Yield the changes of a law, and the parameters of its form; nothing where the fit has no such law."""
    if law.pair not in fit.laws:
        return
    band, (quantity, variable) = measure_changes(law, fit, np.array(law.places)), law.pair
    for place, value, error in zip(band.x[1:], band.value[1:], band.std[1:], strict=True):
        yield Row(f"{quantity} at {variable} {place:g}", float(value), float(error), measure(fit, law.pair).unit)
    for name, (value, error) in fit_form(law, band)[1].items():
        yield Row(f"{name} of {law.formula}", value, error)


def plot_law(law: Expected, fit: Fit) -> Iterator[Panel]:
    """Yield the panel of a law, as fine as it was measured, beside its form; nothing where the fit has no such law."""
    if law.pair in fit.laws:
        (quantity, variable), measured, places = law.pair, measure(fit, law.pair), np.array(law.places)
        inner = measured.x[(measured.x > places.min()) & (measured.x < places.max()) & (not law.is_stepped)]
        form = fit_form(law, measure_changes(law, fit, places))[0]
        yield Panel(variable, ", ".join(filter(None, (quantity, measured.unit))),
                    [measure_changes(law, fit, np.union1d(places, inner))], form)


def measure_changes(law: Expected, fit: Fit, x: np.ndarray) -> Band:
    """Return what a law is at x (m,) beyond what it is at the first of its places."""
    measured = measure(fit, law.pair)
    hats = np.array([np.interp(x, measured.x, row) - np.interp(law.places[0], measured.x, row)
                     for row in np.eye(len(measured.x))]).T
    std = np.sqrt(np.einsum("mi,ij,mj->m", hats, measured.covariance, hats))
    return Band(law.pair[0], x, hats @ measured.change, std)


def fit_form(law: Expected, band: Band) -> tuple[list[Band], dict[str, tuple[float, float]]]:
    """Return the known form that is closest to a band, by least squares, and its parameters with standard errors."""
    if (form := law.form) is None:
        return [], {}
    names = list(inspect.signature(form).parameters)[1:]

    def change(x: np.ndarray, *values: float) -> np.ndarray:
        return form(x, *values) - form(band.x[0], *values)

    best, covariance = scipy.optimize.curve_fit(change, band.x, band.value, p0=np.ones(len(names)))
    errors = np.sqrt(np.diag(covariance))
    return ([Band(law.formula, band.x, change(band.x, *best))],
            {name: (float(value), float(error)) for name, value, error in zip(names, best, errors, strict=True)})
