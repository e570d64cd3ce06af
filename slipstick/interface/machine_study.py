"""`slipstick.study` and `slipstick.calibrate` of a declared machine."""

import json
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from slipstick.building import say_compilation
from slipstick.engine.doing import Doing
from slipstick.engine.settings import EngineSettings
from slipstick.errors import InvalidValue, UnknownName
from slipstick.interface.files import now, require_html, write, write_laws
from slipstick.interface.finding import Law, NamedFinding
from slipstick.interface.frames import data_frame
from slipstick.interface.progress import ProgressLine, Show
from slipstick.interface.result import Result
from slipstick.machine import Machine, Runs
from slipstick.machine_studies import MachineFigures, MachineStudyResult, study_machine
from slipstick.machine_studies.result import MachineFinding, MachineParameter, Rival, StatedCondition
from slipstick.machine_studies.study import Studied, calibrate_machine, end_early, law_table
from slipstick.machine_studies.words import name_run
from slipstick.pictures.machine_study import LEVEL, machine_pictures
from slipstick.pictures.theme import Spec
from slipstick.recordings import Recordings
from slipstick.report.calibration import machine_calibration_summary
from slipstick.report.machine_study import lead, machine_study_page, tell_evidence, warnings
from slipstick.studies.export import has_table
from slipstick.studies.finding import Coefficient
from slipstick.studies.progress import StudyProgress
from slipstick.studies.record import from_dict
from slipstick.time_budget import TimeBudgetEnded, clock_times, seconds_of, stage_times

RunsLike = Runs | Path | str
"""Recorded runs, or the path of their file."""


@dataclass(frozen=True, eq=False, repr=False)
class FindingOfMachine(NamedFinding[MachineFinding]):
    """Something that recordings of a machine show and its model lacks; all of it is in `result`."""

    @property
    def nats(self) -> float:
        """Gain in log marginal likelihood."""
        return self.result.nats

    @property
    def errors(self) -> float:
        """Standard errors in which the runs agree about it."""
        return self.result.errors

    @property
    def rivals(self) -> list[Rival]:
        """Pairs of quantity and dependence that the recordings do not tell apart from it."""
        return self.result.rivals

    @property
    def kind(self) -> str | None:
        """The kind of effect that explains the law, such as Coulomb friction; None where the law explains more."""
        return self.result.kind

    @property
    def runs(self) -> list[int]:
        """Runs, numbered from 0, in which alone it acts, and which are set aside; empty where it acts in all."""
        return self.result.runs

    @property
    def coefficients(self) -> list[Coefficient]:
        """Coefficients of that kind with units and 95 % intervals."""
        return self.result.coefficients

    @property
    def equation(self) -> str | None:
        """The change by that kind, with its coefficients in numbers and units; None without one."""
        return self.result.equation

    @property
    def law(self) -> Law | None:
        """The measured law; None where it is one of lags, or of the past of a signal."""
        table = law_table(self.result) if has_table(self.result) else None
        return None if self.result.law is None else Law(self.result, table, LEVEL, "runs")


@dataclass(frozen=True, eq=False, repr=False)
class MachineStudy(Result):
    """The study of a declared machine: `result` and `figures` have all of it, `settings` is what was asked.

    `name` is that of the recordings; `submitted` and `ended` are in UTC.
    """

    kind: ClassVar[str] = "machine study"

    name: str
    settings: EngineSettings
    result: MachineStudyResult
    figures: MachineFigures
    seconds: dict[str, float]
    processor_seconds: dict[str, float]
    submitted: str
    ended: str

    @property
    def answer(self) -> str:
        """The answer in one sentence."""
        return self.result.sentence

    @property
    def findings(self) -> list[FindingOfMachine]:
        """What is missing in the model; empty if nothing is, or if no law explains what is."""
        return [FindingOfMachine(each) for each in self.result.findings]

    def summary(self) -> list[str]:
        """The answer, by how much the findings close the gap, and warnings."""
        return [f"{self.answer}.", lead(self.result) or tell_evidence(self.result),
                *(" ".join(entry) for entry in warnings(self.result))]

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """What shows the findings, the laws, and the runs that are described worst."""
        return {name: (spec, spec["description"]) for name, spec in machine_pictures(self.result, self.figures).items()}

    def to_frame(self) -> Any:
        """A row for each parameter, with its 95 % interval and scatter."""
        return _frame(self.result.parameters)

    def report(self, path: Path | str) -> Path:
        """Write the report as one HTML page, which needs no network and no scripts, and return its path."""
        require_html(path)
        values = self.to_dict()
        return write(path, machine_study_page(values, values).encode())

    def save_laws(self, folder: Path | str) -> list[Path]:
        """Write each law over points as a `.csv`, `.mat`, `.mo` and `.h` file; return their paths."""
        return write_laws(folder, [law_table(each) if has_table(each) else None for each in self.result.findings])

    def to_dict(self) -> dict[str, Any]:
        """The study as JSON; `result` is that of the REST service."""
        default, chosen = asdict(EngineSettings()), asdict(self.settings)
        changed = {name: value for name, value in chosen.items() if value != default[name]}
        return {"id": self.name, "recordings": self.name, "recordings_digest": self.result.recordings_digest,
                "settings": changed, "submitted": self.submitted, "ended": self.ended, "result": self.result.to_dict(),
                "figure_data": asdict(self.figures), "seconds": self.seconds,
                "processor_seconds": self.processor_seconds}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "MachineStudy":
        """The study whose `to_dict` is `values`, or the result that the REST service gives, which has no pictures."""
        return cls(values["recordings"], EngineSettings(**values.get("settings", {})),
                   from_dict(MachineStudyResult, values["result"]),
                   from_dict(MachineFigures, values.get("figure_data", {})), dict(values["seconds"]),
                   dict(values["processor_seconds"]), values.get("submitted", ""), values.get("ended", ""))


