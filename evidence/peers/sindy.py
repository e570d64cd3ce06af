"""SINDy with the known terms (Brunton, Proctor and Kutz, 2016), by PySINDy.

The settings are those of its documentation for noisy measurements with control inputs: rates by smoothed finite
differences (Savitzky and Golay), a model for the rate of each measured state, and terms as control inputs, which pass
the same filter; samples near corners of a command are left out. The terms of the plain model, and delays of its inputs,
are always present. Others are chosen by `FROLS` (forward regression, Billings 2013), as many as cross-validation over
runs says: the fewest within a standard error of the best number. Sequentially thresholded least squares (`STLSQ`) keep
some thirty terms in each case, because these are nearly combinations of each other, so that large coefficients cancel.

Terms are the derivatives of the declared rate with its parameters, and for each candidate of the engine that of the
rate with the quantity, times polynomials of what it depends on up to the third degree, sine and cosine of one and two
turns of an angle. So a term that is chosen has a pair; of terms that are the same column, all pairs count. Errors of
sensors are no functions of states and inputs, and neither is the past of a signal, which would always be chosen: it has
less noise than the signal. A term in the equation of a signal counts as an error of its sensor as well, over the same.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy

from evidence.answer import Answer, LawOfPair, NamedPair, Pair
from evidence.peers.equations import Equation, add_columns, name_variable, pose, read_variable
from slipstick.engine.laws import CONSTANT, GAIN, Candidate, acts, list_candidates
from slipstick.engine.model import nominal_own_values
from slipstick.engine.recordings import Recorded
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import SENSOR

_SAME = 0.9999  # least correlation of columns that count as the same
_REPLACED = 1e-3  # part of a column that plain terms leave, below which they replace it
_CORNER = 0.01  # least change of the slope of a command in a sample, over its range, that counts as a corner
_POINTS = 41  # of a law


@dataclass(frozen=True)
class SettingsOfSindy:
    """Chosen on other cases than those of the table.

    `window` in samples and `degree` of the smoothing, `every` so many-th sample is used, at `most` so many terms of an
    equation, and the number of `folds`.
    """

    window: int = 11
    degree: int = 3
    every: int = 6
    most: int = 8
    folds: int = 5


@dataclass(frozen=True, eq=False)
class Terms:
    """Columns (n, m, k) of an equation, of size 1 each: the first `plain` ones are those of the plain model.

    `pairs` (m,) name the others, `places` their function among those of the candidate, and `sizes` their sizes.
    """

    columns: np.ndarray
    plain: int
    pairs: list[list[Pair]]
    places: list[int]
    sizes: np.ndarray


def answer_by_sindy(case: str, recorded: Recorded, settings: SettingsOfSindy | None = None) -> Answer:
    """Name the terms beyond the plain model. Raises `InvalidValue` where PySINDy is not installed."""
    settings = settings or SettingsOfSindy()
    own = {part.name: {name: value[:, ::part.fine] for name, value in nominal_own_values(part).items()}
           for part in recorded.parts}
    candidates = list_candidates(recorded, own)
    signals = {name: np.asarray(value, float) for name, value in recorded.runs.signals.items()}
    equations = pose(recorded, signals, dict.fromkeys(signals, 0.0), lambda rows: np.gradient(rows, axis=-1))
    chosen = [each for equation in equations for each in _answer(recorded, equation, candidates, settings)]
    findings, laws = list[NamedPair](), dict[Pair, LawOfPair]()
    for finding, law in sorted(chosen, key=lambda each: -each[0].nats):
        if finding.pair not in (each.pair for each in findings):
            findings.append(finding)
            if law is not None:
                laws[finding.pair] = law
    return Answer(case, tuple(findings), laws=tuple(laws.values()))


def _answer(recorded: Recorded, equation: Equation, candidates: Sequence[Candidate],
            settings: SettingsOfSindy) -> list[tuple[NamedPair, LawOfPair | None]]:
    acting = [candidate for candidate in candidates if acts(candidate.quantity, equation.part)
              and not candidate.quantity.name.endswith(SENSOR)
              and candidate.variable.kind != "past"]
    rate = _differentiate(recorded, equation, settings)
    keep = np.zeros(rate.shape, bool)
    keep[:, settings.window:-settings.window:settings.every] = True
    keep &= scipy.ndimage.minimum_filter1d(equation.valid.astype(float), settings.window, axis=1) > 0.5
    for profile in recorded.runs.commands.values():
        keep &= ~_is_bent(profile.at(recorded.runs.time), settings.window)
    terms = _list_terms(recorded, equation, acting, keep, settings)
    path = _select(equation, rate, keep, terms, settings)
    rows = np.moveaxis(terms.columns, 1, 2)[keep]
    squares = np.mean((rate[keep] - path @ rows.T)**2, axis=1)
    gains = 0.5 * len(rows) * np.log(squares[:-1] / squares[1:])
    is_in = path[:, terms.plain:] != 0
    entered = [np.flatnonzero(after & ~before) for before, after in pairwise(is_in)]
    coefficients = path[-1]
    answers = list[tuple[NamedPair, LawOfPair | None]]()
    extra, owners = coefficients[terms.plain:], [pairs[0] for pairs in terms.pairs]
    for pair in dict.fromkeys(owner for owner, value in zip(owners, extra, strict=True) if value):
        places = [number for number, owner in enumerate(owners) if owner == pair]
        rivals = dict.fromkeys(other for number in places if extra[number] for other in terms.pairs[number][1:])
        sensor = equation.signal + SENSOR  # at the first order, an error of it is a term over the same
        rivals[sensor, GAIN if pair[1] == equation.signal else pair[1]] = None
        nats = sum(float(gain) for gain, new in zip(gains, entered, strict=True) if set(new.tolist()) & {*places})
        candidate = next(each for each in acting if each.pair == pair)
        law = _measure(recorded, equation, candidate, {terms.places[number]: extra[number] / terms.sizes[number]
                                                       for number in places})
        answers.append((NamedPair(pair, tuple(rival for rival in rivals if rival != pair), nats=round(nats, 1)), law))
    return answers


def _is_bent(command: np.ndarray, window: int) -> np.ndarray:
    """Return whether a command (n, k) has a corner near a sample: there, smoothing is off."""
    bend = np.abs(np.diff(command, n=2, axis=1, prepend=command[:, :1], append=command[:, -1:]))
    corners = bend > _CORNER * np.ptp(command)
    return scipy.ndimage.maximum_filter1d(corners.astype(float), 2 * window + 1, axis=1) > 0.5


def _differentiate(recorded: Recorded, equation: Equation, settings: SettingsOfSindy) -> np.ndarray:
    """Return the rate (n, k) of the state of an equation, by PySINDy."""
    method = _pysindy().SmoothedFiniteDifference(
        smoother_kws={"window_length": settings.window, "polyorder": settings.degree})
    rows = np.asarray(recorded.runs.signals[equation.signal], float)
    for _ in range(equation.order):
        rows = np.array([method._differentiate(row[:, None], equation.step)[:, 0] for row in rows])
    return rows


def _curves(recorded: Recorded, equation: Equation, candidate: Candidate) -> Any:
    """Return functions (n, m, k) of what a candidate depends on (n, k)."""
    if candidate.pair[1] == CONSTANT:
        return None
    if candidate.pair[1] == "angle":
        return lambda x: np.stack([turn(times * x) for times in (1, 2) for turn in (np.sin, np.cos)], axis=1)
    low, high = np.quantile(read_variable(recorded, equation, name_variable(candidate)), (0.001, 0.999))
    return lambda x: np.moveaxis(np.polynomial.legendre.legvander(2 * (x - low) / (high - low) - 1, 3)[..., 1:], -1, 1)


def _list_terms(recorded: Recorded, equation: Equation, candidates: Sequence[Candidate], keep: np.ndarray,
                settings: SettingsOfSindy) -> Terms:
    """Return all terms of an equation; those that are the same on the samples to `keep` are one."""
    pairs, places = list[list[Pair]](), list[int]()

    def smooth(values: np.ndarray) -> np.ndarray:
        return np.asarray(scipy.signal.savgol_filter(values, settings.window, settings.degree, axis=-1))

    columns = [smooth(equation.over_parameter(name, {})) for name in equation.part.parameters]
    columns += [smooth(equation.over_delay(name)) for name in equation.inputs]
    columns = [each for each in columns if np.abs(each).max() > 0]
    plain = _orthogonal([each[keep] for each in columns])
    columns, count = [columns[place] for place in plain], len(plain)
    axes = np.linalg.qr(np.stack([each[keep] for each in columns], axis=1))[0]
    units = np.zeros((int(keep.sum()), 0))
    for candidate in candidates:
        functions = smooth(add_columns(recorded, equation, candidate, {}, _curves(recorded, equation, candidate)))
        for place in range(functions.shape[1]):
            values = functions[:, place][keep]
            size = float(np.linalg.norm(values))
            left = values - axes @ (axes.T @ values)
            if size == 0 or np.linalg.norm(left) < _REPLACED * size:
                continue
            alike = np.abs(units.T @ (values / size))
            if alike.size and alike.max() > _SAME:
                pairs[int(alike.argmax())].append(candidate.pair)
                continue
            units = np.concatenate([units, values[:, None] / size], axis=1)
            columns.append(functions[:, place])
            pairs.append([candidate.pair])
            places.append(place)
    sizes = np.array([np.sqrt(np.mean(each[keep]**2)) for each in columns])
    return Terms(np.stack(columns, axis=1) / sizes[:, None], count, pairs, places, sizes[count:])


def _orthogonal(columns: Sequence[np.ndarray]) -> list[int]:
    """Return the places of columns that are not combinations of those before."""
    kept = list[int]()
    for place, column in enumerate(columns):
        others = np.stack([columns[each] for each in kept], axis=1) if kept else np.zeros((len(column), 0))
        left = column - others @ np.linalg.lstsq(others, column, rcond=None)[0] if kept else column
        if np.linalg.norm(left) > 1e-6 * np.linalg.norm(column):
            kept.append(place)
    return kept


def _select(equation: Equation, rate: np.ndarray, keep: np.ndarray, terms: Terms,
            settings: SettingsOfSindy) -> np.ndarray:
    """Return the coefficients (t + 1, m) of models with 0 to t terms, as many as cross-validation chooses."""
    rows = np.moveaxis(terms.columns, 1, 2)
    fold = np.arange(len(rate)) % settings.folds
    scores = np.empty((settings.folds, settings.most + 1))
    for number in range(settings.folds):
        outside = fold == number
        path = _fit(equation, rate, keep, rows, ~outside, terms.plain, settings.most)
        off = rate[outside][keep[outside]] - path @ rows[outside][keep[outside]].T
        scores[number] = np.mean(off**2, axis=1)
    mean, error = scores.mean(axis=0), scores.std(axis=0, ddof=1) / np.sqrt(settings.folds)
    best = int(mean.argmin())
    chosen = int(np.flatnonzero(mean <= mean[best] + error[best])[0])
    return _fit(equation, rate, keep, rows, np.ones(len(rate), bool), terms.plain, settings.most)[:chosen + 1]


def _fit(equation: Equation, rate: np.ndarray, keep: np.ndarray, rows: np.ndarray, runs: np.ndarray, plain: int,
         most: int) -> np.ndarray:
    """Return the coefficients (t + 1, m) of models of some runs with 0 to t terms beyond the plain ones, by PySINDy."""
    ps, used = _pysindy(), np.flatnonzero(runs)
    lengths = np.cumsum(keep[used].sum(axis=1))[:-1]
    values, target = rows[used][keep[used]], rate[used][keep[used]]
    known = np.linalg.lstsq(values[:, :plain], np.column_stack([target, values[:, plain:]]), rcond=None)[0]
    left, others = target - values[:, :plain] @ known[:, 0], values[:, plain:] - values[:, :plain] @ known[:, 1:]
    optimizer = ps.FROLS(max_iter=most, alpha=0.0, normalize_columns=False, unbias=False)
    library = ps.GeneralizedLibrary([ps.IdentityLibrary()], inputs_per_library=[[*range(1, others.shape[1] + 1)]])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of AxesArray
        ps.SINDy(optimizer=optimizer, feature_library=library).fit(
            np.split(equation.states[equation.place][used][keep[used]][:, None], lengths), t=equation.step,
            x_dot=np.split(left[:, None], lengths), u=np.split(others, lengths))
    extra = np.array([np.ravel(each) for each in optimizer.history_])[:most + 1]
    return np.concatenate([known[:, 0] - extra @ known[:, 1:].T, extra], axis=1)


def _measure(recorded: Recorded, equation: Equation, candidate: Candidate,
             values: dict[int, float]) -> LawOfPair | None:
    """Return the law of some coefficients by their place, over a variable; SINDy states no standard errors."""
    curves = _curves(recorded, equation, candidate)
    if curves is None:
        return None
    x = read_variable(recorded, equation, name_variable(candidate))
    grid = np.linspace(*np.quantile(x, (0.001, 0.999)), _POINTS)
    functions = curves(grid[None])[0]
    change = candidate.size * sum(value * functions[place] for place, value in values.items())
    return LawOfPair(candidate.pair, grid.tolist(), np.asarray(change).tolist(), [0.0] * len(grid),
                     candidate.quantity.relative, "constant")


def _pysindy() -> Any:
    try:
        import pysindy
    except ImportError as error:
        raise InvalidValue("PySINDy is not installed", "Install the extra 'peers': pip install '.[peers]'") from error
    return pysindy
