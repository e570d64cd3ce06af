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
from slipstick.confirmation.fit import SimulationFit, best, confirmed, fit_simulation, polished, with_scatter_of
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
from slipstick.recordings.signals import open_blocks
from slipstick.studies.conditions import by_level, with_measured
from slipstick.studies.confidence import are_reported
from slipstick.studies.figures import Figures, figures, figures_without_fits
from slipstick.studies.findings import Judged, finding_result, judged, remainder, unconfirmed_result
from slipstick.studies.progress import Log, StudySteps
from slipstick.studies.result import (
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
from slipstick.studies.untested import closed_blocks, untested
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
    require_match(recordings, bench)
    return to_json(name(bench, recordings, settings.naming, _steps(recordings, log).asked,
                        lambda found: keep(to_json(found))))


@in_one_blas_thread
def conclude(settings: StudySettings, bench: Bench, recordings: Recordings, named: dict[str, Any],
             log: Log = lambda _: None) -> tuple[Result, Figures]:
    """Confirm in the simulation what `examine` has named, and say what it is worth."""
    found = from_json(named)
    reported, left_over = _reported(settings, found)
    found = replace(found, findings=tuple(one.finding for one in reported))
    answers = [one.said for one in reported]
    traces, points = _traces(settings, bench, recordings, found)
    doing = _steps(recordings, log).confirming
    terms = _terms(bench, found, answers)
    doing("fit", "Fitting the simulation of the whole bench" + (" without and with the findings" if answers else ""))
    measured = {one.effect: found.measured[one.pair].simulated() for one in answers
                if one.effect and one.pair in found.measured}
    laws = {name: law for name, law in measured.items() if law is not None}
    before, formulas, after, without = _fits(settings, traces, terms, laws, points)
    doing("compare", "Comparing with the effects that the recordings do not tell apart")
    experiments, rest = [_experiments(one, after) for one in answers], untested(settings, after)
    results = [finding_result(settings, one, found.measured.get(one.finding.pair), formulas, after, its)
               for one, its in zip(reported, experiments, strict=True)]
    doing("predict", "Predicting held-out conditions")
    gap, is_extended = None, bool(after.block.terms.names)
    if is_extended:
        # What predicts best without the findings is what they are compared with.
        tried = [(one, predict(one, settings.seed)) for one in without]
        before, wide = min(tried, key=lambda one: one[1].total(traces))
        predictions = {"before": wide, "after": predict(after, settings.seed)}
        gap = _gap(settings, before, predictions, [finding.pair[0] for finding in found.findings])
        before = polished(before)
    else:
        predictions = {"before": predict(before, settings.seed)}
    kind = "several" if len(results) > 1 else results[0].kind if results else \
        "unlisted" if found.lacking or rest.misfits else "none"
    answer = sentence(results, found.unexplained, found.outlying, left_over, bool(found.chi_square),
                      traces.scene.missing, rest.misfits, rest.explanations)
    result = Result(
        kind, answer, results, _blocks(found, results), list(found.set_aside), _simulation(before), _simulation(after),
        gap, len(traces.scene), _noise(traces.scene), recordings.digest, settings.digest, rest.closed,
        traces.scene.unused, list(by_level(traces.scene.recordings.conditions, traces.conditions)), left_over,
        rest.explanations, rest.times)
    return result, figures(before, after if is_extended else None, predictions,
                           recordings.conditions.take(list(found.set_aside)))


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
    found = from_json(named)
    reported, left_over = _reported(settings, found)
    results = [unconfirmed_result(settings, one, found.measured.get(one.finding.pair)) for one in reported]
    scene = _scene(settings, bench, recordings, found)
    missing = [_block(block) for block in can if block not in found.chi_square]
    if not (found.is_complete or missing):
        missing = ["the rest of the examination of the blocks"]
    partial = Partial(budget, [_block(block) for block in found.chi_square],
                      [*missing, "the simulation of the whole bench, and with it coefficients, size and gap"])
    kind = "several" if len(results) > 1 else results[0].kind if results else "unlisted" if found.lacking else "open"
    conditions = with_measured(scene.recordings.conditions, found.parameters)
    result = Result(
        kind, partial_sentence(results, found.unexplained, found.outlying, left_over), results, _blocks(found, results),
        list(found.set_aside), None, None, None, len(scene), _noise(scene), recordings.digest, settings.digest,
        closed_blocks(scene.missing), scene.unused, list(by_level(scene.recordings.conditions, conditions)), left_over,
        partial=partial)
    return result, figures_without_fits(scene.recordings, recordings.conditions.take(list(found.set_aside)))


def _reported(settings: StudySettings, found: Naming) -> tuple[list[Judged], list[Remainder]]:
    """The findings that are reported, and what the others are called."""
    every = judged(settings, found)
    are = are_reported([one.evidence for one in every], [one.finding.nats for one in every])
    return ([one for one, its in zip(every, are, strict=True) if its],
            [remainder(one) for one, its in zip(every, are, strict=True) if not its])


def _blocks(found: Naming, results: list[FindingResult]) -> list[BlockResult]:
    return [BlockResult(block, SIGNALS[block], value, [one.title for one in results if block in one.blocks],
                        block in found.unexplained, list(found.outlying.get(block, ())))
            for block, value in found.chi_square.items()]


def _block(name: str) -> str:
    return f"the block “{SIGNALS[name]}”"


def _noise(scene: Scene) -> dict[str, float]:
    """Standard deviation of the noise of each signal in its unit, and of the shifting time in s."""
    return {**{signal: std for signal, (std, _) in scene.noise.items()}, "shifting_time": scene.timer_noise}


def _fits(settings: StudySettings, traces: Traces, terms: Terms, laws: Mapping[str, MeasuredLaw],
          points: np.ndarray) -> tuple[SimulationFit, SimulationFit, SimulationFit, list[SimulationFit]]:
    """The fits without and with `terms`, the latter also with measured `laws`, and those without its terms and scatter.

    The last ones are nested in the fit with the laws. If one of them is above it, that fit has ended in a local
    maximum, and all of them begin again there. If that does not end, the simulation does not ask for the terms. The fit
    with the terms, whose standard errors are stated, is polished.
    """
    def enough(gain: np.ndarray) -> bool:
        return is_enough(gain, settings.naming)

    for _ in range(_BEGINNINGS):
        before, formulas = confirmed(traces, terms, points, enough)
        after = with_measured_laws(formulas, before, laws, points, enough)
        without = with_scatter_of(after, before) if after.block.terms.names else []
        higher = best([after, *without])
        if higher is after:
            final = polished(after) if without else after
            return before, final if formulas is after else formulas, final, without
        points = higher.fitted.points
    return higher, higher, higher, []


def _steps(recordings: Recordings, log: Log) -> StudySteps:
    return StudySteps(() if recordings.signals is None else recordings.signals.names, log)


def _traces(settings: StudySettings, bench: Bench, recordings: Recordings,
            found: Naming) -> tuple[Traces, np.ndarray]:
    """The recordings that were not set aside, and the parameters (n, q) at which their simulations start."""
    scene = _scene(settings, bench, recordings, found)
    nominal = np.zeros(len(scene))
    starts = [nominal if name in (*_NOMINAL_LOSSES, *CONDITIONS) else found.parameters.get(name, nominal)
              for name in RANDOM]
    conditions = with_measured(scene.recordings.conditions, found.parameters)
    return Traces.of(scene, found.clocks, found.converter, conditions), np.stack(starts, axis=1)


def _scene(settings: StudySettings, bench: Bench, recordings: Recordings, found: Naming) -> Scene:
    """The recordings that were not set aside, with the noise that was found."""
    whole = Scene.of(bench, recordings, settings.naming)
    return replace(whole.take(np.setdiff1d(np.arange(len(whole)), found.set_aside)), noise=found.noise)


def _terms(bench: Bench, found: Naming, answers: list[Answer]) -> Terms:
    """The named effects, and the measured laws of what has no name."""
    named = dict.fromkeys(one.effect for one in answers if one.effect)
    laws = [found.measured[one.pair].simulated() for one in answers if not one.effect and one.pair in found.measured]
    return Terms(bench, tuple(named), tuple(law for law in laws if law is not None)[:MOST_LAWS])


def _experiments(one: Answer, after: SimulationFit) -> list[FurtherExperiment]:
    """Experiments that tell the effect of an answer from those that are tied with it."""
    found, terms = [], after.block.terms
    known = {effect.name for effect in effects.CATALOGUE}
    for rival in one.others:
        if one.effect not in terms.effects or rival not in known or rival in terms.effects:
            continue
        swapped = replace(terms, effects=tuple(rival if name == one.effect else name for name in terms.effects))
        other = fit_simulation(after.block.traces, swapped, after.fitted.points)
        found += further(after, other, rival)
    return found


def _gap(settings: StudySettings, before: SimulationFit, predictions: dict[str, Prediction],
         quantities: list[str]) -> Gap:
    """The gap before and after, and what the best effect on another quantity closes of it."""
    wide, narrow = predictions["before"], predictions["after"]
    spent = control(before, quantities)
    its = None
    if spent is not None:
        other = predict(spent[1], settings.seed)
        # What a right model would leave is the findings' to say, of the control as well.
        judged = Prediction(other.channels, other.square, narrow.variance, other.time)
        its = Control(spent[0], closures(wide, judged, settings.seed))
    return Gap(closures(wide, narrow, settings.seed), wide.time.tolist(), narrow.time.tolist(), its)


def _simulation(one: SimulationFit) -> SimulationResult:
    """A fit as a result; its model has the mean parameters."""
    block = one.block
    values = block.scene.base.copy()
    for parameter, change in one.parameters.items():
        if parameter not in CONDITIONS:
            values[names_of.index(parameter)] *= 1 + change
    return SimulationResult(one.parameters, one.scatter, one.chi_square, float(one.evidence.sum()),
                            one.fitted.converged, block.terms.model(one.values, tuple(values.tolist())).spec())
