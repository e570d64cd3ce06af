"""`slipstick.study`: which physical effect do recordings show and the model of their bench lack?"""

import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, ClassVar, overload

from slipstick.clutch.model import Model
from slipstick.engine.settings import EngineSettings
from slipstick.errors import InvalidValue
from slipstick.interface.files import now, require_html, write, write_laws
from slipstick.interface.finding import Law, NamedFinding
from slipstick.interface.fit import Fit
from slipstick.interface.frames import data_frame
from slipstick.interface.machine_study import (
    MachineStudy,
    RunsLike,
    as_runs,
    of_machine,
    refuse_executor,
    study_of_machine,
)
from slipstick.interface.models import BenchLike, RecordingsLike, as_mapping, bench_of, recordings_of
from slipstick.interface.progress import ProgressLine, Show, TimeEnded
from slipstick.interface.rehearsal import compile_study
from slipstick.interface.result import Result
from slipstick.machine import Machine, Runs
from slipstick.pictures.study import study_pictures
from slipstick.pictures.theme import Spec
from slipstick.report.study.page import study_page
from slipstick.studies import StudyResult, StudySettings, conclude, examine, unconfirmed
from slipstick.studies.export import has_table, law_table
from slipstick.studies.figures import Figures
from slipstick.studies.formula import equation
from slipstick.studies.progress import StudyProgress
from slipstick.studies.record import from_dict
from slipstick.studies.result import Coefficient, FindingResult
from slipstick.time_budget import clock_times, seconds_of, stage_times


@dataclass(frozen=True, eq=False)
class Finding(NamedFinding[FindingResult]):
    """Something that the recordings show and the model lacks; all of it is in `result`."""

    settings: StudySettings = field(default_factory=StudySettings)

    @property
    def confidence(self) -> float | None:
        """Expected share of right findings among those with such evidence, from 0 to 1."""
        return self.result.confidence

    @property
    def coefficients(self) -> list[Coefficient]:
        """Fitted coefficients of the effect with units and intervals."""
        return self.result.confirmation.coefficients

    @property
    def equation(self) -> str | None:
        """Equation of the effect with its coefficients in numbers and units; None where it was not fitted."""
        return equation(self.result)

    @property
    def law(self) -> Law | None:
        """The measured law; None if there is none."""
        table = law_table(self.result) if has_table(self.result) else None
        return None if self.result.law is None else Law(self.result, table, self.settings.level)


@dataclass(frozen=True, eq=False, repr=False)
class Study(Result):
    """The result of a study: the answer, what was found, the models without and with it, and the gap between them.

    `result` and `figures` have everything, `settings` is what was asked, `name` and `recordings_digest` say of which
    recordings. `seconds` and `processor_seconds` are times by stage; `submitted` and `ended` are in UTC. `bench` is the
    name of the bench, empty in studies of earlier versions.
    """

    kind: ClassVar[str] = "study"

    name: str
    recordings_digest: str
    settings: StudySettings
    result: StudyResult
    figures: Figures
    seconds: dict[str, float]
    processor_seconds: dict[str, float]
    submitted: str
    ended: str
    bench: str = ""

    @property
    def answer(self) -> str:
        """The answer in one sentence."""
        return self.result.sentence

    @property
    def findings(self) -> list[Finding]:
        """What is missing in the model; empty if nothing is, or if no law explains what is."""
        return [Finding(entry, self.settings) for entry in self.result.findings]

    @property
    def extended(self) -> Model:
        """The refitted model with the findings, for `slipstick.build`; raises `InvalidValue` in a partial result."""
        return self._model("after")

    @property
    def refitted(self) -> Model:
        """The refitted model without the findings; raises `InvalidValue` in a partial result."""
        return self._model("before")

    def summary(self) -> list[str]:
        """The answer, and the held-out error of the shifting time without and with the findings."""
        return [f"{self.answer}.", *([] if self.result.gap is None else [_gap_sentence(self.result)])]

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """Overlay, law, evidence, shifting times, blocks, gap and signals, as far as there are any."""
        specs = study_pictures(self.result, self.figures, settings=self.settings)
        return {name: (spec, spec["description"]) for name, spec in specs.items()}

    def to_frame(self) -> Any:
        """A row for each coefficient of the findings, with its interval."""
        rows = [(finding.title, entry) for finding in self.findings for entry in finding.coefficients]
        return data_frame({
            "finding": [title for title, _ in rows],
            **{name: [getattr(entry, name) for _, entry in rows]
               for name in ("name", "value", "lower", "upper", "unit")}})

    def report(self, path: Path | str, before: Fit | None = None, after: Fit | None = None) -> Path:
        """Write the report as one HTML page, which needs no network and no scripts, and return its path.

        With the same fit on tables of both models, `before` and `after` they were extended, it compares the fits.
        Raises `InvalidValue` for a path that does not end in `.html`, or where the extra `reports` is not installed.
        """
        require_html(path)
        values = self.to_dict()
        fits = None if before is None or after is None else {"before": before.to_dict(), "after": after.to_dict()}
        return write(path, study_page(values, values, fits).encode())

    def save_laws(self, folder: Path | str) -> list[Path]:
        """Write each measured law over a number as a `.csv`, `.mat`, `.mo` and `.h` file; return their paths."""
        return write_laws(folder, [law_table(each) if has_table(each) else None for each in self.result.findings])

    def to_dict(self) -> dict[str, Any]:
        """The study as JSON; `result` is that of the REST service."""
        return {"id": self.name, "recordings": self.name, "recordings_digest": self.recordings_digest,
                "bench": self.bench, "settings": asdict(self.settings), "submitted": self.submitted,
                "ended": self.ended, "result": asdict(self.result), "figure_data": asdict(self.figures),
                "seconds": self.seconds,
                "processor_seconds": self.processor_seconds}

    def _model(self, which: str) -> Model:
        models = self.result.models
        if which not in models:
            raise InvalidValue("The time budget ended before there was a refitted model",
                               "Repeat the study with a larger budget")
        return Model.from_spec(models[which])

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Study":
        """The study whose `to_dict` is `values`, or the result that the REST service gives, which has no pictures."""
        figures = values.get("figure_data")
        return cls(values["recordings"], values["recordings_digest"],
                   StudySettings.from_dict(values.get("settings", {})), from_dict(StudyResult, values["result"]),
                   _NO_FIGURES if figures is None else from_dict(Figures, figures), dict(values["seconds"]),
                   dict(values["processor_seconds"]), values.get("submitted", ""), values.get("ended", ""),
                   values.get("bench", ""))


