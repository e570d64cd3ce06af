"""A study of a declared machine: what recordings ask for, confirmed in the simulation of the whole machine.

The whole machine is one part with the equations of all blocks, which reads no signal that it gives. It is fitted
without the findings, with them, and with a control: a law that the recordings did not ask for. What a law explains is
told by runs that it was not fitted to: their coefficients are those of all others.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain
from typing import TypeVar

import numpy as np

from slipstick.engine.doing import Doing, Log
from slipstick.engine.equations import refine
from slipstick.engine.evidence import Screened, agree, expect, hold_out, multiply, screen
from slipstick.engine.fit import Fit, join, require_solutions
from slipstick.engine.kinds import KindOfLaw, find_kinds
from slipstick.engine.laws import Candidate, list_candidates
from slipstick.engine.linear_model import solve, weigh_scatter
from slipstick.engine.loops import join_loops
from slipstick.engine.measured_law import Law, measure
from slipstick.engine.model import State
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Pair, Part, Recorded
from slipstick.engine.selection import Finding, Identification, identify
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import fit_bare, list_unexplained, settle
from slipstick.engine.simulation import simulate
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Machine, identifier_of
from slipstick.machine.digest import digest
from slipstick.machine.kinds import KINDS
from slipstick.machine.runs import Profile, Runs
from slipstick.machine.whole import compose
from slipstick.numerics.threads import in_one_blas_thread

_STATED = 0.005
"""Share of the excess that further steps of fits may promise: the share that laws close is stated in per cent."""
_OUTSIDE = 3.0
"""Standard deviations by which a mean, or a scatter, is outside of what is declared of it."""
_Tried = TypeVar("_Tried")
_TRIALS = np.errstate(over="ignore", invalid="ignore", divide="ignore")
"""Without warnings of trial steps from which equations overflow: such steps are not taken."""


@dataclass(frozen=True, eq=False)
class Gap:
    """What the simulation leaves of the runs beyond noise, in whitened squares: with laws from other runs.

    `without` and `beside` are excesses over the number of samples, without laws and with them; `closed` is the share
    that the laws explain, by runs (n,) whose own squares did not enter them. `converged` is whether both fits are so
    far that this share is known.
    """

    without: float
    beside: float
    converged: bool

    @property
    def closed(self) -> float | None:
        """Share of the excess that the laws close; None where a fit has not converged, and where there is no excess."""
        return 1 - self.beside / self.without if self.converged and self.without > 0 else None


@dataclass(frozen=True, eq=False)
class Confirmation:
    """The simulation of the whole machine with the laws: `nats` more in log marginal likelihood, `errors` of agreement.

    `laws` are those by the `fit` with them, beside a `bare` one; `gap` is closed by all findings, `control_gap` by the
    law `control`.
    """

    nats: float
    errors: float
    laws: tuple[Law, ...]
    gap: Gap
    control: Pair
    control_gap: Gap
    bare: Fit
    fit: Fit


@dataclass(frozen=True)
class ParameterEstimate:
    """The mean over the runs of a parameter, its standard error, its scatter between runs, and its `nominal` value.

    All are in its unit. It is `known` where the recordings have told more than what was known before, and `beyond`
    where the mean is outside of three standard deviations of that, or the scatter above the declared one by as much. A
    mean that recordings ask to be further away is held there, and has the error of what was known before.
    """

    name: str
    mean: float
    error: float
    scatter: float
    known: bool
    beyond: bool
    nominal: float


@dataclass(frozen=True)
class ConditionEstimate:
    """How far the stated values of the condition `name` are off, as a share of them.

    `error` is that of the level, or of the drift over the run order, that is off most for what is declared, and
    `scatter` the standard deviation between runs. It is `beyond` as a parameter is.
    """

    name: str
    error: float
    scatter: float
    beyond: bool


@dataclass(frozen=True, eq=False)
class MachineStudy:
    """What recordings of a machine ask for, the measured `laws`, and how the whole machine confirms them.

    `kinds` are those of the laws that a kind explains as well; a law without one stays a measured law. `parameters`
    belong to the measured laws, and `parameters_beside_kinds` to the equations of the kinds: what a parameter and a law
    share, such as the line of a law, they may share otherwise. `apart` are the law and the kind of what runs that are
    set aside ask for, if they ask for any.
    `confirmation` is missing where nothing was found that the whole machine can have: errors of sensors change nothing
    of it, and it is driven by no measured signal. The `digest` is that of settings, machine and kinds.
    """

    machine: Machine
    identification: Identification
    laws: tuple[Law, ...]
    kinds: tuple[KindOfLaw, ...]
    parameters: tuple[ParameterEstimate, ...]
    parameters_beside_kinds: tuple[ParameterEstimate, ...]
    apart: tuple[tuple[Law, ...], tuple[KindOfLaw, ...]]
    confirmation: Confirmation | None
    digest: str
    seconds: float

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The findings, the first one first."""
        return self.identification.findings

    def simulate(self, time: np.ndarray, commands: Mapping[str, Profile],
                 values: Mapping[str, float | np.ndarray]) -> dict[str, np.ndarray]:
        """Return the signals (n, k) of the machine that is extended by the laws, at estimated parameters.

        `values` are conditions, and parameters that are to be others.
        """
        estimated = {each.name: each.mean for each in self.parameters}
        return simulate(self.machine, time, commands, {**estimated, **values}, self.laws)


