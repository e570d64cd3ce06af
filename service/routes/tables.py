"""The tables: which there are, and what each says about itself."""

from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Path
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.problem_details import responses
from service.schemas import Digest, TheLibrary
from slipstick.clutch.conditions import Conditions
from slipstick.errors import SlipstickError
from slipstick.table import Grid, HeldOut, Surrogate

router = APIRouter(prefix="/v1/tables", tags=["tables"], route_class=JsonRoute)


Kind = Literal["grid", "surrogate"]
"""A grid is interpolated linearly between simulated points; a surrogate is a network trained on simulations."""


class StatedError(BaseModel):
    """Error of a surrogate against direct simulation, measured when it was built, at points it was not trained on."""

    rms: float = Field(description="Root of the mean squared error over points and conditions in s.")
    worst: float = Field(description="Largest error at any point and condition in s.")
    points: int = Field(description="Random points in the box at which it was measured.")


class ConditionError(BaseModel):
    """Stated error of a surrogate in one condition."""

    rms: float = Field(description="Root of the mean squared error over the points in s.")
    worst: float = Field(description="Largest error at any of the points in s.")


class Training(BaseModel):
    """What a surrogate was made of."""

    runs: int = Field(description="Simulated points it was trained on, each under all conditions.")
    steps: int = Field(description="Steps of the training.")
    seed: int = Field(description="Seed of points and training.")
    error: StatedError
    errors: list[ConditionError] = Field(description="The same for each condition, in their order.")


class TableEntry(BaseModel):
    """A table in the list."""

    name: str = Field(description="Name, as in the other operations.")
    kind: Kind | None = Field(description="What it is; null where the file cannot be trusted.")
    axes: list[str] = Field(description="Parameters that the table varies, in the order of its axes.")
    shape: list[int] = Field(description="Grid points along each axis (none for a surrogate), then the number of "
                                         "conditions.")
    error: StatedError | None = Field(default=None, description="Error that a surrogate states; null for a grid.")
    digest: str | None = Field(description="Content digest (SHA-256); null where the file cannot be trusted.")
    problem: str | None = Field(default=None, description="Why the file cannot be trusted, and what to do.")
    href: str = Field(description="Address of the description.")


class TableList(BaseModel):
    """All tables."""

    tables: list[TableEntry] = Field(description="In the order of their names.")


class AxisDescription(BaseModel):
    """One axis of a table."""

    name: str = Field(description="Parameter.")
    unit: str = Field(description="Unit of the nominal value.")
    nominal: float = Field(description="Nominal value in `unit`: what the multiplier 1 stands for.")
    values: list[float] = Field(description="Grid in multiples of the nominal value; the two ends for a surrogate.")


class Condition(BaseModel):
    """One experiment."""

    number: int = Field(description="Number of the condition in the table or recordings, from 0.")
    current_profile: int = Field(description="Index of its current profile.")
    motor_speed: float = Field(description="Motor speed in rad/s.")
    load_inertia: float = Field(description="Inertia of the load in kg m^2.")
    brake_torque: float = Field(description="Brake torque on the load in N m.")


class CurrentProfile(BaseModel):
    """A valve current over time, straight between its breakpoints."""

    time: list[float] = Field(description="Breakpoints in s after the shift command.")
    current: list[float] = Field(description="Current there in A.")


class StatusCounts(BaseModel):
    """How the simulated engagements ended."""

    locked: int = Field(description="Engagements that have a shifting time.")
    never_locked: int = Field(description="Engagements that did not lock before the current profile ended.")
    failed: int = Field(description="Engagements whose numbers blew up.")


