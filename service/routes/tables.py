"""Lookup tables of shifting times: list and description."""

from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Path, Request, Response
from pydantic import BaseModel, Field

from slipstick.bench.conditions import CONDITION_UNITS
from slipstick.black_box import Cases
from slipstick.errors import SlipstickError
from slipstick.storage.library import Library
from slipstick.table import Grid, HeldOut, Surrogate, Table
from slipstick.table.subject import Setting

from ..bodies import JsonRoute
from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..paging import Limit, Offset, Page, page_links
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..schemas import Digest, LibraryDependency

router = APIRouter(prefix="/v1/tables", tags=["tables"], route_class=JsonRoute)


Kind = Literal["grid", "surrogate"]
_KIND = "`grid`: linear interpolation between simulated grid points. `surrogate`: a neural network trained on " \
        "simulations."


class SurrogateError(BaseModel):
    """Error of a surrogate against direct simulation at held-out random points, measured when it was built."""

    rms: float = Field(description="RMS error over points and conditions in s.")
    worst: float = Field(description="Largest absolute error over points and conditions in s.")
    points: int = Field(description="Number of held-out points.")


class ConditionError(BaseModel):
    """Error of a surrogate in one condition."""

    rms: float = Field(description="RMS error over the held-out points in s.")
    worst: float = Field(description="Largest absolute error over the held-out points in s.")


class Training(BaseModel):
    """Training and error of a surrogate."""

    runs: int = Field(description="Number of training points, each simulated under all conditions.")
    steps: int = Field(description="Number of optimization steps.")
    seed: int = Field(description="Seed of the training points and of the optimization.")
    error: SurrogateError
    errors: list[ConditionError] = Field(description="Error in each condition, in the order of the conditions.")


class TableEntry(BaseModel):
    """A table in the list of tables."""

    name: str = Field(description="Name of the table, as used by all operations.")
    kind: Kind | None = Field(description=f"{_KIND} Null if the file is invalid.")
    axes: list[str] = Field(description="Names of the parameters that the table varies, in the order of its axes.")
    shape: list[int] = Field(description="Number of grid points along each axis, followed by the number of conditions. "
                                         "For a surrogate only the number of conditions.")
    error: SurrogateError | None = Field(default=None, description="Error of a surrogate; null for a grid.")
    digest: str | None = Field(description="SHA-256 digest of the content; null if the file is invalid.")
    problem: str | None = Field(default=None, description="Why the file is invalid, and what to do; null if valid.")
    href: str = Field(description="Address of the description of the table.")


class TableList(Page):
    """A list of all tables."""

    tables: list[TableEntry] = Field(description="The tables, sorted by name.")


class AxisDescription(BaseModel):
    """An axis of a table."""

    name: str = Field(description="Name of the parameter.")
    unit: str = Field(description="Unit of the parameter.")
    nominal: float = Field(description="Nominal value in `unit`; the multiple 1 corresponds to this value.")
    values: list[float] = Field(description="Grid points in multiples of the nominal value; for a surrogate the lower "
                                            "and upper end of the axis.")


class Condition(BaseModel):
    """The operating condition of an experiment."""

    number: int = Field(description="Index of the condition in the table or the recordings, from 0.")
    current_profile: int = Field(description="Index of the current profile in `current_profiles`, from 0.")
    motor_speed: float = Field(description="Motor speed in rad/s.")
    load_inertia: float = Field(description="Inertia of the load in kg m^2.")
    brake_torque: float = Field(description="Brake torque on the load in N m.")


class MachineCondition(BaseModel):
    """A condition of another machine."""

    number: int = Field(description="Index of the condition in the table or the measurements, from 0.")
    values: dict[str, float] = Field(description="Value of each column, in the units of `condition_units`.")


Conditions = list[Condition | MachineCondition]
ConditionUnits = Annotated[dict[str, str], Field(description="Unit of each column of the conditions.")]


class CurrentProfile(BaseModel):
    """Valve current as a piecewise linear function of time."""

    time: list[float] = Field(description="Times of the breakpoints in s after the shift command.")
    current: list[float] = Field(description="Current at the breakpoints in A.")


class StatusCounts(BaseModel):
    """Number of simulated engagements by outcome."""

    locked: int = Field(description="Engagements that lock and so have a shifting time; runs with an output.")
    never_locked: int = Field(description="Engagements that do not lock before the end of the current profile; runs "
                                          "without an output.")
    failed: int = Field(description="Engagements whose simulation diverged; runs that failed or took too long.")


class TableDescription(BaseModel):
    """Description of a table."""

    name: str = Field(description="Name of the table.")
    kind: Kind = Field(description=_KIND)
    digest: Digest
    model_digest: str = Field(description="SHA-256 digest of `model`.")
    conditions_digest: str = Field(description="SHA-256 digest of the conditions.")
    origin: str = Field(description="How the table was computed.")
    axes: list[AxisDescription] = Field(description="The axes; all operations expect inputs in this order.")
    output: str = Field(description="What the table contains: `shifting_time`, or the output of another machine.")
    unit: str = Field(description="Unit of the output: s for shifting times. Otherwise, shifting times in s are "
                                  "values of this output in its unit, and densities are per thousandth of this unit.")
    statuses: StatusCounts | None = Field(description="Outcomes of the simulated engagements of a grid; null for a "
                                                      "surrogate, for which all engagements lock.")
    training: Training | None = Field(description="Training and error of a surrogate; null for a grid.")
    model: dict[str, Any] = Field(description="The simulated model: parameters, units, effects, physics of the bench, "
                                              "and measured laws if it has any.")
    conditions: Conditions = Field(description="The conditions, in order.")
    condition_units: ConditionUnits
    current_profiles: list[CurrentProfile] = Field(description="The current profiles of the conditions.")


