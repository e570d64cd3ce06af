"""Request and response bodies of calibrations."""

from pydantic import BaseModel, Field

from slipstick.machine_studies.result import MachineParameter, StatedCondition
from slipstick.time_budget import DEFAULT, Partial

from .jobs import Ahead, MachineOfRuns, MissingMachine, Progress, RecordedJob, TimeBudget
from .paging import Page
from .schemas import BenchName, RecordingsDigest, RecordingsName, StrictModel
from .study_schemas import ModelSpec, StartModel


class CalibrationRequest(StrictModel):
    """A calibration of a bench, or of the declared machine of runs."""

    recordings: RecordingsName = "measured"
    bench: BenchName = None
    model: StartModel = None
    time_budget: TimeBudget = DEFAULT


class Calibration(RecordedJob):
    """A calibration without its progress and result."""

    machine: MachineOfRuns = None
    model_digest: str | None = Field(description="SHA-256 digest of the model with which the search begins; null for "
                                                 "the nominal parameters.")


class CalibrationWithProgress(Calibration):
    """A calibration with its progress."""

    ahead: Ahead
    missing_machine: MissingMachine = None
    progress: Progress | None = Field(description="Progress; null before the first iteration.")


class CalibrationList(Page):
    """A list of calibrations."""

    calibrations: list[Calibration] = Field(description="The calibrations, newest first.")


class CalibratedParameter(BaseModel):
    """A fitted parameter in its unit."""

    value: float = Field(description="Estimate.")
    unit: str = Field(description="Unit of the parameter.")
    standard_error: float = Field(description="Standard error of the estimate.")
    interval: tuple[float, float] = Field(description="Lower and upper end of its interval.")
    scatter: float = Field(description="Standard deviation from run to run; 0 if the recordings do not ask for one.")
    scatter_error: float = Field(description="Standard error of the scatter; where that is 0, the scatter that the "
                                             "recordings do not exclude.")
    bounds: tuple[float, float] | None = Field(
        default=None, description="Least and largest value that the bench file allows; null in calibrations of earlier "
                                  "versions.")


class BenchCalibration(BaseModel):
    """The calibration of a bench. Intervals and scatter assume that the model is right."""

    parameters: dict[str, CalibratedParameter] = Field(description="The fitted parameters by name.")
    level: float = Field(description="Probability of the intervals.")
    correlation: list[list[float]] = Field(description="Correlation of the estimates, in the order of the parameters.")
    noise: dict[str, float] = Field(description="Standard deviation of the noise of each sensor, in its unit.")
    noise_correlation: dict[str, float] = Field(description="Correlation of this noise from sample to sample.")
    reduced_chi_square: dict[str, float] = Field(
        description="Reduced chi-square of each sensor with parameters of each run; 1 if only noise is left.")
    rms_before_s: float = Field(description="RMS residual of the shifting time at the start in s.")
    rms_after_s: float = Field(description="RMS residual of the shifting time at the estimate in s.")
    at_bound: list[str] = Field(description="Parameters at a bound of the bench file: no estimates.")
    undetermined: list[str] = Field(description="Parameters that the recordings do not determine.")
    signals: list[str] = Field(description="The signals that were compared.")
    evaluations: int = Field(description="Number of iterations.")
    converged: bool = Field(description="Whether the iterations converged.")
    model: ModelSpec = Field(description="The model with the estimates.")
    partial: Partial | None = Field(description="What is missing, if the time budget ended before; null if complete.")


class DeclaredCalibration(BaseModel):
    """The calibration of a declared machine."""

    machine: str = Field(description="Name of the machine.")
    parameters: list[MachineParameter] = Field(description="The fitted parameters.")
    chi_square: dict[str, float] = Field(description="Median reduced chi-square of each block; 1 if only noise is "
                                                     "left.")
    set_aside: list[int] = Field(description="Runs, numbered from 0, that are far worse than all others and not used.")
    run_names: list[str] = Field(default=[], description="Where each run is from, by its number, such as the file; "
                                                         "empty where the recordings do not say so.")
    conditions: list[StatedCondition] = Field(default=[], description="Conditions whose stated values are off by more "
                                                                     "than the machine declares.")


class FinishedCalibration(BaseModel):
    """The result of a finished calibration."""

    id: str = Field(description="Id of the calibration.")
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: RecordingsDigest
    result: BenchCalibration | DeclaredCalibration = Field(
        description="The parameters, of a bench (`BenchCalibration`) or of a declared machine (`DeclaredCalibration`).")
    seconds: dict[str, float] = Field(description="Elapsed (wall-clock) time of each stage in s.")
    processor_seconds: dict[str, float] = Field(
        description="Processor time of each stage in s, summed over all threads of the worker.")
