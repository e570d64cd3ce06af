"""Which laws recordings ask for: forward selection by evidence and by agreement of the runs, and then backward."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.engine.approach import approach, approach_each
from slipstick.engine.disturbances import estimate_disturbances, estimate_input_noise
from slipstick.engine.doing import Doing, Log
from slipstick.engine.equations import refine
from slipstick.engine.evidence import Screened, agree, expect, hold_out, multiply, screen
from slipstick.engine.fit import HOPED, SETTLED, Fit, begin, fit, join, join_recorded
from slipstick.engine.laws import CONSTANT, FINER, Candidate, list_candidates, list_curves
from slipstick.engine.model import State, nominal_own_values
from slipstick.engine.noise import (
    CORRELATIONS,
    LAGS,
    LONGER,
    Carried,
    Differences,
    Noise,
    SecondDifferences,
    bound_noise,
    draw_noise,
    estimate_loudness,
    estimate_residual_noise,
    second_variances,
)
from slipstick.engine.part_fit import PartFit
from slipstick.engine.preparation import straighten
from slipstick.engine.priors import Prior
from slipstick.engine.recordings import Pair, Part, Recorded, explain
from slipstick.engine.settings import EngineSettings
from slipstick.machine.declaration import Machine, identifier_of
from slipstick.numerics.deviations import from_median
from slipstick.numerics.threads import in_one_blas_thread

_LEAST_CHI = 1e-3
"""Least chi-square of a run: one without samples that count has none."""
_TEMPERED = 6
"""Most rounds in which what a part leaves is found to count as noise."""
_RENEWED = 2
"""Times that noise and explained signals follow from a fit: what a drawn state has of its own noise fades each time,
and the noise of a part is that which it leaves with explained inputs."""
_ROUGH = 0.005
"""Nats that a step of a trial may still promise, over those that its candidate gains by a linear model."""
_TIED = 0.8
"""Share of the nats of the best candidate below which another one is not fitted to the end."""
_CLOCKS = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
"""Clocks at which a fit is tried, in standard deviations of the prior: a sample, in quarters."""
_NEAR = 0.5
"""Share of the nats of a finding from which a candidate is fitted in full: few coefficients gain less than many."""


@dataclass(frozen=True)
class Lead:
    """The lead of a finding over another `pair` that gains `nats`, in standard `errors` over the runs.

    The gain of a pair that stays far behind is that at which its fit ended.
    """

    pair: Pair
    nats: float
    errors: float


@dataclass(frozen=True, eq=False)
class Finding:
    """A law that the recordings ask for: `nats` in log marginal likelihood, `errors` of agreement of the runs.

    `rivals` are pairs that it does not lead, and `leads` are those over all that were fitted in full beside it, the
    largest gain first. `gains` (n,) are held out in each run.
    """

    pair: Pair
    nats: float
    errors: float
    rivals: tuple[Pair, ...]
    gains: np.ndarray
    leads: tuple[Lead, ...] = ()


@dataclass(frozen=True, eq=False)
class Identification:
    """What recordings ask for: `findings`, the `fits` of the groups of parts with them, and runs `set_aside`.

    `bare` are the fits without laws. `unexplained` are blocks in which something is missing that no candidate explains.
    """

    findings: tuple[Finding, ...]
    fits: tuple[Fit, ...]
    bare: tuple[Fit, ...]
    set_aside: tuple[int, ...]
    unexplained: tuple[str, ...]
    seconds: float


@in_one_blas_thread
def identify(recorded: Recorded, settings: EngineSettings | None = None, log: Log = lambda _: None) -> Identification:
    """Find the laws that recordings ask for, in all parts."""
    began, settings = time.perf_counter(), settings or EngineSettings()
    bare = settle(recorded, settings, log)
    search = _Search(settings, log, {_name(each): each for each in bare})
    while search.step():
        pass
    fits = tuple(search.fits.values())
    aside = np.setdiff1d(recorded.rows, bare[0].recorded.rows)
    return Identification(tuple(search.findings), fits, tuple(bare), tuple(aside.tolist()),
                          list_unexplained(fits, settings), time.perf_counter() - began)


def list_unexplained(fits: Sequence[Fit], settings: EngineSettings) -> tuple[str, ...]:
    """Return the names of the parts of fits that leave more than noise."""
    return tuple(name for each in fits for name, chi in each.chi_square.items() if _is_unexplained(chi, settings))


Group = tuple[str, ...]
"""The names of parts that are fitted together."""


def _name(fit: Fit) -> Group:
    return tuple(part.name for part in fit.recorded.parts)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A candidate that was fitted in full beside the laws of the `groups` on which it acts."""

    finding: Finding
    fit: Fit
    base: Fit
    groups: tuple[Group, ...]
    expected: np.ndarray