TableNamePath = Annotated[str, Path(description="Name of the table.",
                                    openapi_examples={"nominal": {"summary": "The nominal table", "value": "nominal"}})]


@router.get("", summary="List the tables", response_model=TableList, responses=error_responses(503) | CSV_RESPONSE)
def list_tables(library: LibraryDependency, request: Request, limit: Limit = 1000, offset: Offset = 0,
                form: TableFormQuery = None) -> TableList | Response:
    """Return all tables. The content of each file is verified; an invalid file is listed with the reason."""
    names = library.tables()
    tables = [entry(library, name) for name in names[offset:offset + limit]]
    if wants_csv(request, form):
        return entries_csv(tables, TableEntry, "tables")
    return TableList(tables=tables, total=len(names),
                     links=page_links(request, limit, offset, len(names)))


@router.get("/{name}", summary="Describe a table", responses=error_responses(404, 503) | NOT_MODIFIED)
def describe_table(name: TableNamePath, library: LibraryDependency,
                   client: RevalidationDependency) -> TableDescription:
    """Return the axes with their units, the digests, the simulated model, the accuracy and the conditions."""
    table = library.table(name)
    client.require_change(table.digest, table.origin)
    return describe(name, table)


def describe(name: str, table: Table) -> TableDescription:
    """Return the table `name` as the service describes it."""
    return TableDescription(
        name=name, kind=table.kind, digest=table.digest, model_digest=table.model.digest,
        conditions_digest=table.conditions.digest, origin=table.origin,
        model=table.model.spec(), output=table.output.name, unit=table.output.unit,
        axes=[AxisDescription(name=axis.name, unit=axis.unit, nominal=axis.nominal, values=axis.values.tolist())
              for axis in table.axes],
        statuses=_statuses(table) if isinstance(table, Grid) else None,
        training=_training(table) if isinstance(table, Surrogate) else None,
        conditions=list_conditions(table.conditions), current_profiles=list_profiles(table.conditions),
        condition_units=condition_units(table.conditions))


def list_conditions(conditions: Setting) -> list[Condition | MachineCondition]:
    """Return the conditions as response models."""
    if isinstance(conditions, Cases):
        quantities = [quantity.name for quantity in conditions.quantities]
        return [MachineCondition(number=number, values=dict(zip(quantities, row, strict=True)))
                for number, row in enumerate(conditions.values.tolist())]
    names = ("current_profile", "motor_speed", "load_inertia", "brake_torque")
    rows = zip(*(getattr(conditions, name).tolist() for name in names), strict=True)
    return [Condition(number=number, **dict(zip(names, row, strict=True))) for number, row in enumerate(rows)]


def condition_units(conditions: Setting) -> dict[str, str]:
    """Unit of each column of the conditions."""
    return {quantity.name: quantity.unit for quantity in conditions.quantities} if isinstance(conditions, Cases) \
        else dict(CONDITION_UNITS)


def list_profiles(conditions: Setting) -> list[CurrentProfile]:
    """Return the current profiles as response models; another machine has none."""
    if isinstance(conditions, Cases):
        return []
    return [CurrentProfile(time=time.tolist(), current=current.tolist())
            for time, current in zip(conditions.profile_time, conditions.profile_current, strict=True)]


def entry(library: Library, name: str) -> TableEntry:
    """Return the entry of a list of tables, also of an invalid file."""
    href = f"/v1/tables/{name}"
    try:
        return TableEntry(name=name, href=href, **library.derive_from_table(name, _summarize))
    except SlipstickError as error:
        return TableEntry(name=name, kind=None, axes=[], shape=[], digest=None, problem=str(error), href=href)


def _summarize(table: Table) -> dict[str, Any]:
    return {"kind": table.kind, "axes": [axis.name for axis in table.axes], "digest": table.digest,
            "shape": [*(len(knots) for knots in table.knots or ()), len(table.conditions)],
            "error": _error(table.error) if isinstance(table, Surrogate) else None}


def _statuses(table: Grid) -> StatusCounts:
    locked, never_locked, failed = np.bincount(table.status.ravel(), minlength=3)
    return StatusCounts(locked=locked, never_locked=never_locked, failed=failed)


def _training(table: Surrogate) -> Training:
    errors = zip(table.error.rms.tolist(), table.error.worst.tolist(), strict=True)
    return Training(runs=table.runs, steps=table.steps, seed=table.seed, error=_error(table.error),
                    errors=[ConditionError(rms=rms, worst=worst) for rms, worst in errors])


def _error(error: HeldOut) -> SurrogateError:
    return SurrogateError(rms=error.overall_rms, worst=float(error.worst.max()), points=error.points)