class TableDescription(BaseModel):
    """What a table says about itself."""

    name: str = Field(description="Name of the table.")
    kind: Kind = Field(description="What it is: a grid, or a surrogate trained on simulations.")
    digest: Digest
    model_digest: str = Field(description="SHA-256 of `model`.")
    conditions_digest: str = Field(description="SHA-256 of the conditions.")
    origin: str = Field(description="Who computed it, and how accurately.")
    axes: list[AxisDescription] = Field(description="The axes, in the order of the inputs of every operation.")
    unit: str = Field(default="s", description="Unit of the tabulated shifting times.")
    statuses: StatusCounts | None = Field(description="How the engagements of a grid ended; null for a surrogate, "
                                                      "which is refused where one does not lock.")
    training: Training | None = Field(description="What a surrogate was made of and how far off it is; null for a "
                                                  "grid.")
    model: dict[str, Any] = Field(description="Parameters with units, effects, and torque converter of the model.")
    conditions: list[Condition] = Field(description="The experiments, in their order.")
    current_profiles: list[CurrentProfile] = Field(description="The current profiles the conditions refer to.")


TableInPath = Annotated[str, Path(description="Name of the table.",
                                  openapi_examples={"nominal": {"summary": "The nominal table", "value": "nominal"}})]


@router.get("", summary="List the tables", responses=responses())
def list_tables(library: TheLibrary) -> TableList:
    """Every table in the folder, verified; one that cannot be trusted is listed with the reason."""
    return TableList(tables=[_entry(library, name) for name in library.tables()])


@router.get("/{name}", summary="Describe a table", responses=responses(404))
def describe_table(name: TableInPath, library: TheLibrary) -> TableDescription:
    """Axes with units, digests, the model it was computed with, how good it is, and its conditions."""
    table = library.table(name)
    return TableDescription(
        name=name, kind=table.kind, digest=table.digest, model_digest=table.model.digest,
        conditions_digest=table.conditions.digest, origin=table.origin, model=table.model.spec(), unit="s",
        axes=[AxisDescription(name=axis.name, unit=axis.unit, nominal=axis.nominal, values=axis.values.tolist())
              for axis in table.axes],
        statuses=_statuses(table) if isinstance(table, Grid) else None,
        training=_training(table) if isinstance(table, Surrogate) else None,
        conditions=list_conditions(table.conditions), current_profiles=list_profiles(table.conditions))


def list_conditions(conditions: Conditions) -> list[Condition]:
    """The conditions as JSON."""
    names = ("current_profile", "motor_speed", "load_inertia", "brake_torque")
    rows = zip(*(getattr(conditions, name).tolist() for name in names), strict=True)
    return [Condition(number=number, **dict(zip(names, row, strict=True))) for number, row in enumerate(rows)]


def list_profiles(conditions: Conditions) -> list[CurrentProfile]:
    """The current profiles as JSON."""
    return [CurrentProfile(time=time.tolist(), current=current.tolist())
            for time, current in zip(conditions.profile_time, conditions.profile_current, strict=True)]


def _entry(library: TheLibrary, name: str) -> TableEntry:
    href = f"/v1/tables/{name}"
    try:
        table = library.table(name)
    except SlipstickError as error:
        return TableEntry(name=name, kind=None, axes=[], shape=[], digest=None, problem=str(error), href=href)
    return TableEntry(name=name, kind=table.kind, axes=[axis.name for axis in table.axes],
                      shape=[*(len(knots) for knots in table.knots or ()), len(table.conditions)],
                      error=_error(table.error) if isinstance(table, Surrogate) else None, digest=table.digest,
                      href=href)


def _statuses(table: Grid) -> StatusCounts:
    locked, never_locked, failed = np.bincount(table.status.ravel(), minlength=3)
    return StatusCounts(locked=locked, never_locked=never_locked, failed=failed)


def _training(table: Surrogate) -> Training:
    each = zip(table.error.rms.tolist(), table.error.worst.tolist(), strict=True)
    return Training(runs=table.runs, steps=table.steps, seed=table.seed, error=_error(table.error),
                    errors=[ConditionError(rms=rms, worst=worst) for rms, worst in each])


def _error(error: HeldOut) -> StatedError:
    return StatedError(rms=error.overall_rms, worst=float(error.worst.max()), points=error.points)
