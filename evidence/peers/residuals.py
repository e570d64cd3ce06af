"""A regression of residuals: the equations with fitted parameters, and what the rest of them depends on.

The recipe, with the textbook form of each step:

1. Both sides of each equation pass the same low-pass filter, a Gaussian of `SettingsOfResiduals.width` samples, and are
   then decimated, as for inverse dynamic models in robotics (Gautier, 1997): no derivative amplifies noise, and what
   the filter takes away is the same on both sides.
2. Parameters are fitted by least squares, all runs together, with a delay of each sensor of up to one sample. Columns
   are those of a simulation with the fitted parameters, which shares no noise with the residual (instrumental
   variables: Young, 1970).
3. Parameters scatter between runs: they are random effects with variances by the EM algorithm (Laird and Ware, 1982),
   and rows are whitened by these and by the noise of each equation. Runs that are far off are set aside.
4. Every candidate of the engine is regressed on: hat functions of what the quantity depends on, or plays and lags.
   The one with the lowest BIC (Schwarz, 1978) is named if it lowers it by `least` (10 is "very strong" in Kass and
   Raftery, 1995), and stays in the regression, of which the variances are estimated anew; then the next one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import scipy

from evidence.answer import Answer, LawOfPair, NamedPair
from evidence.peers.equations import (
    Equation,
    add_columns,
    add_delay,
    pose,
    simulate,
    synchronize,
)
from slipstick.engine.laws import CONSTANT, Candidate, acts, list_candidates
from slipstick.engine.model import nominal_own_values
from slipstick.engine.recordings import Recorded
from slipstick.numerics.deviations import from_median
from slipstick.numerics.piecewise import hats

Matrix = np.ndarray
_ROUGH, _ROUNDS, _EM = 2, 5, 10  # of the fit of the parameters, at first without a simulation, and of the EM algorithm
_PASSES = 3  # of the last simulation
_LOOSE, _LATE = 0.3, 0.5  # what is known of parameters, as factors, and of delays in samples, before
_MEMORIES = 2  # rounds of the correlation of the residuals
_NEGLIGIBLE = 1e-6  # part of a column that is left by others, below which they replace it
_FLAT = ("nothing", "constant", "line")


@dataclass(frozen=True)
class SettingsOfResiduals:
    """Chosen on other cases than those of the table.

    `width` in samples of the filter, `every` so many-th sample is kept, `knots` of hat functions, `least` fall of the
    BIC, `most` laws, and `outlying`: robust standard deviations from which a run is set aside.
    """

    width: float = 3.0
    every: int = 6
    knots: int = 8
    least: float = 10.0
    most: int = 4
    outlying: float = 6.0


@dataclass(frozen=True, eq=False)
class Rows:
    """Filtered rows of all equations: residuals (n, r), columns of parameters (n, r, p) and of clocks (n, r, c).

    `of` (r,) is the equation of a row, and `valid` (n, r) whether it holds.
    """

    residual: Matrix
    parameters: Matrix
    clocks: Matrix
    of: Matrix
    valid: Matrix


@dataclass(frozen=True, eq=False)
class Regression:
    """The rows of the whole machine, whitened: `target` (N,), `fixed` columns (N, f), and how to whiten others."""

    target: Matrix
    fixed: Matrix
    noise: Matrix
    loads: list[tuple[Matrix, Matrix]]
    rows: Rows
    memory: Matrix

    def whiten(self, columns: Matrix) -> Matrix:
        """Return columns (n, r, m) as whitened rows (N, m)."""
        out = []
        for run, (axes, shrink) in enumerate(self.loads):
            values = _forget(self.rows, run, columns[run], self.noise, self.memory)
            out.append(values - axes @ (shrink[:, None] * (axes.T @ values)))
        return np.concatenate(out)


@dataclass(frozen=True, eq=False)
class Peer:
    """The machine as the regression sees it: residuals of `equations`, and columns of `clean` ones, of a simulation."""

    recorded: Recorded
    equations: list[Equation]
    clean: list[Equation]
    settings: SettingsOfResiduals
    candidates: list[Candidate] = field(default_factory=list)

    def filter(self, values: Matrix, order: int = 0) -> Matrix:
        """Return signals (..., k) after the filter, decimated, without both ends."""
        width, edge = self.settings.width, int(3 * self.settings.width)
        filtered = scipy.ndimage.gaussian_filter1d(values, width, axis=-1, order=order, mode="nearest")
        return np.asarray(filtered[..., edge:values.shape[-1] - edge:self.settings.every])

    def stack(self, values: Sequence[Matrix]) -> Matrix:
        """Return one (n, ..., k) for each equation, filtered, as rows behind each other (n, r, ...)."""
        return np.concatenate([np.moveaxis(self.filter(each), -1, 1) for each in values], axis=1)


def answer_by_residuals(case: str, recorded: Recorded, settings: SettingsOfResiduals | None = None) -> Answer:
    """Name what residuals depend on."""
    settings = settings or SettingsOfResiduals()
    own = {part.name: {name: value[:, ::part.fine] for name, value in nominal_own_values(part).items()}
           for part in recorded.parts}
    factors, peer = _fit_parameters(Peer(recorded, [], [], settings, list_candidates(recorded, own)))
    rows = _pose_rows(peer, factors)
    kept = _choose_runs(rows, settings)
    columns = {candidate.pair: _columns(peer, candidate, factors) for candidate in peer.candidates}
    columns = {pair: each for pair, each in columns.items() if each is not None}
    chosen, findings = list[Candidate](), list[NamedPair]()
    rows, columns = _take(rows, kept), {pair: each[kept] for pair, each in columns.items()}
    while len(chosen) < settings.most:
        regression = _regress(rows, [columns[each.pair] for each in chosen])
        falls = {candidate.pair: _fall(regression, columns[candidate.pair]) for candidate in peer.candidates
                 if candidate.pair in columns and candidate not in chosen}
        best = max(falls, key=falls.__getitem__)
        if falls[best] < settings.least:
            break
        chosen.append(next(each for each in peer.candidates if each.pair == best))
        rivals = tuple(pair for pair, fall in falls.items() if pair != best and falls[best] - fall < 2.0)
        findings.append(NamedPair(best, rivals, nats=round(float(falls[best]) / 2, 1)))
    set_aside = tuple(int(row) for row in recorded.rows if row not in recorded.rows[kept])
    laws = _measure(peer, rows, columns, chosen) if chosen else []
    return Answer(case, tuple(findings), set_aside=set_aside, laws=tuple(laws))


def _names(peer: Peer) -> list[str]:
    """Return the identifiers of the parameters that scatter or are fitted."""
    used = dict.fromkeys(name for each in peer.equations for name in each.part.parameters)
    return [name for name in used if any(term.place == name for term in peer.recorded.random + peer.recorded.shared)]


def _pose_rows(peer: Peer, factors: Mapping[str, float]) -> Rows:
    names, signals = _names(peer), list(peer.recorded.runs.signals)
    residuals, parameters, clocks, of, valid = list[Matrix](), list[Matrix](), list[Matrix](), list[Matrix](), list[
        Matrix]()
    for number, (measured, each) in enumerate(zip(peer.equations, peer.clean, strict=True)):
        residual = measured.residual(factors)
        late = np.stack([add_delay(peer.recorded, each, signal, factors) for signal in signals], axis=1)
        residuals.append(residual)
        parameters.append(np.stack([each.over_parameter(name, factors) if name in each.part.parameters
                                    else np.zeros_like(residual) for name in names], axis=1))
        clocks.append(late)
        edge = int(3 * peer.settings.width)
        near = scipy.ndimage.minimum_filter1d(measured.valid.astype(float), 2 * edge + 1, axis=1)
        kept = near[:, edge:near.shape[1] - edge:peer.settings.every] > 0.5
        valid.append(kept)
        of.append(np.full(kept.shape[1], number))
    return Rows(peer.stack(residuals), peer.stack(parameters), peer.stack(clocks), np.concatenate(of),
                np.concatenate(valid, axis=1))


def _pose(recorded: Recorded, signals: Mapping[str, Matrix], delays: Mapping[str, float]) -> list[Equation]:
    return pose(recorded, signals, delays, lambda rows: np.gradient(rows, axis=-1))


def _fit_parameters(peer: Peer) -> tuple[dict[str, float], Peer]:
    """Return changes of the parameters, and the peer without the delays of the sensors, of 0 to 1 sample."""
    recorded, factors = peer.recorded, dict[str, float]()
    delays = dict.fromkeys(recorded.runs.signals, 0.5)
    for number in range(_ROUNDS):
        known = synchronize(recorded, delays)
        clean = ({name: known.signals[name] for name in delays} if number < _ROUGH
                 else simulate(known, factors, delays, _PASSES if number == _ROUNDS - 1 else 1))
        peer = replace(peer, recorded=known, equations=_pose(known, known.runs.signals, delays),
                       clean=_pose(known, clean, delays))
        factors = factors or dict.fromkeys(_names(peer), 0.0)
        if number == _ROUNDS - 1:
            break
        rows = _pose_rows(peer, factors)
        regression = _regress(rows, [rows.clocks])
        loose = np.diag([1 / _LOOSE] * len(factors) + [1 / _LATE] * len(delays))
        prior = np.concatenate([-np.array([*factors.values()]) / _LOOSE, (0.5 - np.array([*delays.values()])) / _LATE])
        step = np.linalg.lstsq(np.concatenate([regression.fixed, loose]), np.concatenate([regression.target, prior]),
                               rcond=None)[0]
        factors = {name: value + float(np.clip(change, -0.3, 0.3))
                   for (name, value), change in zip(factors.items(), step[:len(factors)], strict=True)}
        delays = {name: float(np.clip(value + change, 0.0, 1.0))
                  for (name, value), change in zip(delays.items(), step[len(factors):], strict=True)}
    return factors, peer


def _choose_runs(rows: Rows, settings: SettingsOfResiduals) -> Matrix:
    """Return the runs whose residuals, after a fit of their own, are no outliers; at most a tenth are left out."""
    size = []
    for run in range(len(rows.residual)):
        rms = []
        for number in np.unique(rows.of):
            used = rows.valid[run] & (rows.of == number)
            target, columns = rows.residual[run, used], rows.parameters[run, used]
            rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0] if used.any() else np.zeros(1)
            rms.append(np.log(np.sqrt(np.mean(rest**2)) + 1e-300))
        size.append(rms)
    off, spread = from_median(np.array(size))
    off = np.max(off / (spread + 1e-12), axis=1)
    most = int(0.1 * len(off))
    far = np.argsort(-off)[:most]
    return np.setdiff1d(np.arange(len(off)), far[off[far] > settings.outlying])


def _take(rows: Rows, kept: Matrix) -> Rows:
    return replace(rows, residual=rows.residual[kept], parameters=rows.parameters[kept], clocks=rows.clocks[kept],
                   valid=rows.valid[kept])


def _columns(peer: Peer, candidate: Candidate, factors: Mapping[str, float]) -> Matrix | None:
    """Return the filtered columns (n, r, m) of a candidate, or None where there are none."""
    parts = dict[int, Matrix]()
    for number, each in enumerate(peer.clean):
        if acts(candidate.quantity, each.part):
            parts[number] = add_columns(peer.recorded, each, candidate, factors,
                                        partial(hats, knots=_knots(peer, candidate)))
    if not any(np.abs(each).max() > 0 for each in parts.values()):
        return None
    zero = np.zeros_like(next(iter(parts.values())))
    return peer.stack([parts.get(number, zero) for number in range(len(peer.equations))])


def _knots(peer: Peer, candidate: Candidate) -> Matrix:
    knots = candidate.variable.knots
    chosen = np.unique(np.round(np.linspace(0, len(knots) - 1, min(len(knots), peer.settings.knots))).astype(int))
    knots = knots[chosen]
    if candidate.variable.jumps and knots[0] < 0 < knots[-1]:
        edge = 1e-6 * np.ptp(knots)
        knots = np.sort(np.concatenate([knots[np.abs(knots) > 1e-3 * np.ptp(knots)], [-edge, edge]]))
    return np.asarray(knots)


def _forget(rows: Rows, run: int, columns: Matrix, noise: Matrix, memory: Matrix) -> Matrix:
    """Return the columns (r, m) of a run in units of the noise, less what the rows before explain of it."""
    usable = rows.valid[run, 1:] & rows.valid[run, :-1] & (rows.of[1:] == rows.of[:-1])
    of = rows.of[1:][usable]
    return (columns[1:][usable] - memory[of, None] * columns[:-1][usable]) / noise[of, None]


def _regress(rows: Rows, laws: Sequence[Matrix]) -> Regression:
    """Whiten the rows: the scatter of parameters and the noise of each equation by EM, its memory by its correlation.
    """
    fixed = np.concatenate([rows.parameters, *laws], axis=2)
    number = int(rows.of.max()) + 1
    noise = np.array([np.std(rows.residual[:, rows.of == each][rows.valid[:, rows.of == each]])
                      for each in range(number)])
    memory, scatter = np.zeros(number), np.full(rows.parameters.shape[2], 0.02)
    for _ in range(_MEMORIES):
        for _ in range(_EM):
            regression = _whiten(rows, fixed, noise, scatter, memory)
            norms = np.linalg.norm(regression.fixed, axis=0).clip(1e-100)
            mean = np.linalg.lstsq(regression.fixed / norms, regression.target, rcond=1e-6)[0] / norms
            noise, scatter, rest = _estimate(rows, rows.residual - fixed @ mean, noise, scatter, memory)
        pairs = rows.valid[:, 1:] & rows.valid[:, :-1]
        for each in range(number):
            kept = pairs & (rows.of[1:] == each) & (rows.of[:-1] == each)
            before, after = rest[:, :-1][kept], rest[:, 1:][kept]
            memory[each] = np.clip(before @ after / (before @ before), 0.0, 0.95)
    return _whiten(rows, fixed, noise, scatter, memory)


def _estimate(rows: Rows, residual: Matrix, noise: Matrix, scatter: Matrix,
              memory: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """Return noise and scatter after a step of the EM algorithm, and residuals (n, r) less the effects of the runs."""
    squares, moments, counts, rest = np.zeros(len(noise)), np.zeros(len(scatter)), np.zeros(len(noise)), []
    for run in range(len(residual)):
        usable = rows.valid[run, 1:] & rows.valid[run, :-1] & (rows.of[1:] == rows.of[:-1])
        of = rows.of[1:][usable]
        columns = _forget(rows, run, rows.parameters[run], noise, memory)
        target = _forget(rows, run, residual[run][:, None], noise, memory)[:, 0]
        spread = np.linalg.inv(columns.T @ columns + np.diag(1 / scatter**2))
        own = spread @ (columns.T @ target)
        moments += own**2 + np.diag(spread)
        known = np.einsum("ij,jk,ik->i", columns, spread, columns)
        squares += np.bincount(of, (target - columns @ own)**2 + known, len(noise))
        counts += np.bincount(of, minlength=len(noise))
        rest.append(residual[run] - rows.parameters[run] @ own)
    noise = noise * np.sqrt(squares / np.maximum(counts, 1))
    return noise, np.sqrt(moments / len(residual)).clip(1e-6), np.array(rest)


def _whiten(rows: Rows, fixed: Matrix, noise: Matrix, scatter: Matrix, memory: Matrix) -> Regression:
    loads = []
    for run in range(len(rows.residual)):
        axes, sizes, _ = np.linalg.svd(_forget(rows, run, rows.parameters[run], noise, memory) * scatter,
                                       full_matrices=False)
        loads.append((axes, 1 - 1 / np.sqrt(1 + sizes**2)))
    regression = Regression(np.zeros(0), np.zeros(0), noise, loads, rows, memory)
    return replace(regression, target=regression.whiten(rows.residual[..., None])[:, 0],
                   fixed=regression.whiten(fixed))


def _fall(regression: Regression, columns: Matrix) -> float:
    """Return by how much columns (n, r, m) lower the BIC."""
    axes = np.linalg.qr(regression.fixed / np.linalg.norm(regression.fixed, axis=0).clip(1e-100))[0]
    target = regression.target - axes @ (axes.T @ regression.target)
    values = regression.whiten(columns)
    values = values / np.linalg.norm(values, axis=0).clip(1e-100)
    values = values - axes @ (axes.T @ values)
    left, sizes, _ = np.linalg.svd(values, full_matrices=False)
    left = left[:, sizes > np.sqrt(_NEGLIGIBLE)]
    before, gain = float(target @ target), float(np.sum((left.T @ target) ** 2))
    n = len(target)
    return n * np.log(before / max(before - gain, 1e-12 * before)) - np.log(n) * left.shape[1]


def _measure(peer: Peer, rows: Rows, columns: Mapping[tuple[str, str], Matrix],
             chosen: Sequence[Candidate]) -> list[LawOfPair]:
    """Return the laws of the final regression over a variable, at their knots."""
    regression = _regress(rows, [columns[each.pair] for each in chosen])
    norms = np.linalg.norm(regression.fixed, axis=0).clip(1e-100)
    left, sizes, right = np.linalg.svd(regression.fixed / norms, full_matrices=False)
    kept = sizes > 1e-6 * sizes[0]
    inverse = (right[kept].T / sizes[kept]) @ left[:, kept].T
    values, variance = inverse @ regression.target / norms, np.sum(inverse**2, axis=1) / norms**2
    laws, first = [], rows.parameters.shape[2]
    for candidate in chosen:
        of = slice(first, first + columns[candidate.pair].shape[2])
        first = of.stop
        if candidate.pair[1] == CONSTANT or candidate.variable.kind in ("past", "lags"):
            continue
        knots = _knots(peer, candidate)
        flat = _flatness(regression, columns[candidate.pair], knots)
        laws.append(LawOfPair(candidate.pair, knots.tolist(), (candidate.size * values[of]).tolist(),
                              (candidate.size * np.sqrt(variance[of])).tolist(), candidate.quantity.relative,
                              _FLAT[flat]))
    return laws


def _flatness(regression: Regression, columns: Matrix, knots: Matrix) -> int:
    """Return how many flat forms of a law, a constant and a line, the parameters replace."""
    plain = regression.fixed[:, :regression.rows.parameters.shape[2]]
    axes = np.linalg.qr(plain / np.linalg.norm(plain, axis=0).clip(1e-100))[0]
    values, count = regression.whiten(columns), 0
    for form in (np.ones(len(knots)), knots):
        column = values @ form
        if np.linalg.norm(column - axes @ (axes.T @ column)) > 0.05 * np.linalg.norm(column):
            break
        count += 1
    return count
