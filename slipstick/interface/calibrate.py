"""`slipstick.calibrate`: the uncertain parameters of a bench and their scatter from run to run, from recordings."""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, overload

from slipstick.calibration import Calibration
from slipstick.calibration import calibrate as fit_calibration
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.interface.frames import data_frame
from slipstick.interface.machine_study import (
    MachineCalibration,
    RunsLike,
    as_runs,
    calibration_of_machine,
    of_machine,
    refuse_executor,
)
from slipstick.interface.models import BenchLike, ModelLike, RecordingsLike, bench_of, model_of, recordings_of
from slipstick.interface.progress import ProgressLine, Show
from slipstick.interface.result import Result
from slipstick.machine import Machine, Runs
from slipstick.pictures.theme import Spec
from slipstick.report.calibration import CAPTIONS, calibration_specs, calibration_summary, calibration_text
from slipstick.time_budget import seconds_of


class Parameter(NamedTuple):
    """A fitted parameter in its `unit`: value with interval, and its standard deviation from run to run."""

    name: str
    unit: str
    value: float
    lower: float
    upper: float
    scatter: float


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationResult(Result):
    """The result of a calibration; `calibration` has all of it."""

    kind: ClassVar[str] = "calibration"

    calibration: Calibration

    @property
    def model(self) -> Model:
        """The model with the fitted parameters, for `slipstick.build`."""
        return self.calibration.model

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The fitted parameters with intervals of the probability `calibration.level`."""
        fitted = []
        for name, entry in self.calibration.spec()["parameters"].items():
            lower, upper = entry["interval"]
            fitted.append(Parameter(name, entry["unit"], entry["value"], lower, upper, entry["scatter"]))
        return tuple(fitted)

    def summary(self) -> list[str]:
        """How many parameters were fitted, what the recordings leave open, and the error of the shifting times."""
        return calibration_summary(self.calibration)

    @property
    def text(self) -> str:
        """Parameters, correlation, noise and chi-square as plain text."""
        return calibration_text(self.calibration)

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """The parameters with their intervals, relative to their nominal values."""
        return {name: (spec, CAPTIONS[name]) for name, spec in calibration_specs(self.calibration).items()}

    def to_frame(self) -> Any:
        """A row for each parameter."""
        return data_frame(dict(zip(Parameter._fields, zip(*self.parameters, strict=True), strict=True)))

    def to_dict(self) -> dict[str, Any]:
        """The calibration as JSON; `build --model` reads it."""
        return self.calibration.spec()

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "CalibrationResult":
        """The calibration whose `to_dict` is `values`."""
        return cls(Calibration.from_spec(values))


@overload
def calibrate(bench: BenchLike, recordings: RecordingsLike, *, model: ModelLike | None = None,
              budget: float | str | None = None, progress: bool | Show = True) -> CalibrationResult: ...
@overload
def calibrate(bench: Machine, recordings: RunsLike, *, budget: float | str | None = None,
              progress: bool | Show = True, executor: Executor | None = None) -> MachineCalibration: ...
def calibrate(bench: BenchLike | Machine, recordings: RecordingsLike | RunsLike, *, model: ModelLike | None = None,
              budget: float | str | None = None, progress: bool | Show = True,
              executor: Executor | None = None) -> CalibrationResult | MachineCalibration:
    """Fit the uncertain parameters of a bench, and their scatter from run to run, to recordings of it.

    Parameters
    ----------
    bench : Bench, Machine, str or Path
        The bench that was recorded, the name of a shipped one, or the path of its file; or a declared machine.
    recordings : Recordings, Runs, str or Path
        Recordings, a name or a path, with at least one signal, and twice as many engagements as the bench has uncertain
        parameters. Of a machine, its recorded runs.
    model : Model, result or path, optional
        The model with which the search begins, as in `slipstick.build`. A machine has none.
    budget : float or str, optional
        Time in s, or a text such as "2 min", after which the next iteration is the last; of a machine there is no
        result then. By default a day.
    progress : bool or callable, optional
        Whether to show a bar in a terminal or notebook, or a function of a text and of the share that is complete.
    executor : concurrent.futures.Executor, optional
        What computes with many runs of a machine, such as `client.get_executor(pure=False)` of a
        `dask.distributed.Client`; by default the threads of this process.

    Returns
    -------
    CalibrationResult
        Or a `MachineCalibration`, of a machine.

    Raises
    ------
    InvalidValue
        For recordings that cannot be of the bench, or do not suffice, for a model of a machine, and for an executor
        beside a bench.
    TimeBudgetEnded
        If the budget ended before the parameters of a machine were fitted.

    References
    ----------
    Tod et al., section II.C.

    """
    if isinstance(bench, Machine):
        if model is not None:
            raise InvalidValue("A declared machine has no model file",
                               "Leave out `model`, and write its values into the file of the machine")
        return calibration_of_machine(bench, as_runs(recordings), budget, progress, executor)
    if isinstance(recordings, Runs):
        raise of_machine()
    refuse_executor(executor)
    bench = bench_of(bench)
    recordings = recordings_of(bench, recordings)
    with ProgressLine() as line:
        show = line.shown(progress)

        def report(free: tuple[str, ...], iterations: int, change: float) -> None:
            show(f"iteration {iterations:2}: {len(free)} parameters, largest change {change:.3g} standard errors", None)

        return CalibrationResult(fit_calibration(recordings, bench, model_of(bench, model), report, seconds_of(budget)))
