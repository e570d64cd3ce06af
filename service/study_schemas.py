"""Request and response bodies of studies. Settings, progress and result are those of `slipstick.studies`."""

from dataclasses import asdict
from typing import Annotated, Any

import orjson
from pydantic import BaseModel, Field, TypeAdapter, ValidatorFunctionWrapHandler, WrapValidator

from slipstick.bench import Bench
from slipstick.engine.settings import EngineSettings
from slipstick.interface.machine_study import settings_of
from slipstick.interface.models import model_of, parse_model
from slipstick.machine_studies import MachineStudyResult
from slipstick.studies import StudyResult, StudySettings
from slipstick.studies.progress import StudyProgress
from slipstick.studies.result import Law
from slipstick.time_budget import DEFAULT

from .jobs import Ahead, AllSettings, MachineOfRuns, MissingMachine, RecordedJob, TimeBudget
from .paging import Page
from .schemas import BenchName, RecordingsDigest, RecordingsName, StrictModel

_SETTINGS = TypeAdapter(StudySettings)


def _strict_settings(value: Any, handler: ValidatorFunctionWrapHandler) -> StudySettings:
    # A dataclass of the core is strict about numbers, and still read from objects and lists, only as JSON.
    return value if isinstance(value, StudySettings) else _SETTINGS.validate_json(orjson.dumps(value), strict=True)


def _strict_engine(value: Any, handler: ValidatorFunctionWrapHandler) -> EngineSettings:
    if isinstance(value, EngineSettings):
        return value
    settings: EngineSettings = TypeAdapter(EngineSettings).validate_json(orjson.dumps(value), strict=True)
    return settings_of(asdict(settings))


class StudyRequest(StrictModel):
    """A study of recordings."""

    recordings: RecordingsName = "measured"
    bench: BenchName = None
    settings: Annotated[StudySettings, WrapValidator(_strict_settings)] = Field(
        default_factory=StudySettings,
        description="Settings of the study. Omitted settings have default values, which the response reports.")
    engine: Annotated[EngineSettings, WrapValidator(_strict_engine)] = Field(
        default_factory=EngineSettings, description="Settings of the study of runs of a declared machine, instead of "
                                                    "`settings`.")
    time_budget: TimeBudget = DEFAULT


class Study(RecordedJob):
    """A study without its progress and result."""

    machine: MachineOfRuns = None
    settings: AllSettings


class StudyWithProgress(Study):
    """A study with its progress."""

    ahead: Ahead
    missing_machine: MissingMachine = None
    progress: StudyProgress | None = Field(description="Progress; null before the first step.")


class StudyList(Page):
    """A list of studies."""

    studies: list[Study] = Field(description="The studies, newest first.")


class FinishedStudy(BaseModel):
    """The result of a finished study."""

    id: str = Field(description="Id of the study.")
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: RecordingsDigest
    result: MachineStudyResult | StudyResult = Field(
        description="What was found, of a bench (`StudyResult`) or of a declared machine (`MachineStudyResult`).")
    seconds: dict[str, float] = Field(description="Elapsed (wall-clock) time of each stage in s.")
    processor_seconds: dict[str, float] = Field(
        description="Processor time of each stage in s, summed over all threads of the worker.")


class FindingLaw(BaseModel):
    """The measured law of a finding."""

    finding: int = Field(description="Index (from 0) of the finding in the result of the study.")
    title: str = Field(description="The finding in words.")
    effect: str | None = Field(description="Effect of the catalogue, or of the machine; null if unlisted.")
    quantity: str = Field(description="Quantity of the model that changes.")
    depends_on: str = Field(description="What the change depends on.")
    law: Law = Field(description="The measured law.")
    equation: str | None = Field(description="Equation of the effect with its fitted coefficients in numbers and "
                                             "units; null where it was not fitted.")
    links: dict[str, str] = Field(description="Addresses of the law as JSON and, if it has points, as CSV, MATLAB, "
                                              "Modelica and C files, by format.")


class LawList(BaseModel):
    """The measured laws of a study."""

    laws: list[FindingLaw] = Field(description="The laws, in the order of the findings.")


class ModelSpec(BaseModel):
    """A model specification in the format that `slipstick build --model` reads."""

    parameters: dict[str, float] = Field(description="Values of the parameters, by name.")
    units: dict[str, str] = Field(description="Units of the parameters, by name.")
    effects: dict[str, dict[str, float]] = Field(description="Coefficients of the effects, by effect and coefficient.")
    bench: dict[str, Any] = Field(description="Physics of the bench: nominal parameters, converter curves, digest.")
    laws: list[dict[str, Any]] | None = Field(
        default=None, description="Measured laws, absent if the model has none: the change of a quantity at points of "
                                  "what it depends on, with units; linear between them, constant outside.")


StartModel = Annotated[ModelSpec | None, Field(
    description="A model of the bench, as `/v1/calibrations/{id}/model` and `/v1/studies/{id}/model` return it; by "
                "default that with the nominal parameters.")]


def model_input(bench: Bench | None, model: ModelSpec | None) -> dict[str, Any]:
    """The model of a job as part of its input, with its digest, both null without one.

    Raises `InvalidValue` and `UnknownName`, also for a model of another bench.
    """
    if bench is None or model is None:
        return {"model": None, "model_digest": None}
    parsed = model_of(bench, parse_model(model.model_dump(exclude_unset=True), "`model`"))
    return {"model": parsed.spec(), "model_digest": parsed.digest}