class _Search:
    """Forward selection over groups of parts, each with its fit; groups that a law joins are one from then on."""

    def __init__(self, settings: EngineSettings, log: Log, fits: dict[Group, Fit]) -> None:
        self.settings, self.log, self.fits = settings, log, fits
        self.findings, self.closed, self.candidates = list[Finding](), set[Group](), self._list()
        self._screened: dict[tuple[Fit, ...], list[Screened]] = {}
        self._bases: dict[tuple[Fit, ...], Fit] = {}

    def step(self) -> bool:
        """Add the best law, or close the groups that ask for none; return whether groups are left."""
        ranked = self._rank()
        if not ranked or ranked[0].nats < self.settings.nats * _NEAR:
            return False
        groups = self._groups(ranked[0].candidate)
        asking = [each for each in ranked if each.nats > self.settings.nats * _NEAR
                  and set(self._groups(each.candidate)) & set(groups)]
        near = asking[:self.settings.rivals]
        # A law contains the constant of its quantity, which says the same with fewer words if it is all.
        constants = {(each.candidate.pair[0], CONSTANT) for each in near}
        near += [each for each in asking[self.settings.rivals:] if each.candidate.pair in constants]
        trials = list[_Trial]()
        for each in near:
            self._say(f"Trying {' over '.join(each.candidate.pair)}, which may gain {each.nats:.1f} nats")
            trials.append(self._try(each, max((trial.finding.nats for trial in trials), default=0.0)))
        leading = max(trial.finding.nats for trial in trials)
        trials = [self._finish(trial) if trial.fit.converged
                  and trial.finding.nats + HOPED * trial.fit.promised > leading
                  else trial for trial in trials]
        trials.sort(key=lambda trial: -trial.finding.nats)
        passing = [trial for trial in trials if self._is_enough(trial)]
        if not passing:
            first, ahead = trials[0].finding, trials[0].base.promised
            why = "which is too little" if ahead < SETTLED else \
                f"too little beside {ahead:.1f} nats that the fit without it has not reached"
            self._say(f"No law is named: {' over '.join(first.pair)} gains {first.nats:.1f} nats by {first.errors:.1f} "
                      f"standard errors, {why}")
            # What acts on all of them is closed: a block on which none was tried alone may have a law of its own.
            common = set[Group].intersection(*(set(trial.groups) for trial in trials))
            self.closed |= common or set(groups)
            return True
        best = self._choose(passing)
        leads = tuple(_lead(best, trial) for trial in trials if trial is not best)
        self.findings.append(replace(best.finding, leads=leads, rivals=tuple(
            each.pair for each in leads if each.nats > self.settings.nats and each.errors < self.settings.apart)))
        self._say(f"Named {' over '.join(best.finding.pair)}, which gains {best.finding.nats:.1f} nats by "
                  f"{best.finding.errors:.1f} standard errors: fitting the blocks that it changes")
        self.fits = {group: fit for group, fit in self.fits.items() if group not in best.groups}
        self._accept(best.fit)
        return True

    def _choose(self, trials: Sequence[_Trial]) -> _Trial:
        """Return the best trial, or that of the constant in its law, if the rest of the law would be no further one."""
        best = trials[0]
        constant = next((each for each in trials if each.finding.pair == (best.finding.pair[0], CONSTANT)), best)
        rest = best.finding.nats - constant.finding.nats
        return constant if rest < max(self.settings.nats, self.settings.further * constant.finding.nats) else best

    def _accept(self, better: Fit) -> None:
        """Take a fit with a further law, and search the groups again that read what it explains."""
        better = temper(better, self.settings).restart()
        for _ in range(_RENEWED):  # with the law, the part explains its signals, and shows their noise
            better = _renew([better], [better], self.settings)[0]
        last, better = self.findings[-1], self._drop_redundant(better)
        # Other groups read its signals, or have candidates over them.
        others = list(self.fits.values())
        for before, after in zip(others, _renew(others, [better], self.settings), strict=True):
            if after.models is not before.models:
                self.closed.discard(_name(after))
            self.fits[_name(after)] = after
        self.fits[_name(better)] = better
        self.candidates = self._list()
        if last not in self.findings:  # or it would be found again
            self.closed.add(_name(better))
        fits = set(self.fits.values())  # others are needed no more, and are as large as the runs are many
        self._screened = {key: each for key, each in self._screened.items() if fits.issuperset(key)}
        self._bases = {key: each for key, each in self._bases.items() if fits.issuperset(key)}
        self.closed |= {group for group, each in self.fits.items()
                        if sum(finding.pair in each.laws for finding in self.findings) >= self.settings.most}

    def _drop_redundant(self, better: Fit) -> Fit:
        """Return the fit without laws that gain too little beside the others now: these are findings no more."""
        for finding in tuple(self.findings):
            if finding.pair not in better.laws:
                continue
            laws = {pair: law for pair, law in better.laws.items() if pair != finding.pair}
            rest = fit(better.recorded, laws, {pair: better.priors[pair] for pair in laws}, better.state,
                       better.fitted.variance, needed=better.evidence - self.settings.nats)
            if self._is_redundant(better, rest, finding.pair):
                rest = rest.beside({}, {})  # which may have ended early, and is what others are compared with from now
                if self._is_redundant(better, rest, finding.pair):
                    self.findings.remove(finding)
                    better = rest
        return better

    def _is_redundant(self, better: Fit, rest: Fit, pair: Pair) -> bool:
        errors = agree(hold_out(better.fitted) - hold_out(rest.fitted), expect(better, better.laws[pair]))
        return better.evidence - rest.evidence < self.settings.nats or errors < self.settings.errors

    def _list(self) -> list[Candidate]:
        """Return all candidates over signals and own variables as the fits explain them."""
        own = {name: model.own() for each in self.fits.values() for name, model in each.models.items()}
        return list_candidates(join_recorded([each.recorded for each in self.fits.values()]), own)

    def _rank(self) -> list[Screened]:
        """Return the gains of all candidates of open groups, the largest first."""
        sorted_by_fits = dict[tuple[Fit, ...], list[Candidate]]()
        for candidate in self.candidates:
            groups = self._groups(candidate)
            if not set(groups) & self.closed:
                sorted_by_fits.setdefault(tuple(self.fits[group] for group in groups), []).append(candidate)
        waiting = {key: candidates for key, candidates in sorted_by_fits.items() if key not in self._screened}
        models = {name: model for each in self.fits.values() for name, model in each.models.items()}
        if waiting:
            self._say(f"Comparing {sum(map(len, waiting.values()))} laws")
        multiplied = multiply(models, [candidate for candidates in waiting.values() for candidate in candidates])
        for key, candidates in waiting.items():
            self._screened[key] = screen(self._base(key), candidates, multiplied)
        screened = [each for key in sorted_by_fits for each in self._screened[key]]
        screened.sort(key=lambda each: -each.nats)
        return screened

    def _base(self, fits: tuple[Fit, ...]) -> Fit:
        if fits not in self._bases:
            self._bases[fits] = join(fits)
        return self._bases[fits]

    def _groups(self, candidate: Candidate) -> tuple[Group, ...]:
        return tuple(group for group in self.fits if set(group) & set(candidate.variables))

    def _try(self, screened: Screened, reached: float) -> _Trial:
        """Fit a candidate in full, unless it stays far behind what another one has `reached` in nats."""
        candidate, groups = screened.candidate, self._groups(screened.candidate)
        base, pair = self._base(tuple(self.fits[group] for group in groups)), screened.candidate.pair
        full = base.beside({pair: candidate}, {pair: screened.prior}, settled=_ROUGH * screened.nats,
                           needed=base.evidence + _TIED * reached)
        if not full.converged and full.evidence + HOPED * full.promised > base.evidence + _TIED * reached:
            state = approach_each(full.recorded, full.laws, full.solution)
            full = full.restart(state, full.fitted.variance)
        if full.evidence < base.evidence:  # runs that are far away stand for the law by their own parameters
            full = full.restart()
        return self._judge(candidate, full, base, groups)

    def _finish(self, trial: _Trial) -> _Trial:
        """Return a trial whose fit has converged as far as decisions between near candidates need."""
        if trial.fit.promised < SETTLED:
            return trial
        full, law = trial.fit.beside({}, {}), trial.fit.laws[trial.finding.pair]
        return self._judge(law, max(trial.fit, full, key=lambda each: each.evidence), trial.base, trial.groups)

    def _judge(self, candidate: Candidate, full: Fit, base: Fit, groups: tuple[Group, ...]) -> _Trial:
        pair = candidate.pair
        gains, expected = hold_out(full.fitted) - hold_out(base.fitted), expect(full, candidate)
        finding = Finding(pair, full.evidence - base.evidence, agree(gains, expected), (), gains)
        return _Trial(finding, full, base, groups, expected)

    def _say(self, words: str) -> None:
        self.log(Doing("search", words))

    def _is_enough(self, trial: _Trial) -> bool:
        before = [finding.nats for finding in self.findings if finding.pair in trial.base.laws]
        # What the fit without the law has not reached is no merit of the law.
        least = max([self.settings.nats, *(self.settings.further * nats for nats in before)]) + trial.base.promised
        return trial.finding.nats > least and trial.finding.errors > self.settings.errors


