"""Which laws recordings ask for: forward selection by evidence and by agreement of the runs, and then backward."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from slipstick.engine.apart import allow, fit_apart
from slipstick.engine.approach import approach_each
from slipstick.engine.doing import Doing, Log
from slipstick.engine.evidence import FEWEST, Screened, agree, agree_without_best, expect, hold_out, multiply, screen
from slipstick.engine.fit import HOPED, SETTLED, Fit, fit, join, join_recorded
from slipstick.engine.laws import CONSTANT, Candidate, list_candidates
from slipstick.engine.recordings import Pair, Recorded
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import RENEWED, are_like, find_outlying, list_unexplained, renew, settle, temper
from slipstick.errors import InvalidValue
from slipstick.numerics.threads import in_one_blas_thread

_ROUGH = 0.005
"""Nats that a step of a trial may still promise, over those that its candidate gains by a linear model."""
_TIED = 0.8
"""Share of the nats of the best candidate below which another one is not fitted to the end."""
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


def is_rival(lead: Lead, nats: float, settings: EngineSettings) -> bool:
    """Return whether a law that gains `nats` is not told apart from another one that asks to be named.

    Laws that do nearly the same may differ by nearly nothing, but alike in all runs.
    """
    return lead.nats > settings.nats and (lead.errors < settings.apart
                                          or nats - lead.nats < 0.5 * settings.apart**2)


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
    A law that some of the runs set aside ask for, and all others do not, is `apart`.
    """

    findings: tuple[Finding, ...]
    fits: tuple[Fit, ...]
    bare: tuple[Fit, ...]
    set_aside: tuple[int, ...]
    unexplained: tuple[str, ...]
    seconds: float
    apart: "Identification | None" = None

    @property
    def rows(self) -> np.ndarray:
        """The numbers of the runs that are used."""
        return self.bare[0].recorded.rows


@in_one_blas_thread
def identify(recorded: Recorded, settings: EngineSettings | None = None, log: Log = lambda _: None,
             keep: Callable[[Identification], None] = lambda _: None) -> Identification:
    """Find the laws that recordings ask for, in all parts, and then the law of runs that are set aside.

    `keep` is called with what all others ask for before runs that are set aside are searched.

    Runs that are far worse than all others with these laws as well are set aside, and the others are searched again.
    A law that explains runs that are set aside may be one of all runs, if the others do not get to where it acts: it is
    one if they allow it, if it is named in all of them together as well, and if no run is far worse then.
    """
    began, settings = time.perf_counter(), settings or EngineSettings()
    named = _search(settle(recorded, settings, log), settings, log)
    left = find_outlying(named.fits, settings)
    if len(left):
        log(Doing("fit", f"No law explains {len(left)} runs, which are far worse than the others: these are searched "
                         "again without them"))
        is_other = np.isin(recorded.rows, np.delete(named.rows, left))
        named = _search(settle(recorded.take(is_other), settings, log), settings, log)
    aside = np.flatnonzero(~np.isin(recorded.rows, named.rows))
    named = replace(named, set_aside=tuple(recorded.rows[aside].tolist()), seconds=time.perf_counter() - began)
    if len(aside) < FEWEST:
        return named
    keep(named)
    apart, may_be_general = None, False
    with suppress(InvalidValue, np.linalg.LinAlgError):  # with what others tell, bad runs may have no finite solution
        apart = _identify_apart(recorded, aside, named.fits, settings, log)
        may_be_general = apart is not None and allow(recorded, named.fits, apart.fits, apart.findings[0].pair)
    if apart is not None and may_be_general:
        log(Doing("fit", f"{' over '.join(apart.findings[0].pair)} explains {len(apart.rows)} of these: all others are "
                         "searched again together with them"))
        together = recorded.take(np.isin(recorded.rows, [*named.rows, *apart.rows]))
        general = _search(settle(together, replace(settings, most_outlying=0.0)),
                          replace(settings, most=len(named.findings) + 1), log)
        pairs = {pair for finding in general.findings for pair in (finding.pair, *finding.rivals)}
        if apart.findings[0].pair in pairs and not len(find_outlying(general.fits, settings)):
            named = replace(general, set_aside=tuple(np.setdiff1d(recorded.rows, general.rows).tolist()))
            apart = None
    return replace(named, apart=apart, seconds=time.perf_counter() - began)


def _identify_apart(recorded: Recorded, rows: np.ndarray, others: Sequence[Fit], settings: EngineSettings,
                    log: Log) -> Identification | None:
    """Find the law that the runs `rows` ask for beside what others have told; None where these runs do not agree.

    With it, they are like the others: errors of recordings differ from run to run, and a law may be fitted to them.
    """
    while len(rows) >= FEWEST:
        log(Doing("fit", f"Looking at the {len(rows)} runs that are set aside"))
        bare = fit_apart(recorded, rows, others, settings)
        named = _search(bare, replace(settings, most=1), log)
        if not named.findings:
            break
        shown = np.sqrt(2 * np.maximum(named.findings[0].gains, 0.0)) > settings.errors
        is_explained = are_like(named.fits, others, settings) & shown
        if is_explained.all():
            return named
        rows = rows[is_explained]
    return None


def _search(bare: Sequence[Fit], settings: EngineSettings, log: Log) -> Identification:
    """Find the laws that the runs of fits without further laws ask for."""
    began, search = time.perf_counter(), _Search(settings, log, {_name(each): each for each in bare})
    while search.step():
        pass
    fits = tuple(search.fits.values())
    return Identification(tuple(search.findings), fits, tuple(bare), (), list_unexplained(fits, settings),
                          time.perf_counter() - began)


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
        are_set_aside = any(each.recorded.set_aside for each in fits.values())
        self.agree = agree_without_best if are_set_aside else agree
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
        leads = tuple(self._lead(best, trial) for trial in trials if trial is not best)
        self.findings.append(replace(best.finding, leads=leads, rivals=tuple(
            each.pair for each in leads if is_rival(each, best.finding.nats, self.settings))))
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
        for _ in range(RENEWED):  # with the law, the part explains its signals, and shows their noise
            better = renew([better], [better], self.settings)[0]
        last, better = self.findings[-1], self._drop_redundant(better)
        # Other groups read its signals, or have candidates over them.
        others = list(self.fits.values())
        for before, after in zip(others, renew(others, [better], self.settings), strict=True):
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
        errors = self.agree(hold_out(better.fitted) - hold_out(rest.fitted), expect(better, better.laws[pair]))
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
        finding = Finding(pair, full.evidence - base.evidence, self.agree(gains, expected), (), gains)
        return _Trial(finding, full, base, groups, expected)

    def _say(self, words: str) -> None:
        self.log(Doing("search", words))

    def _lead(self, best: _Trial, other: _Trial) -> Lead:
        return Lead(other.finding.pair, other.finding.nats,
                    self.agree(best.finding.gains - other.finding.gains, best.expected))

    def _is_enough(self, trial: _Trial) -> bool:
        before = [finding.nats for finding in self.findings if finding.pair in trial.base.laws]
        # What the fit without the law has not reached is no merit of the law.
        least = max([self.settings.nats, *(self.settings.further * nats for nats in before)]) + trial.base.promised
        return trial.finding.nats > least and trial.finding.errors > self.settings.errors
