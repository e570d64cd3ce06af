"""A study by the engine as the values that reports, pictures and the service read."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from slipstick.black_box.ranges import simulate_ranges
from slipstick.engine.doing import Doing, Step
from slipstick.engine.evidence import FEWEST
from slipstick.engine.fit import Fit, join
from slipstick.engine.kinds import KindOfLaw
from slipstick.engine.measured_law import DEVIATIONS
from slipstick.engine.measured_law import Law as EngineLaw
from slipstick.engine.selection import Finding, Identification
from slipstick.engine.settings import EngineSettings
from slipstick.engine.study import (
    Confirmation,
    MachineStudy,
    ParameterEstimate,
    estimate_conditions,
    estimate_parameters,
    fit_parameters,
    require_solved,
    study,
)
from slipstick.errors import BadRecording, SlipstickError
from slipstick.law_files import LawTable
from slipstick.law_files.machine_law import has_points, list_coefficients, tabulate, write_equation
from slipstick.machine import Machine, Runs, require_runs, units_of
from slipstick.machine.declaration import SENSOR
from slipstick.machine.doubts import list_doubts
from slipstick.machine_studies.result import (
    MachineBlock,
    MachineFigures,
    MachineFinding,
    MachineGap,
    MachineParameter,
    MachineStudyResult,
    Rival,
    ShownRun,
    StatedCondition,
)
from slipstick.machine_studies.words import answer, name_finding
from slipstick.studies.export import tabulate_finding
from slipstick.studies.figures import rounded
from slipstick.studies.finding import Coefficient, Law
from slipstick.studies.progress import Log, Steps
from slipstick.time_budget import Partial

_SHOWN, _POINTS = 3, 400
"""Runs that are shown, and the points of a curve: more than a picture resolves."""

Studied = tuple[MachineStudyResult, MachineFigures]


def study_machine(machine: Machine, runs: Runs, settings: EngineSettings | None = None,
                  log: Log = lambda _: None, keep: Callable[[Studied], None] = lambda _: None,
                  executor: Executor | None = None) -> Studied:
    """Find what recorded runs of a machine ask for, and confirm it in the simulation of the whole machine.

    `log` is called with each step, and `keep` with the result that there is before runs that are set aside are
    searched, and with that before the confirmation. The `executor` computes with chunks of many runs, by default
    threads. Raises `BadRecording` for runs that are not of the machine, and for too few.
    """
    require_enough(require_runs(machine, runs))
    steps = Steps(get_args(Step), log)

    def report(doing: Doing) -> None:
        steps.report("name" if doing.step in ("fit", "search") else "confirm", doing.step, doing.words)

    with _doubting(machine, runs, report) as doubts:
        complete = study(machine, runs, settings=settings, log=report,
                         keep=lambda named: keep(_conclude(named, runs, doubts)), executor=executor)
    return _conclude(complete, runs, doubts)


def require_enough(runs: Runs) -> None:
    """Raise `BadRecording` for runs that are too few for a study."""
    if len(runs) < FEWEST:
        raise BadRecording(f"A study needs at least {FEWEST} runs that can agree, and the recordings have {len(runs)}",
                           "Record some 20 to 60 runs that differ in commands and conditions, or cut a long recording "
                           "into runs by [runs] in the mapping")


def calibrate_machine(machine: Machine, runs: Runs, log: Callable[[Doing], None] = lambda _: None,
                      executor: Executor | None = None
                      ) -> tuple[list[MachineParameter], dict[str, float], list[int], list[StatedCondition]]:
    """Fit the parameters of a machine to runs of it; raises `BadRecording` for runs that are not of the machine.

    Returns the parameters, the median reduced chi-square of each block, the runs that are set aside, and conditions
    whose stated values are off.
    """
    with _doubting(machine, require_runs(machine, runs), log):
        fit = fit_parameters(machine, runs, log, executor)
    aside = sorted(set(range(len(runs))) - set(fit.recorded.rows.tolist()))
    return ([_state_parameter(each, machine) for each in estimate_parameters(fit)],
            {name: float(np.median(chi)) for name, chi in fit.chi_square.items()}, aside, _list_conditions(fit))


@contextmanager
def _doubting(machine: Machine, runs: Runs, log: Callable[[Doing], None]) -> Iterator[list[str]]:
    """Return, and log, what may have another unit or sign in the recordings than in the machine.

    Errors in the block tell it as well. Recordings that are doubtful, and with which the equations have no solution to
    begin with, raise `InvalidValue` before anything is fitted.
    """
    doubts = list_doubts(runs, machine, simulate_ranges(machine))
    try:
        for doubt in doubts:
            log(Doing("fit", f"Doubtful: {doubt}"))
        if doubts:
            require_solved(machine, runs)
        yield doubts
    except SlipstickError as error:
        if not doubts:
            raise
        raise type(error)(". ".join([*doubts, error.cause]), error.remedy) from error


def end_early(studied: Studied, budget: float) -> Studied:
    """Return the result of a study whose time `budget` in s ended before the confirmation, or before that runs that are
    set aside were searched."""
    result, figures = studied
    missing = ["the simulation of the whole machine, and with it the gap"]
    if len(result.set_aside) >= FEWEST and not any(finding.runs for finding in result.findings):
        missing.insert(0, "a law that some of the runs that are set aside may have alone")
    partial = Partial(budget, ["the examination of the blocks"], missing)
    return replace(result, partial=partial, sentence=f"Partial answer, as the time budget ended. {result.sentence}"), \
        figures


def _conclude(studied: MachineStudy, runs: Runs, doubts: list[str]) -> Studied:
    machine, named, confirmation = studied.machine, studied.identification, studied.confirmation
    findings = [_state_finding(finding, machine, named, (studied.laws, studied.kinds), confirmation)
                for finding in named.findings]
    if named.apart is not None:
        findings += [replace(_state_finding(finding, machine, named.apart, studied.apart, None),
                             runs=named.apart.rows.tolist()) for finding in named.apart.findings]
    fitted, bare = join(named.fits), join(named.bare)
    unexplained = named.unexplained
    declared = {block.name: set(block.signals) for block in machine.blocks}
    after, before = ({name: float(np.median(chi)) for name, chi in fit.chi_square.items()} for fit in (fitted, bare))
    settled = {name: fit.converged for fit in named.fits for name in fit.models}
    blocks = [MachineBlock(block.name, f"{', '.join(block.reads) or '–'} → {', '.join(block.signals)}",
                           after[block.name], before[block.name], block.name in unexplained, settled[block.name],
                           [] if block.name in declared else
                           [name for name, signals in declared.items() if signals <= set(block.signals)],
                           list(block.switches))
              for block in fitted.recorded.machine.blocks if block.name in after]
    noise = {signal: part.sensors[place].std for part in fitted.recorded.parts
             for place, signal in enumerate(part.signals)}
    kind: Literal["none", "effect", "tie", "several", "unlisted"]
    if len(findings) > 1:
        kind = "several"
    elif findings:
        kind = "tie" if findings[0].rivals else "effect" if findings[0].kind else "unlisted"
    else:
        kind = "unlisted" if unexplained else "none"
    without = {each.name: each for each in estimate_parameters(bare)} if named.findings else {}
    result = MachineStudyResult(
        machine.name, kind, answer(findings, unexplained), findings, blocks,
        [_state_parameter(each, machine, without.get(each.name)) for each in studied.parameters_beside_kinds],
        None if confirmation is None else _state_gap(confirmation), list(named.set_aside), len(fitted.recorded.rows),
        noise, {**runs.units, **units_of(machine)}, runs.digest, studied.digest,
        seen=_list_seen(runs.take(fitted.recorded.rows)), doubts=doubts, run_names=list(runs.names),
        conditions=_list_conditions(fitted))
    models = {"before": bare} | ({"after": fitted} if named.findings else {})
    if named.apart is not None and not named.findings:
        models = {"before": join(named.apart.bare), "after": join(named.apart.fits)}
    if confirmation is not None:
        models = {"before": confirmation.bare, "after": confirmation.fit}
    return result, MachineFigures(_show_runs(models))


def _state_finding(finding: Finding, machine: Machine, named: Identification,
                   measured: tuple[tuple[EngineLaw, ...], tuple[KindOfLaw, ...]],
                   confirmation: Confirmation | None) -> MachineFinding:
    pair = finding.pair
    laws, kinds = measured
    law, kind = next((law for law in laws if law.pair == pair), None), next((k for k in kinds if k.pair == pair), None)
    is_simulated = confirmation is not None and not pair[0].endswith(SENSOR) and any(
        law.pair == pair for law in confirmation.laws)
    blocks = sorted({name for fit in named.fits if pair in fit.laws for name in fit.laws[pair].variables})
    effect = None if kind is None else machine.effect_of(pair, kind.name)
    others = {lead.pair: Rival(name_finding(lead.pair), *lead.pair, lead.nats, lead.errors) for lead in finding.leads}
    return MachineFinding(
        name_finding(pair, None if kind is None else kind.name, None if effect is None else effect.name), *pair,
        None if effect is None else effect.name, None if kind is None else kind.name,
        None if kind is None or law is None else write_equation(law, kind),
        [] if kind is None or law is None else _state_coefficients(law, kind), blocks, finding.nats, finding.errors,
        [others[rival] for rival in finding.rivals],
        None if law is None or not has_points(law) else _state_law(law, kind),
        confirmation is not None and confirmation.nats > 0 if is_simulated else None,
        next((other for rival, other in others.items() if rival not in finding.rivals), None))


def _state_coefficients(law: EngineLaw, kind: KindOfLaw) -> list[Coefficient]:
    return [Coefficient(each.name, each.unit, each.value, each.lower, each.upper, False)
            for each in list_coefficients(law, kind)]


def _state_law(law: EngineLaw, kind: KindOfLaw | None) -> Law:
    table = tabulate(law, kind)
    return Law(rounded(law.x), table.x_unit, rounded(law.change), rounded(table.lower or ()),
               rounded(table.upper or ()), table.unit or "1", table.relative, table.known_up_to, False,
               None if table.formula is None else rounded(table.formula))


def law_table(finding: MachineFinding) -> LawTable:
    """Return the law of a finding as a table, which `slipstick.law_files.write_law` writes."""
    return tabulate_finding(finding, "95 % interval at each point", finding.equation)


def _state_parameter(estimate: ParameterEstimate, machine: Machine,
                     before: ParameterEstimate | None = None) -> MachineParameter:
    parameter = next(each for each in machine.parameters if each.name == estimate.name)
    mean, half = estimate.mean, DEVIATIONS * estimate.error
    lower, upper = mean - half, mean + half
    if parameter.is_factor(estimate.nominal):  # its logarithm is normal
        lower, upper = sorted((mean * np.exp(-half / mean), mean * np.exp(half / mean)))
    return MachineParameter(estimate.name, parameter.unit, mean, float(lower), float(upper), estimate.scatter,
                            estimate.known, estimate.beyond,
                            estimate.nominal if parameter.first_of is None else None,
                            None if before is None else before.mean, before is not None and before.beyond)


def _list_conditions(fit: Fit) -> list[StatedCondition]:
    return [StatedCondition(each.name, each.error, declared.within, each.scatter, declared.scatter)
            for each, declared in zip(estimate_conditions(fit), fit.recorded.machine.conditions, strict=True)
            if each.beyond]


def _list_seen(runs: Runs) -> dict[str, list[float]]:
    """Return the least and the largest value of each command and condition."""
    values = {name: np.append(profile.at(runs.time), profile.value[  # corners are between the samples
        (profile.time >= runs.time[0]) & (profile.time <= runs.time[-1])]) for name, profile in runs.commands.items()}
    values |= dict(runs.conditions)
    return {name: rounded([np.min(value), np.max(value)]) for name, value in values.items()}


def _state_gap(confirmation: Confirmation) -> MachineGap:
    gap, control = confirmation.gap, confirmation.control_gap
    return MachineGap(gap.without, gap.beside, gap.closed, name_finding(confirmation.control), control.closed,
                      confirmation.nats, confirmation.errors, gap.converged, control.converged)


def _show_runs(models: dict[str, Fit]) -> list[ShownRun]:
    """Return the runs that the model without the findings describes worst, in the order of their numbers."""
    before = models["before"]
    squares = np.sum(list(before.squares.values()), axis=0)
    worst = np.sort(np.argsort(-squares, kind="stable")[:_SHOWN])
    time = before.recorded.runs.time
    every = slice(None, None, max(1, len(time) // _POINTS))

    def curves(fit: Fit, row: int, measured: bool) -> dict[str, list[float]]:
        return {signal: rounded((model.part.measured if measured else model.predicted)[row, place, every])
                for model in fit.models.values() for place, signal in enumerate(model.part.signals)}

    return [ShownRun(int(before.recorded.rows[row]), rounded(time[every]), curves(before, row, True),
                     {who: curves(fit, row, False) for who, fit in models.items()}) for row in worst.tolist()]