def _lead(best: _Trial, other: _Trial) -> Lead:
    return Lead(other.finding.pair, other.finding.nats, agree(best.finding.gains - other.finding.gains, best.expected))


def settle(recorded: Recorded, settings: EngineSettings, log: Log = lambda _: None) -> list[Fit]:
    """Return the fits without laws of the groups of parts, of the runs that are not set aside.

    They have the noise of sensors that their residuals show.
    """
    fits, explained, most = list[Fit](), dict[str, np.ndarray](), int(settings.most_outlying * len(recorded))
    waiting = recorded.groups()
    while waiting:
        group = explain(waiting.pop(0), explained)
        log(Doing("fit", f"Fitting the parameters of {' and '.join(f'“{part.name}”' for part in group.parts)}"))
        fitted = temper(fit_bare(group), settings, begin(group))
        if any(part.temper > 1 for part in fitted.recorded.parts) or len(_find_bad([fitted], settings)):
            state, left = approach(fitted.recorded)
            bad = _choose_worst(_deviate(np.log(np.maximum(left, _LEAST_CHI)), settings.least_spread), settings)
            if len(recorded) - len(group) + len(bad) <= most:  # no step of all runs is one of these as well
                kept = np.delete(np.arange(len(group)), bad)
                state, fitted = state.take(kept), fitted.take(kept)
                fits, waiting = [each.take(kept) for each in fits], [each.take(kept) for each in waiting]
                explained = {name: signal[kept] for name, signal in explained.items()}
            fitted = temper(_try_clocks(fitted.restart(state, state.points.var(axis=0))), settings)
        fits.append(fitted)
        explained |= _explain_signals(fitted, settings)
    for number in range(1 + _RENEWED):
        if number:  # bad runs have a share in the noise that the signals show
            fits = _renew(fits, fits, settings)
        while len(bad := _find_bad(fits, settings)) and len(recorded) - len(fits[0].recorded) + len(bad) <= most:
            kept = np.delete(np.arange(len(fits[0].recorded)), bad)
            fits = [taken if each.converged else fit(taken.recorded, taken.laws, taken.priors, taken.state)
                    for each in fits for taken in [each.take(kept)]]  # what has converged hardly changes
    return fits


