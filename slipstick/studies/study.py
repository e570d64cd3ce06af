"""The study: what recordings ask for beside the model of their bench, and what it changes to add it.

    named = examine(settings, bench, recordings)
    result, figures = conclude(settings, bench, recordings, named)

Both take some seconds to a minute. What `examine` returns is JSON, complete, and the same after a restart. If there is
no time for `conclude`, or for all of `examine`, `unconfirmed` says what was named so far.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.bench import Bench
from slipstick.bench import parameters as names_of
from slipstick.clutch import effects
from slipstick.clutch.laws import MOST_LAWS, MeasuredLaw
from slipstick.confirmation.control import control
from slipstick.confirmation.fit import SimulationFit, best, confirmed, fit_simulation, with_scatter_of
from slipstick.confirmation.further import further
from slipstick.confirmation.gap import Prediction, closures, predict
from slipstick.confirmation.measured import with_measured_laws
from slipstick.confirmation.simulated import CONDITIONS, RANDOM
from slipstick.confirmation.terms import Terms
from slipstick.confirmation.traces import Traces
from slipstick.naming import name
from slipstick.naming.answer import Answer
from slipstick.naming.record import from_json, to_json
from slipstick.naming.scene import Scene
from slipstick.naming.selection import is_enough
from slipstick.naming.study import Naming
from slipstick.numerics.threads import in_one_blas_thread
from slipstick.plausibility.mismatch import require_match
from slipstick.recordings import Recordings
from slipstick.recordings.fitness import require_one_clock
from slipstick.recordings.signals import open_blocks
from slipstick.studies.conditions import by_level, with_measured
from slipstick.studies.confidence import are_reported
from slipstick.studies.figures import Figures, figures, figures_without_fits
from slipstick.studies.findings import AnsweredFinding, answer_findings, finding_result, remainder, unconfirmed_result
from slipstick.studies.progress import Log, StudySteps
from slipstick.studies.result import (
    BeyondParameter,
    BlockResult,
    Control,
    FindingResult,
    FurtherExperiment,
    Gap,
    Remainder,
    SimulationResult,
)
from slipstick.studies.result import StudyResult as Result
from slipstick.studies.settings import StudySettings
from slipstick.studies.untested import closed_blocks, examine_untested
from slipstick.studies.words import SIGNALS, partial_sentence, sentence
from slipstick.time_budget import Partial, TimeBudgetEnded

_NOMINAL_LOSSES = ("input_inertia", "input_coulomb", "input_viscous")
"""Parameters that start at nominal: those that the input block finds also stand for other small errors of it, and with
losses that are too small the converter drives the input shaft beyond the motor."""
_BEGINNINGS = 5
"""Times that the fits of the simulation begin at most."""


def examine(settings: StudySettings, bench: Bench, recordings: Recordings, log: Log = lambda _: None,
            keep: Callable[[dict[str, Any]], None] = lambda _: None) -> dict[str, Any]:
    """Name what the blocks ask for, as JSON.

    `keep` is called with what was named so far, for `unconfirmed`, in case that the time budget ends before. Raises
    `InvalidValue` for recordings that cannot be of the bench or say too little.
    """
    if recordings.signals is not None:
        require_one_clock(recordings)  # first, as levels at other times would seem to have other units
    require_match(recordings, bench)
    return to_json(name(bench, recordings, settings.naming, _steps(recordings, log).report_naming,
                        lambda naming: keep(to_json(naming))))


@in_one_blas_thread
def conclude(settings: StudySettings, bench: Bench, recordings: Recordings, named: dict[str, Any],
             log: Log = lambda _: None) -> tuple[Result, Figures]:
    """Confirm in the simulation what `examine` has named, and say what it is worth."""
    naming = from_json(named)
    reported, left_over = _split_reported(settings, naming)
    naming = replace(naming, findings=tuple(answered.finding for answered in reported))
    answers = [answered.said for answered in reported]
    traces, points = _traces(settings, bench, recordings, naming)
    doing = _steps(recordings, log).report_confirming
    terms = _terms(bench, naming, answers)
    doing("fit", "Fitting the simulation of the whole bench" + (" without and with the findings" if answers else ""))
    measured = {answer.effect: naming.measured[answer.pair].simulated() for answer in answers
                if answer.effect and answer.pair in naming.measured}
    laws = {name: law for name, law in measured.items() if law is not None}
    before, formulas, after, without = _fits(settings, traces, terms, laws, points)
    doing("compare", "Comparing with the effects that the recordings do not tell apart")
    experiments, rest = [_experiments(answer, after) for answer in answers], examine_untested(settings, after)
    results = [finding_result(settings, answered, naming.measured.get(answered.finding.pair), formulas, after,
                              further_experiments)
               for answered, further_experiments in zip(reported, experiments, strict=True)]
    doing("predict", "Predicting held-out conditions")
    gap, is_extended = None, bool(after.block.terms.names)
    if is_extended:
        # What predicts best without the findings is what they are compared with.
        tried = [(fit, predict(fit, settings.seed)) for fit in without]
        before, wide = min(tried, key=lambda attempt: attempt[1].total(traces))
        predictions = {"before": wide, "after": predict(after, settings.seed)}
        gap = _gap(settings, before, predictions, [finding.pair[0] for finding in naming.findings])
    else:
        predictions = {"before": predict(before, settings.seed)}
    kind = "several" if len(results) > 1 else results[0].kind if results else \
        "unlisted" if naming.lacking or rest.misfits else "none"
    beyond = [BeyondParameter(name, *change) for name, change in naming.beyond.items()]
    answer = sentence(results, naming.unexplained, naming.outlying, left_over, bool(naming.chi_square),
                      traces.scene.missing, rest.misfits, rest.explanations, beyond)
    result = Result(
        kind, answer, results, _block_results(naming, results), list(naming.set_aside), _simulation(before),
        _simulation(after), gap, len(traces.scene), _noise(traces.scene), recordings.digest, settings.digest,
        rest.closed, traces.scene.unused, list(by_level(traces.scene.recordings.conditions, traces.conditions)),
        left_over, rest.explanations, rest.times, beyond=beyond)
    return result, figures(before, after if is_extended else None, predictions,
                           recordings.conditions.take(list(naming.set_aside)))


@in_one_blas_thread
def unconfirmed(settings: StudySettings, bench: Bench, recordings: Recordings, named: dict[str, Any] | None,
                budget: float) -> tuple[Result, Figures]:
    """The partial result of what has been `named` when the time `budget` in s ended, without the simulation.

    Raises `TimeBudgetEnded` if no block has been examined.
    """
    can = open_blocks(() if recordings.signals is None else recordings.signals.names)
    if named is None or not can:
        raise TimeBudgetEnded.before(budget, "a block of the model was examined" if can else
                                     "the simulation of the whole bench was fitted")
    naming = from_json(named)
    reported, left_over = _split_reported(settings, naming)
    results = [unconfirmed_result(settings, answered, naming.measured.get(answered.finding.pair))
               for answered in reported]
    scene = _scene(settings, bench, recordings, naming)
    missing = [_block_title(block) for block in can if block not in naming.chi_square]
    if not (naming.is_complete or missing):
        missing = ["the rest of the examination of the blocks"]
    partial = Partial(budget, [_block_title(block) for block in naming.chi_square],
                      [*missing, "the simulation of the whole bench, and with it coefficients, size and gap"])
    kind = "several" if len(results) > 1 else results[0].kind if results else "unlisted" if naming.lacking else "open"
    conditions = with_measured(scene.recordings.conditions, naming.parameters)
    result = Result(
        kind, partial_sentence(results, naming.unexplained, naming.outlying, left_over), results,
        _block_results(naming, results), list(naming.set_aside), None, None, None, len(scene), _noise(scene),
        recordings.digest, settings.digest, closed_blocks(scene.missing), scene.unused,
        list(by_level(scene.recordings.conditions, conditions)), left_over, partial=partial)
    return result, figures_without_fits(scene.recordings, recordings.conditions.take(list(naming.set_aside)))


def _split_reported(settings: StudySettings, naming: Naming) -> tuple[list[AnsweredFinding], list[Remainder]]:
    """The findings that are reported, and what the others are called."""
    findings = answer_findings(settings, naming)
    reported = are_reported([answered.evidence for answered in findings],
                            [answered.finding.nats for answered in findings])
    return ([answered for answered, is_reported in zip(findings, reported, strict=True) if is_reported],
            [remainder(answered) for answered, is_reported in zip(findings, reported, strict=True) if not is_reported])


def _block_results(naming: Naming, results: list[FindingResult]) -> list[BlockResult]:
    return [BlockResult(block, SIGNALS[block], value, [result.title for result in results if block in result.blocks],
                        block in naming.unexplained, list(naming.outlying.get(block, ())))
            for block, value in naming.chi_square.items()]


def _block_title(name: str) -> str:
    return f"the block “{SIGNALS[name]}”"


def _noise(scene: Scene) -> dict[str, float]:
    """Standard deviation of the noise of each signal in its unit, and of the shifting time in s."""
    return {**{signal: std for signal, (std, _) in scene.noise.items()}, "shifting_time": scene.timer_noise}


def _fits(settings: StudySettings, traces: Traces, terms: Terms, laws: Mapping[str, MeasuredLaw],
          points: np.ndarray) -> tuple[SimulationFit, SimulationFit, SimulationFit, list[SimulationFit]]:
    """The fits without and with `terms`, the latter also with measured `laws`, and those without its terms and scatter.

    The last ones are nested in the fit with the laws. If one of them is above it, that fit has ended in a local
    maximum, and all of them begin again there. If that does not end, the simulation does not ask for the terms.
    """
    def is_sufficient(gain: np.ndarray) -> bool:
        return is_enough(gain, settings.naming)

    for _ in range(_BEGINNINGS):
        before, formulas = confirmed(traces, terms, points, is_sufficient)
        after = with_measured_laws(formulas, before, laws, points, is_sufficient)
        without = with_scatter_of(after, before) if after.block.terms.names else []
        higher = best([after, *without])
        if higher is after:
            return before, formulas, after, without
        points = higher.fitted.points
    return higher, higher, higher, []


def _steps(recordings: Recordings, log: Log) -> StudySteps:
    return StudySteps(() if recordings.signals is None else recordings.signals.names, log)


def _traces(settings: StudySettings, bench: Bench, recordings: Recordings,
            naming: Naming) -> tuple[Traces, np.ndarray]:
    """The recordings that were not set aside, and the parameters (n, q) at which their simulations start."""
    scene = _scene(settings, bench, recordings, naming)
    nominal = np.zeros(len(scene))
    kept = {*_NOMINAL_LOSSES, *CONDITIONS}.difference(naming.beyond)
    starts = [nominal if name in kept else naming.parameters.get(name, nominal) for name in RANDOM]
    conditions = with_measured(scene.recordings.conditions, naming.parameters)
    return Traces.of(scene, naming.clocks, naming.converter, conditions, naming.beyond), np.stack(starts, axis=1)


def _scene(settings: StudySettings, bench: Bench, recordings: Recordings, naming: Naming) -> Scene:
    """The recordings that were not set aside, with the noise that was found."""
    whole = Scene.of(bench, recordings, settings.naming)
    return replace(whole.take(np.setdiff1d(np.arange(len(whole)), naming.set_aside)), noise=naming.noise)


def _terms(bench: Bench, naming: Naming, answers: list[Answer]) -> Terms:
    """The named effects, and the measured laws of what has no name."""
    named = dict.fromkeys(answer.effect for answer in answers if answer.effect)
    laws = [naming.measured[answer.pair].simulated() for answer in answers
            if not answer.effect and answer.pair in naming.measured]
    return Terms(bench, tuple(named), tuple(law for law in laws if law is not None)[:MOST_LAWS])


def _experiments(answer: Answer, after: SimulationFit) -> list[FurtherExperiment]:
    """Experiments that tell the effect of an answer from those that are tied with it."""
    experiments, terms = [], after.block.terms
    known = {effect.name for effect in effects.CATALOGUE}
    for rival in answer.others:
        if answer.effect not in terms.effects or rival not in known or rival in terms.effects:
            continue
        swapped = replace(terms, effects=tuple(rival if name == answer.effect else name for name in terms.effects))
        other = fit_simulation(after.block.traces, swapped, after.fitted.points)
        experiments += further(after, other, rival)
    return experiments


def _gap(settings: StudySettings, before: SimulationFit, predictions: dict[str, Prediction],
         quantities: list[str]) -> Gap:
    """The gap before and after, and what the best effect on another quantity closes of it."""
    wide, narrow = predictions["before"], predictions["after"]
    spent = control(before, quantities)
    control_result = None
    if spent is not None:
        other = predict(spent[1], settings.seed)
        # What a right model would leave is the findings' to say, of the control as well.
        comparable = Prediction(other.channels, other.square, narrow.variance, other.time)
        control_result = Control(spent[0], closures(wide, comparable, settings.seed))
    return Gap(closures(wide, narrow, settings.seed), wide.time.tolist(), narrow.time.tolist(), control_result)


def _simulation(fit: SimulationFit) -> SimulationResult:
    """A fit as a result; its model has the mean parameters."""
    block = fit.block
    values = block.scene.base.copy()
    for parameter, change in fit.parameters.items():
        if parameter not in CONDITIONS:
            values[names_of.index(parameter)] *= 1 + change
    return SimulationResult(fit.parameters, fit.scatter, fit.chi_square, float(fit.evidence.sum()),
                            fit.fitted.converged, block.terms.model(fit.values, tuple(values.tolist())).spec(),
                            fit.errors, fit.at_bound, fit.undetermined)