@_TRIALS
@in_one_blas_thread
def study(machine: Machine, runs: Runs, values: Mapping[str, float] | None = None,
          settings: EngineSettings | None = None, log: Log = lambda _: None,
          keep: Callable[[MachineStudy], None] = lambda _: None, executor: Executor | None = None) -> MachineStudy:
    """Find what `runs` ask for beside a machine with nominal `values`, and confirm it in the whole machine.

    `keep` is called with the study that there is before runs that are set aside are searched, and with that before the
    confirmation. The `executor` computes with chunks of many runs (`Recorded`).
    """
    began, settings, tell = time.perf_counter(), settings or EngineSettings(), cache(_tell_laws)

    def state(named: Identification) -> MachineStudy:
        laws, kinds = tell(named.findings, named.fits)
        beside = [of_fit[-1].fit if of_fit else each for each, of_fit in zip(named.fits, kinds, strict=True)]
        apart, kinds_apart = ((), []) if named.apart is None else _tell_laws(named.apart.findings, named.apart.fits)
        return MachineStudy(machine, named, laws, tuple(chain(*kinds)), estimate_parameters(join(named.fits)),
                            estimate_parameters(join(beside)), (apart, tuple(chain(*kinds_apart))), None,
                            digest(settings, machine, KINDS), time.perf_counter() - began)

    named = identify_runs(machine, runs, values, settings, log, executor, lambda named: keep(state(named)))
    studied = state(named)
    if not named.findings:
        return studied
    keep(studied)
    confirmation = _confirm(machine, runs, values, named, log)
    return replace(studied, confirmation=confirmation, seconds=time.perf_counter() - began)


def _tell_laws(findings: tuple[Finding, ...],
               fits: tuple[Fit, ...]) -> tuple[tuple[Law, ...], list[tuple[KindOfLaw, ...]]]:
    """Return the measured laws of the findings, and the kinds of those of each fit."""
    pairs = [[finding.pair for finding in findings if finding.pair in each.laws] for each in fits]
    measured = {pair: measure(each, pair) for each, of_fit in zip(fits, pairs, strict=True) for pair in of_fit}
    return (tuple(measured[finding.pair] for finding in findings),
            [tuple(find_kinds(each, of_fit)) for each, of_fit in zip(fits, pairs, strict=True)])


@_TRIALS
@in_one_blas_thread
def identify_runs(machine: Machine, runs: Runs, values: Mapping[str, float] | None = None,
                  settings: EngineSettings | None = None, log: Log = lambda _: None, executor: Executor | None = None,
                  keep: Callable[[Identification], None] = lambda _: None) -> Identification:
    """Find what `runs` ask for in a machine; blocks that read each other's signals are simulated together.

    Where that leaves more than noise, something disturbs the machine that is neither known nor named, and reaches all
    signals: the blocks are studied apart, each driven by what was measured of the others.
    """
    began = time.perf_counter()
    named = _explain(machine, runs, values, executor, log, lambda recorded: identify(recorded, settings, log, keep),
                     lambda tried: tried.unexplained)
    return replace(named, seconds=time.perf_counter() - began)


@_TRIALS
@in_one_blas_thread
def require_solved(machine: Machine, runs: Runs) -> None:
    """Raise `InvalidValue` where equations that are driven by `runs` have no finite solution at nominal parameters."""
    require_solutions(prepare(join_loops(machine, runs), runs))


def _explain(machine: Machine, runs: Runs, values: Mapping[str, float] | None, executor: Executor | None, log: Log,
             attempt: Callable[[Recorded], _Tried], list_left: Callable[[_Tried], Sequence[str]]) -> _Tried:
    """Return an attempt with the loops of a machine joined, or one with its blocks apart where the first leaves more
    than noise."""
    joined = join_loops(machine, runs, values)
    tried = attempt(replace(prepare(joined, runs, values), executor=executor))
    if joined is not machine and list_left(tried):
        log(Doing("fit", "More than noise is left of what is simulated together: the blocks are studied apart"))
        tried = attempt(replace(prepare(machine, runs, values), executor=executor))
    return tried