def _try_clocks(fitted: Fit) -> Fit:
    """Return the better one of a fit and of one from those clocks at which it predicts the signals best.

    Where a signal jumps between two samples, residuals do not tell of the way to the right clock.
    """
    def move(state: State, place: int, value: float) -> State:
        shared = state.shared.copy()
        shared[place] = value
        return replace(state, shared=shared)

    def measure(state: State) -> float:
        return sum(float(model.move(state).gram[:, -1, -1].sum()) for model in fitted.models.values())

    state = fitted.state
    for place, term in enumerate(fitted.recorded.shared):
        if term.kind == "clock":
            tried = [move(state, place, term.target + away * term.std) for away in _CLOCKS]
            state = min([state, *tried], key=measure)
    return fitted if state is fitted.state else fitted.restart(state, fitted.fitted.variance)


def temper(fitted: Fit, settings: EngineSettings, origin: State | None = None) -> Fit:
    """Return a fit in which what the parts leave beyond noise counts as noise.

    Parameters are not driven far away by what is missing, and what a law leaves of a strong effect is weighed by its
    own size (quasi-likelihood: McCullagh and Nelder, Generalized Linear Models, 1989, chapter 9). A fit without laws
    that may already be far away begins again at its `origin`.
    """
    for _ in range(_TEMPERED):
        wanted = {name: max(1.0, _trim(chi, settings.most_outlying)) for name, chi in fitted.chi_square.items()}
        wanted = {name: value if value > 1 + settings.unexplained else 1.0 for name, value in wanted.items()}
        parts = fitted.recorded.parts
        # Near what counts already is near enough, but for nothing that is left.
        if all(part.temper == 1 if wanted[part.name] == 1 else
               abs(np.log(wanted[part.name] / part.temper)) < settings.unexplained for part in parts):
            break
        hotter = any(wanted[part.name] > 2 * part.temper for part in parts)
        recorded = replace(fitted.recorded, parts=tuple(replace(part, temper=wanted[part.name]) for part in parts))
        fitted = fit_bare(recorded, origin) if hotter and origin is not None else fitted.again(recorded)
    return fitted


