"""Machines whose files workers have: list and description, as the workers tell them."""

import math
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Path, Request, Response
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from slipstick.errors import SlipstickError

from ..bodies import JsonRoute
from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..machines import MachinesDependency, StoredMachine
from ..paging import Limit, Offset, Page, page_links
from ..revalidation import NOT_MODIFIED, RevalidationDependency

router = APIRouter(prefix="/v1/machines", tags=["machines"], route_class=JsonRoute)


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


Number = Annotated[float | None, BeforeValidator(_finite)]
"""A number of a declaration; null where there is none, or one that is not finite, which JSON has not."""
Name = Annotated[str, Field(description="Name, by which equations and jobs know it.")]
Unit = Annotated[str, Field(description="Unit; empty or 1 for none.")]


class Declared(BaseModel):
    """A part of a declaration."""

    model_config = ConfigDict(from_attributes=True)


class DeclaredParameter(Declared):
    """A constant of the equations, which may scatter between runs."""

    name: Name
    unit: Unit
    value: Number = Field(description="Nominal value; null where none is declared.")
    within: Number = Field(description="Standard deviation by which the mean over the runs is known, of the logarithm "
                                       "of its factor, or in units of `scale`; null where it is estimated.")
    scatter: Number = Field(description="Largest standard deviation of the same between runs.")
    scale: Number = Field(description="Unit of changes that are added; null where a change is a factor.")
    first_of: str | None = Field(description="Signal whose first sample is the value in recordings; null for none.")


class DeclaredQuantity(Declared):
    """A place of the equations that a law may change."""

    name: Name
    unit: Unit
    relative: bool = Field(description="Whether it is a share.")
    size: Number = Field(description="A large change, in `unit`.")
    over: list[str] | None = Field(description="On what alone it may depend; null for everything.")
    without: list[str] = Field(description="On what it cannot depend, for a physical reason.")
    disturbance: Number = Field(description="Largest standard deviation by which it fluctuates within a run.")


class DeclaredCurve(Declared):
    """An error of a curve of the data sheet."""

    quantity: str = Field(description="Quantity that has the error.")
    over: str = Field(description="Own variable over which the curve is.")
    within: Number = Field(description="Standard deviation of the error.")
    knots: int = Field(description="Number of coefficients.")


class DeclaredBlock(Declared):
    """A part of a machine between signals."""

    name: Name
    reads: list[str] = Field(description="Commands, conditions and signals that its equations read.")
    gives: list[str] = Field(description="Measured signals that it gives.")
    states: list[str] = Field(description="States that are integrated.")
    switches: list[str] = Field(description="States that may rest at 0, as with dry friction.")
    derived: list[str] = Field(description="Further own variables that laws may depend on.")
    parameters: list[DeclaredParameter] = Field(description="Its parameters.")
    quantities: list[DeclaredQuantity] = Field(description="Its quantities.")
    curves: list[DeclaredCurve] = Field(description="Curves of data sheets.")


class DeclaredSensor(Declared):
    """A measured signal."""

    signal: str = Field(description="Name of the signal.")
    unit: Unit
    noise: Number = Field(description="Standard deviation of the noise of simulated runs.")
    without: list[str] = Field(description="On what its error cannot depend.")


class DeclaredCommand(Declared):
    """An input that is known as a function of time."""

    name: Name
    unit: Unit
    profiles: list[list[tuple[Number, Number]]] = Field(
        description="Profiles of the machine's own experiments: corners (time in s, value), linear between them and "
                    "constant beyond.")


class DeclaredCondition(Declared):
    """A constant of a run that its protocol states."""

    name: Name
    unit: Unit
    levels: list[Number] = Field(description="Levels of the machine's own experiments.")
    within: Number = Field(description="Relative standard deviation of the error of its levels.")
    scatter: Number = Field(description="Largest relative standard deviation between runs.")
    drifts: bool = Field(description="Whether its error may change over the order of the runs.")


class DeclaredOutput(Declared):
    """A number of a run, which tables, propagations and fits are about."""

    name: Name
    unit: Unit
    of: str = Field(description="Signal that it is of.")
    above: Number = Field(description="Level above which the signal rises first, at the time that it is; or null.")
    below: Number = Field(description="Level below which the signal falls first, at the time that it is; or null.")
    take: str = Field(description="Without a level, what it is of the signal: end, largest, smallest or mean.")


class DeclaredEffect(Declared):
    """A physical effect by its name: what a law of this kind is called."""

    name: Name
    quantity: str = Field(description="Quantity that it changes.")
    on: str = Field(description="On what the change depends.")
    kind: str = Field(description="Kind of the law.")