@_TRIALS
@in_one_blas_thread
def fit_parameters(machine: Machine, runs: Runs, log: Log = lambda _: None, executor: Executor | None = None) -> Fit:
    """Return the fit of the parameters of a machine to `runs` without any law."""
    settings = EngineSettings()
    return join(_explain(machine, runs, None, executor, log, lambda recorded: settle(recorded, settings, log),
                         lambda fits: list_unexplained(fits, settings)))


def estimate_parameters(fit: Fit) -> tuple[ParameterEstimate, ...]:
    """Return the estimates of the parameters of a fit, in their units."""
    estimates, recorded, terms = list[ParameterEstimate](), fit.recorded, fit.recorded.terms
    scatter, held = np.append(np.sqrt(fit.fitted.variance), np.zeros(len(recorded.shared))), fit.fitted.held
    for place, term in enumerate(terms):
        declared = {each.name: each for each in recorded.machine.parameters}.get(term.name)
        if declared is None:
            continue
        nominal = next(part.parameters[term.place] for part in recorded.parts if term.place in part.parameters).mean()
        mean = fit.fitted.coefficients[place]
        error = term.std if held[place] else np.sqrt(fit.fitted.covariance[place, place])
        is_beyond = _is_far_off(fit, place, declared.within) or (
            place < len(recorded.random) and _is_scattered(fit, place, declared.scatter))
        estimated = float(nominal * np.exp(mean) if term.is_factor else nominal + term.size * mean)
        size = abs(estimated) if term.is_factor else term.size
        estimates.append(ParameterEstimate(term.name, estimated, float(size * error), float(size * scatter[place]),
                                           bool(error < 0.7 * term.std), is_beyond, float(nominal)))
    return tuple(estimates)


def estimate_conditions(fit: Fit) -> tuple[ConditionEstimate, ...]:
    """Return how far stated conditions are off."""
    estimates, count = list[ConditionEstimate](), len(fit.recorded.random)
    for condition in fit.recorded.machine.conditions:
        places = [place for place, term in enumerate(fit.recorded.terms) if term.place == identifier_of(condition.name)]
        errors = {place: float(fit.fitted.coefficients[place]) for place in places if place >= count}
        scatters = [place for place in places if place < count]
        beyond = (any(_is_far_off(fit, place, condition.within) for place in errors)
                  or any(_is_scattered(fit, place, condition.scatter) for place in scatters))
        estimates.append(ConditionEstimate(
            condition.name, max(errors.values(), key=abs, default=0.0),
            float(np.sqrt(fit.fitted.variance[scatters].sum())), beyond))
    return tuple(estimates)


def _is_far_off(fit: Fit, place: int, within: float) -> bool:
    """Return whether the mean of a term is outside of what is declared of it, or held at the end of that."""
    away = fit.fitted.coefficients[place] - fit.recorded.terms[place].target
    return bool(fit.fitted.held[place] or abs(away) > _OUTSIDE * within)


def _is_scattered(fit: Fit, place: int, most: float) -> bool:
    """Return whether runs tell that a random term scatters by more than `most`."""
    return bool(np.sqrt(fit.fitted.variance[place]) > most > 0
                and weigh_scatter(fit.fitted, place, most) > 0.5 * _OUTSIDE**2)


def _confirm(machine: Machine, runs: Runs, values: Mapping[str, float] | None, named: Identification,
             log: Log) -> Confirmation | None:
    log(Doing("simulate", "Fitting the whole machine without laws"))
    blocks = join(named.fits)
    whole = prepare(compose(machine), runs, values, is_free=True).take(blocks.recorded.rows)
    noise = {signal: part.sensors[place] for part in blocks.recorded.parts for place, signal in enumerate(part.signals)}
    loud = {signal: part.loudness[:, place] for part in blocks.recorded.parts
            for place, signal in enumerate(part.signals)}
    part = whole.parts[0]
    disturbances = {name: noise for each in blocks.recorded.parts for name, noise in each.disturbances.items()}
    part = replace(_hear_inputs(part, blocks.recorded.parts), disturbances=disturbances,
                   sensors=tuple(noise[name] for name in part.signals),
                   loudness=np.stack([loud[name] for name in part.signals], axis=1))
    whole = replace(whole, parts=(part,), signals=blocks.recorded.signals, executor=blocks.recorded.executor)
    start, variance = _begin_whole(whole, blocks)
    bare = fit_bare(whole, start, variance)
    candidates = {each.pair: each for each in list_candidates(whole, {part.name: bare.models[part.name].own()})}
    laws = {pair: candidates[pair].with_knots(law) for pair, law in blocks.laws.items() if pair in candidates}
    if not laws:
        return None
    log(Doing("extend", f"Fitting the whole machine with laws; without them, {_remark(bare)}"))
    estimated = replace(start, laws={**bare.state.laws, **{pair: blocks.state.laws[pair] for pair in laws}})
    priors = {pair: blocks.priors[pair] for pair in laws}
    # From the optimum without the laws, and from what the blocks have estimated: the better one.
    with_laws = bare.beside(laws, priors, bare.state)
    with suppress(InvalidValue):  # by laws of blocks, which were driven by recordings, the whole may grow without bound
        with_laws = max(bare.beside(laws, priors, estimated), with_laws, key=lambda each: each.evidence)
    gains, without = hold_out(with_laws.fitted) - hold_out(bare.fitted), _excess(bare)
    expected = np.sqrt(sum(expect(with_laws, law) ** 2 for law in laws.values()))
    control = _choose_control(bare, list(candidates.values()), named.findings)
    log(Doing("control", f"Fitting the whole machine with the control {' over '.join(control.candidate.pair)}; "
                         f"with the laws, {with_laws.evidence - bare.evidence:.1f} nats and {_remark(with_laws)}"))
    with_control = bare.beside({control.candidate.pair: control.candidate}, {control.candidate.pair: control.prior})
    return Confirmation(with_laws.evidence - bare.evidence, agree(gains, expected),
                        tuple(measure(with_laws, pair) for pair in laws), _compare(without, bare, with_laws),
                        control.candidate.pair, _compare(without, bare, with_control), bare, with_laws)