def study_of_machine(machine: Machine, runs: Runs, settings: Mapping[str, Any], budget: float | str | None,
                     progress: bool | Show, name: str, executor: Executor | None) -> MachineStudy:
    """Find what the model of a declared machine lacks; arguments and errors are those of `slipstick.study`."""
    chosen = settings_of(settings)
    limit, start, submitted, begin = seconds_of(budget), time.monotonic(), now(), clock_times()
    kept = list[Studied]()
    with say_compilation(), ProgressLine() as line:
        show = line.shown(progress)

        def log(step: StudyProgress) -> None:
            if time.monotonic() > start + limit:
                raise TimeBudgetEnded.before(limit, "the blocks of the machine were examined")
            show(f"step {step.step} of {step.steps}: {step.doing}", step.done)

        try:
            result, figures = study_machine(machine, runs, chosen, log, kept.append, executor)
        except TimeBudgetEnded:
            if not kept:
                raise
            result, figures = end_early(kept[-1], limit)
    return MachineStudy(name, chosen, result, figures, **stage_times({}, "study", begin), submitted=submitted,
                        ended=now())


@dataclass(frozen=True, eq=False, repr=False)
class MachineCalibration(Result):
    """The parameters of a declared machine, fitted to recorded runs, with 95 % intervals and scatter between runs.

    `chi_square` is the median reduced chi-square of each block, 1 if only noise is left. Runs are numbered as recorded,
    and have names where the recordings say where they are from. `conditions` are those whose stated values are off by
    more than is declared.
    """

    kind: ClassVar[str] = "machine calibration"

    machine: str
    parameters: list[MachineParameter]
    chi_square: dict[str, float]
    set_aside: list[int]
    run_names: list[str] = field(default_factory=list)
    conditions: list[StatedCondition] = field(default_factory=list)

    def summary(self) -> list[str]:
        """What each block leaves, and what is not determined or outside of its declaration."""
        return machine_calibration_summary(self.machine, self.parameters, self.conditions, self.chi_square,
                                           [name_run(run, self.run_names) for run in self.set_aside])

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """None: parameters of different units have no common axis."""
        return {}

    def to_frame(self) -> Any:
        """A row for each parameter."""
        return _frame(self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """The calibration as JSON."""
        return {"machine": self.machine, "parameters": [asdict(each) for each in self.parameters],
                "chi_square": self.chi_square, "set_aside": self.set_aside, "run_names": self.run_names,
                "conditions": [asdict(each) for each in self.conditions]}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "MachineCalibration":
        """The calibration whose `to_dict` is `values`."""
        return cls(values["machine"], [MachineParameter(**each) for each in values["parameters"]],
                   values["chi_square"], values["set_aside"], values.get("run_names", []),
                   [StatedCondition(**each) for each in values.get("conditions", [])])


def calibration_of_machine(machine: Machine, runs: Runs, budget: float | str | None, progress: bool | Show,
                           executor: Executor | None) -> MachineCalibration:
    """Fit the parameters of a declared machine; arguments and errors are those of `slipstick.calibrate`."""
    limit, start = seconds_of(budget), time.monotonic()
    with say_compilation(), ProgressLine() as line:
        show = line.shown(progress)

        def log(doing: Doing) -> None:
            if time.monotonic() > start + limit:
                raise TimeBudgetEnded.before(limit, "the parameters were fitted")
            show(doing.words, None)

        parameters, chi_square, set_aside, conditions = calibrate_machine(machine, runs, log, executor)
    return MachineCalibration(machine.name, parameters, chi_square, set_aside, list(runs.names), conditions)


def _frame(parameters: Sequence[MachineParameter]) -> Any:
    names = ("name", "unit", "value", "lower", "upper", "scatter", "determined", "beyond")
    return data_frame({name: [getattr(entry, name) for entry in parameters] for name in names})


def as_runs(given: Recordings | RunsLike) -> Runs:
    """Return what is given as runs, or those of a file; raises `InvalidValue` for recordings of a clutch."""
    if isinstance(given, Recordings):
        raise InvalidValue("Recordings of a clutch are not of a declared machine", "Give slipstick.Runs.open(FILE)")
    return given if isinstance(given, Runs) else Runs.open(given)


def of_machine() -> InvalidValue:
    """Return the error of runs that are given with a bench."""
    return InvalidValue("Runs of a declared machine are not of a bench", "Give slipstick.Machine.open(FILE)")


def refuse_executor(executor: Executor | None) -> None:
    """Raise `InvalidValue` for an executor that is given with a bench."""
    if executor is not None:
        raise InvalidValue("An executor computes with runs of a declared machine, not with a bench", "Leave it out")


def settings_of(values: Mapping[str, Any]) -> EngineSettings:
    """Return settings from JSON; raises `UnknownName` and `InvalidValue`."""
    known = asdict(EngineSettings())
    for name, value in values.items():
        if name not in known:
            raise UnknownName.of("setting", name, known)
        if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
            raise InvalidValue(f"{name} is {json.dumps(value)}", "Give a positive number")
    return EngineSettings(**values)