def _trim(chi: np.ndarray, share: float) -> float:
    """Return the mean of chi-squares (n,) without the largest share of them."""
    return float(np.sort(chi)[:len(chi) - int(share * len(chi))].mean())


def _find_bad(fits: Sequence[Fit], settings: EngineSettings) -> np.ndarray:
    return _choose_worst(np.max([_doubt(each, settings) for each in fits], axis=0), settings)


def _choose_worst(doubt: np.ndarray, settings: EngineSettings) -> np.ndarray:
    """Return the runs with the largest of deviations (n,) beyond what is usual: without them, others may look better.
    """
    return np.flatnonzero(doubt > max(settings.outlying, 0.5 * float(doubt.max())))


def _renew(fits: Sequence[Fit], shown: Sequence[Fit], settings: EngineSettings) -> list[Fit]:
    """Return fits with the noise that those `shown` leave, with signals as these explain them, and tempered anew.

    A fit that is not shown itself, and reads nothing of these signals, keeps its state.
    """
    explained = {name: signal for each in shown for name, signal in _explain_signals(each, settings).items()}
    quiet = {each: renew_noise(each) for each in shown}
    given = {identifier_of(signal): (part.sensors[place], part.loudness[:, place])
             for each in quiet.values() for part in each.parts for place, signal in enumerate(part.signals)}
    renewed = list[Fit]()
    for each in fits:
        recorded = quiet.get(each, each.recorded)
        reads = {identifier_of(signal) for part in recorded.parts for signal in part.read} & set(given)
        # Of a part without states, what it leaves tells only the noise of its signal and of its inputs together.
        parts = tuple(_hear(part, given) if part.block.states else part for part in recorded.parts)
        if each in quiet:
            parts = tuple(_quieten(part, each) for part in parts)
        recorded = explain(replace(recorded, parts=parts), explained)
        is_fitted = each in quiet or reads
        renewed.append(temper(each.again(recorded), settings) if is_fitted else replace(each, recorded=recorded))
    return renewed


def _explain_signals(fitted: Fit, settings: EngineSettings) -> dict[str, np.ndarray]:
    """Return the signals (n, K) without noise that a fit explains, and smooth ones at samples that do not count."""
    explained = dict[str, np.ndarray]()
    for part in fitted.recorded.parts:
        if not part.block.states or _is_unexplained(fitted.chi_square[part.name], settings):
            continue
        read = fitted.models[part.name].read(1)
        for place, signal in enumerate(part.signals):
            explained[signal], counted = read[:, place], part.counted[:, place]
            if not counted.all():
                smooth = refine(fitted.recorded.signals[signal], part.fine)
                within = np.where(counted[:, part.nearest], read[:, place], smooth[:, :part.instants])
                explained[signal] = np.concatenate([within, smooth[:, part.instants:]], axis=1)
    return explained


def _quieten(part: Part, fitted: Fit) -> Part:
    """Return a part whose measured inputs that no block gives are without the noise that it shows.

    Columns from an input with noise are biased, as the residual contains this as well. What is left of it beside its
    mean given the residual is independent of that (regression calibration: Carroll et al., Measurement Error in
    Nonlinear Models, 2006, chapter 4).
    """
    own = _list_own_inputs(part, fitted.recorded.machine)
    if not own:
        return part
    inputs, beyond, shown = dict(part.inputs), dict(part.beyond), estimate_input_noise(fitted.models[part.name], own)
    for name, noise in shown.items():
        read, noise = part.inputs[name][:, ::part.fine] + part.beyond[name], straighten(noise)
        inputs[name], beyond[name] = refine(read - noise, part.fine), noise
    return replace(part, inputs=inputs, beyond=beyond)


def _list_own_inputs(part: Part, machine: Machine) -> list[str]:
    """Return the measured inputs of a part that no block gives, by identifier: it alone tells of their noise."""
    own = {identifier_of(name) for name in machine.driving}
    return [name for name in part.noise if name in own and part.block.states]