class Declaration(Declared):
    """What a machine declares, without its equations."""

    blocks: list[DeclaredBlock] = Field(description="The blocks.")
    sensors: list[DeclaredSensor] = Field(description="The measured signals.")
    commands: list[DeclaredCommand] = Field(description="The commands.")
    conditions: list[DeclaredCondition] = Field(description="The conditions.")
    signals: list[str] = Field(description="Names of further signals that laws may depend on.")
    inputs: list[str] = Field(description="Names of recorded channels that only equations read.")
    duration: Number = Field(description="Duration of an experiment in s; 0 where none is declared.")
    step: Number = Field(description="Time between two samples in s; 0 where none is declared.")
    experiments: int = Field(description="Number of the machine's own experiments; 0 where it does not say how it is "
                                         "run.")
    outputs: list[DeclaredOutput] = Field(description="The outputs.")
    effects: list[DeclaredEffect] = Field(description="The effects that have names.")


class TableInput(Declared):
    """An input over which tables of a machine can have an axis."""

    name: str = Field(description="Name of the input, as builds and tables have it.")
    unit: Unit
    nominal: float = Field(description="Value at the multiple 1, in `unit`.")
    lower: float = Field(description="Lowest multiple that is simulated.")
    upper: float = Field(description="Highest multiple that is simulated.")
    points: int = Field(description="Number of points of an axis by default.")


class TableOutput(BaseModel):
    """An output of which tables can be built."""

    name: str = Field(description="Name of the output, as builds have it.")
    unit: Unit
    inputs: list[TableInput] = Field(description="The inputs.")
    condition_units: dict[str, str] = Field(description="Unit of each column of the conditions.")
    conditions: int = Field(description="Number of conditions that are simulated.")
    simulator: str = Field(description="The simulator, in words.")


class MachineEntry(BaseModel):
    """A machine in the list of machines."""

    name: str = Field(description="Name of the machine, as jobs have it.")
    workers: int = Field(description="Number of running workers that have its file; without one, its jobs cannot be "
                                     "done.")
    blocks: list[str] = Field(description="Names of its blocks; empty for a machine whose equations are not declared.")
    outputs: list[str] = Field(description="Names of the outputs of which tables can be built.")
    experiments: int = Field(description="Number of the machine's own experiments.")
    problem: str | None = Field(default=None, description="Why its description cannot be read; null if it can.")
    href: str = Field(description="Address of the description of the machine.")


class MachineList(Page):
    """A list of all machines."""

    machines: list[MachineEntry] = Field(description="The machines, sorted by name.")


class MachineDetails(BaseModel):
    """Description of a machine."""

    name: str = Field(description="Name of the machine, as jobs have it.")
    workers: int = Field(description="Number of running workers that have its file.")
    declaration: Declaration | None = Field(
        description="What its file declares; null for a machine that is simulated by another program.")
    outputs: list[TableOutput] = Field(description="The outputs of which tables can be built (POST /v1/builds).")


MachineNamePath = Annotated[str, Path(description="Name of the machine.", openapi_examples={
    "dc-motor": {"summary": "The shipped drive, if a worker has it (`slipstick work --machine dc_motor`)",
                 "value": "dc motor"}})]


@router.get("", summary="List the machines", response_model=MachineList, responses=error_responses(503) | CSV_RESPONSE)
def list_machines(machines: MachinesDependency, request: Request, limit: Limit = 1000, offset: Offset = 0,
                  form: TableFormQuery = None) -> MachineList | Response:
    """Return the machines that workers were given (`slipstick work --machine FILE`), also those that no running worker
    has any more."""
    stored = machines.read_all()
    entries = [entry(each) for each in stored[offset:offset + limit]]
    if wants_csv(request, form):
        return entries_csv(entries, MachineEntry, "machines")
    return MachineList(machines=entries, total=len(stored), links=page_links(request, limit, offset, len(stored)))


@router.get("/{name:path}", summary="Describe a machine", responses=error_responses(404, 503) | NOT_MODIFIED)
def describe_machine(name: MachineNamePath, machines: MachinesDependency,
                     client: RevalidationDependency) -> MachineDetails:
    """Return what the file of a machine declares, without its equations: blocks, parameters, quantities, sensors,
    commands, conditions, outputs and effects; and the outputs of which tables can be built."""
    stored = machines.find(name)
    known = stored.known
    client.require_change(stored.content, str(stored.workers))
    return MachineDetails(
        name=name, workers=stored.workers,
        declaration=None if known.declared is None else Declaration.model_validate(known.declared),
        outputs=[TableOutput(
            name=each.about.output.name, unit=each.about.output.unit, conditions=each.conditions,
            inputs=[TableInput(**vars(given), points=points)
                    for given, points in zip(each.about.inputs, each.points, strict=False)],
            condition_units={column.name: column.unit for column in each.about.columns},
            simulator=each.about.simulator) for each in known.outputs])


def entry(stored: StoredMachine) -> MachineEntry:
    """Return the entry of a list of machines, also of one whose description cannot be read."""
    href = f"/v1/machines/{quote(stored.name)}"
    try:
        known = stored.known
    except SlipstickError as error:
        return MachineEntry(name=stored.name, workers=stored.workers, blocks=[], outputs=[], experiments=0,
                            problem=str(error), href=href)
    return MachineEntry(name=stored.name, workers=stored.workers, href=href, experiments=known.experiments,
                        outputs=[each.about.output.name for each in known.outputs],
                        blocks=[] if known.declared is None else [each.name for each in known.declared.blocks])
