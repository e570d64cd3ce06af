"""Request and response bodies of builds, which make tables."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field, Strict

from slipstick.time_budget import DEFAULT

from .jobs import Ahead, Job, MissingMachine, Progress, TimeBudget
from .paging import Page
from .routes.tables import StatusCounts
from .schemas import StrictModel, TableDigest
from .study_schemas import StartModel

Accuracy = Annotated[Literal["default", "tight"], Field(
    description="Accuracy of the time integration of a clutch: shifting times of `default` are within 1e-4 s of those "
                "of `tight`.")]
Span = Annotated[tuple[float, float, Annotated[int, Field(ge=2, le=1_000_000)]], Strict(False)]


class BuildRequest(StrictModel):
    """A build of a table, of a bench or of another machine."""

    name: str = Field(description="Name of the new table: up to 64 letters, digits, - and _, starting with a letter or "
                                  "digit.", examples=["new-table"])
    bench: str | None = Field(default=None, description="Name of the bench, see /v1/benches; by default that of "
                                                        "`model`.", examples=["heavy"])
    machine: str | None = Field(
        default=None, max_length=200, description="Instead of a bench, the name of a declared machine, or the title of "
                                                  "another one, whose file the worker needs (`work --machine FILE`).")
    output: str | None = Field(default=None, max_length=200, description="Output of the machine; by default the first.")
    axes: dict[str, Span] | None = Field(
        default=None, min_length=1, max_length=20, examples=[{"pressure_bias": [0.8, 1.2, 9]}],
        description="Axes by parameter: lowest and highest multiple of its value in the model, and the number of "
                    "equidistant grid points. By default pressure_bias and initial_position from 0.5 to 1.5 with 50 "
                    "points each for a bench; for a machine all inputs over their ranges, with so many points that "
                    "the table has at most 100,000 runs.")
    model: StartModel = None
    recordings: str | None = Field(default=None, description="Recordings whose conditions are simulated; by default "
                                                             "the conditions are those of the bench.")
    accuracy: Accuracy = "default"
    time_budget: TimeBudget = DEFAULT


class Build(Job):
    """A build without its progress and result."""

    name: str = Field(description="Name of the table.")
    bench: str | None = Field(description="Name of the bench; null for another machine.")
    bench_digest: str | None = Field(description="SHA-256 digest of the physics of the bench.")
    machine: str | None = Field(description="Name of another machine; null for a bench.")
    output: str | None = Field(description="Output of the machine; null for the first, and for a bench.")
    axes: dict[str, tuple[float, float, int]] | None = Field(
        description="Lowest and highest multiple, and number of points, by parameter; null for all inputs of a "
                    "machine.")
    model_digest: str | None = Field(description="SHA-256 digest of the model; null for the nominal one of the bench.")
    recordings: str | None = Field(description="Name of the recordings with the conditions; null for those of the "
                                               "bench.")
    recordings_digest: str | None = Field(description="SHA-256 digest of these recordings.")
    accuracy: Accuracy


class BuildWithProgress(Build):
    """A build with its progress."""

    ahead: Ahead
    missing_machine: MissingMachine = None
    progress: Progress | None = Field(description="Progress; null before the first runs.")


class BuildList(Page):
    """A list of builds."""

    builds: list[Build] = Field(description="The builds, newest first.")


class BuiltTable(BaseModel):
    """The table of a finished build, as it was then; `/v1/tables/{name}` describes it."""

    digest: TableDigest
    shape: list[int] = Field(description="Number of grid points along each axis, followed by the number of conditions.")
    statuses: StatusCounts = Field(description="Outcomes of the runs.")


class FinishedBuild(BaseModel):
    """The result of a finished build."""

    id: str = Field(description="Id of the build.")
    name: str = Field(description="Name of the table.")
    result: BuiltTable
    seconds: dict[str, float] = Field(description="Elapsed (wall-clock) time of each stage in s.")
    processor_seconds: dict[str, float] = Field(
        description="Processor time of each stage in s, summed over all threads of the worker.")