def _hear(part: Part, given: Mapping[str, tuple[Noise, np.ndarray]]) -> Part:
    """Return a part whose measured inputs have the noise that the parts show which give them, by identifier."""
    heard = {name: given.get(name, (noise, part.input_loudness[:, place]))
             for place, (name, noise) in enumerate(part.noise.items())}
    return replace(part, noise={name: noise for name, (noise, _) in heard.items()}, input_loudness=np.stack(
        [loudness for _, loudness in heard.values()], axis=1) if heard else part.input_loudness)


def fit_bare(group: Recorded, state: State | None = None, variance: np.ndarray | None = None) -> Fit:
    """Fit a group of parts without laws, but with the errors of their curves."""
    curves = list_curves(group, {part.name: nominal_own_values(part) for part in group.parts if part.block.curves})
    return fit(group, {pair: candidate for pair, (candidate, _) in curves.items()},
               {pair: Prior(within, length=FINER) for pair, (_, within) in curves.items()}, state, variance)


def renew_noise(bare: Fit) -> Recorded:
    """Return the recordings with the noise of sensors that a fit leaves, and of measured inputs that no part explains.

    Of parts with disturbances, it leaves these as well.
    """
    return replace(bare.recorded, parts=tuple(
        estimate_disturbances(bare.models[part.name]) if part.disturbances else
        _renew_part(part, bare.models[part.name], bare.recorded) for part in bare.recorded.parts))


def _renew_part(part: Part, model: PartFit, recorded: Recorded) -> Part:
    """Return a part with the noise that its model leaves."""
    n, _, k = part.measured.shape
    loudness = np.stack([estimate_loudness(model.residual[:, place], part.counted[:, place])
                         for place in range(len(part.signals))], axis=1)[:, :, None]
    unknown = _list_own_inputs(part, recorded.machine)
    own = {identifier_of(name): Differences.of(values) for name, values in recorded.runs.signals.items()
           if identifier_of(name) in unknown}
    lags = LONGER if own else LAGS

    def carry(noise: Mapping[str, Noise]) -> np.ndarray:
        random = np.random.default_rng(0)
        drawn = model.carry({name: draw_noise(each, (n, k), random) for name, each in noise.items()})
        return np.asarray(drawn / loudness)

    every = carry(part.noise)
    others = carry({name: noise for name, noise in part.noise.items() if name not in own}) if own else every
    # States make the noise of inputs slow.
    left = SecondDifferences.of(model.residual / loudness, part.counted, lags, others,
                                every if part.noise and part.block.states else None)
    inputs = [(part.noise[name], Carried(shows, CORRELATIONS, np.array(
        [second_variances(carry({name: shows.noise(rho)}), part.counted, lags) for rho in CORRELATIONS.tolist()])))
        for name, shows in own.items()]
    sensors, estimated = estimate_residual_noise(left, part.sensors, inputs)
    whole = part.measured / loudness
    return replace(part, loudness=loudness[:, :, 0], noise={**part.noise, **dict(zip(own, estimated, strict=True))},
                   sensors=tuple(bound_noise(each, whole[:, place]) for place, each in enumerate(sensors)))


def _doubt(bare: Fit, settings: EngineSettings) -> np.ndarray:
    """Return robust deviations (n,) of the runs, by chi-square of the parts and by parameters."""
    chi = np.log(np.maximum(np.array(list(bare.chi_square.values())), _LEAST_CHI)).T
    by_squares = _deviate(chi, settings.least_spread)
    by_parameters = np.abs(_deviate(bare.state.points, bare.recorded.widest))
    return np.asarray(np.maximum(by_squares.max(axis=1), by_parameters.max(axis=1, initial=0.0)))


def _deviate(values: np.ndarray, least: np.ndarray | float) -> np.ndarray:
    """Return deviations of values (n, c) from their median in robust standard deviations of at least `least`."""
    off, spread = from_median(values)
    return np.asarray(off / np.maximum(least, spread))


def _is_unexplained(chi: np.ndarray, settings: EngineSettings) -> bool:
    """Whether runs leave more than noise: by a share, and by standard errors over the runs.

    In the mean, to which a few runs may give much, or in its logarithm, from which very different runs take little.
    """
    least = 0.25 * settings.unexplained
    return any(left.mean() > settings.errors * np.sqrt(left.var(ddof=1) / len(left) + least**2)
               for left in (chi - 1, np.log(np.maximum(chi, _LEAST_CHI))))