def _remark(fit: Fit) -> str:
    chi = np.median(list(fit.chi_square.values()))
    return f"chi-square {chi:.2f}" + ("" if fit.converged else ", not converged")


def _begin_whole(whole: Recorded, blocks: Fit) -> tuple[State, np.ndarray]:
    """Return the state of the whole machine with what the blocks have estimated, and the variances."""
    random = {term.name: place for place, term in enumerate(blocks.recorded.random)}
    shared = {term.name.partition(" in ")[0]: value
              for term, value in zip(blocks.recorded.shared, blocks.state.shared, strict=True)}
    places = [random[term.name] for term in whole.random]
    values = np.array([shared.get(term.name.partition(" in ")[0], term.target) for term in whole.shared])
    state = State(blocks.state.points[:, places], blocks.state.means[places], values, {})
    return state, blocks.fitted.variance[places]


def _hear_inputs(part: Part, blocks: Sequence[Part]) -> Part:
    """Return a part whose measured inputs have the noise that the `blocks` show, and are without it as far as there."""
    noise, inputs, beyond, loudness = dict(part.noise), dict(part.inputs), dict(part.beyond), list[np.ndarray]()
    for name in noise:
        block = next(each for each in blocks if name in each.noise)
        noise[name], samples = block.noise[name], block.beyond[name].shape[1]
        loudness.append(block.input_loudness[:, list(block.noise).index(name)])
        read = inputs[name][:, ::part.fine].copy()  # the whole machine goes on to the end of the recordings
        read[:, :samples], beyond[name] = block.inputs[name][:, ::block.fine], beyond[name].copy()
        inputs[name], beyond[name][:, :samples] = refine(read, part.fine), block.beyond[name]
    return replace(part, noise=noise, inputs=inputs, beyond=beyond,
                   input_loudness=np.stack(loudness, axis=1) if loudness else part.input_loudness)


def _choose_control(bare: Fit, candidates: Sequence[Candidate], findings: Sequence[Finding]) -> Screened:
    """Return the candidate of other quantities that gains as much as half of them: a wrong law, chosen blindly.

    Where findings and their rivals are of all quantities, it is one of their other dependences.
    """
    named = {pair for finding in findings for pair in (finding.pair, *finding.rivals)}
    quantities = {pair[0] for pair in named}
    others = [each for each in candidates if each.pair[0] not in quantities] or [
        each for each in candidates if each.pair not in named]
    screened = screen(bare, others, multiply(bare.models, others))
    return screened[len(screened) // 2]


def _compare(without: float, bare: Fit, extended: Fit) -> Gap:
    promised = 2 * (abs(bare.promised) + abs(extended.promised))
    converged = (bare.converged and extended.converged) or promised < _STATED * without
    return Gap(without, _excess(extended), converged)


def _excess(fit: Fit) -> float:
    """Return whitened squares beyond the number of samples, of all runs with coefficients from the other runs."""
    gram, fitted = fit.fitted.gram, fit.fitted
    total, squares, random = fitted.marginal.sum(axis=0), 0.0, gram.random
    spread = fitted.spread
    for i in range(len(fitted.marginal)):
        c = solve(gram, total - fitted.marginal[i]).coefficients
        pull = gram.products[i, :random, -1] - gram.products[i, :random, :-1] @ c
        left = np.append(-c, 1.0)
        left[:random] -= spread[i] @ pull
        squares += float(left @ gram.products[i] @ left)
    counted = sum(model.part.counted.sum() for model in fit.models.values())
    return squares - float(counted)