_NO_FIGURES = Figures({}, [], {}, [])


@overload
def study(bench: BenchLike, recordings: RecordingsLike, **options: Any) -> Study: ...
@overload
def study(bench: Machine, recordings: RunsLike, **options: Any) -> MachineStudy: ...
def study(bench: BenchLike | Machine, recordings: RecordingsLike | RunsLike, *,
          settings: StudySettings | EngineSettings | Mapping[str, Any] | None = None,
          budget: float | str | None = None, progress: bool | Show = True, name: str = "recordings",
          executor: Executor | None = None, **changed: Any) -> Study | MachineStudy:
    """Find what the model of a bench lacks that recordings of it show, measure it, and add it to the model.

    Parameters
    ----------
    bench : Bench, Machine, str or Path
        The bench that was recorded, the name of a shipped one, or the path of its file; or a declared machine.
    recordings : Recordings, Runs, str or Path
        At least 24 engagements with signals, or more of shifting times alone; or a name or a path. Of a machine, its
        recorded runs.
    settings : StudySettings, EngineSettings or mapping, optional
        What may be named, and when; of a machine, those of the engine. Single ones can be `changed`, such as
        `level=0.95` or `seed=2`.
    budget : float or str, optional
        Time in s, or a text such as "2 min", after which the result is a partial one. By default a day.
    progress : bool or callable, optional
        Whether to show a bar in a terminal or notebook, or a function of a text and of the share that is complete.
    name : str, optional
        Name of the recordings in reports.
    executor : concurrent.futures.Executor, optional
        What computes with many runs of a machine, such as `client.get_executor(pure=False)` of a
        `dask.distributed.Client`; by default the threads of this process.

    Returns
    -------
    Study
        Or a `MachineStudy`, of a machine.

    Raises
    ------
    InvalidValue
        For recordings that cannot be of the bench or say too little, for settings out of range, and for an executor
        beside a bench.
    TimeBudgetEnded
        If the budget ended before there was anything to show.

    """
    if isinstance(bench, Machine):
        return study_of_machine(bench, as_runs(recordings), {**as_mapping(settings), **changed}, budget, progress, name,
                                executor)
    if isinstance(recordings, Runs):
        raise of_machine()
    refuse_executor(executor)
    bench = bench_of(bench)
    recordings = recordings_of(bench, recordings)
    chosen = StudySettings.from_dict({**as_mapping(settings), **changed})
    limit, start, submitted = seconds_of(budget), time.monotonic(), now()
    compile_study(bench, recordings)
    named: dict[str, Any] = {}
    stage, times, begin = "name", dict[str, dict[str, float]](), clock_times()
    with ProgressLine() as line:
        show = line.shown(progress)

        def log(step: StudyProgress) -> None:
            if time.monotonic() > start + limit:
                raise TimeEnded
            show(f"step {step.step} of {step.steps}: {step.doing}", step.done)

        try:
            named = examine(chosen, bench, recordings, log, named.update)
            times, stage, begin = stage_times({}, stage, begin), "confirm", clock_times()
            result, figures = conclude(chosen, bench, recordings, named, log)
        except TimeEnded:
            result, figures = unconfirmed(chosen, bench, recordings, named or None, limit)
    return Study(name, recordings.digest, chosen, result, figures, **stage_times(times, stage, begin),
                 submitted=submitted, ended=now(), bench=bench.name)


def _gap_sentence(result: StudyResult) -> str:
    assert result.gap is not None
    closure = result.gap.closures["shifting_time"]
    before, after, expected = (f"{1e3 * value:.1f} ms" for value in (
        closure.rms_before, closure.rms_after, closure.rms_expected))
    return (f"Held-out RMS error of the shifting time: {before} without what is missing, {after} with it; {expected} "
            "are expected of a correct model.")
