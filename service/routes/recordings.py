"""Recordings: list, description and upload."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Query, Request, Response
from pydantic import BaseModel, Field

from slipstick.black_box import Measurements, Quantity
from slipstick.errors import InvalidValue, SlipstickError
from slipstick.machine import Runs
from slipstick.recordings import Form, Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.storage.library import Library

from ..bodies import JsonRoute, require_media_type
from ..computations import reads_upload
from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..paging import Limit, Offset, Page, page_links
from ..problem_details import Conflict
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..routes.tables import (
    Conditions,
    ConditionUnits,
    CurrentProfile,
    condition_units,
    list_conditions,
    list_profiles,
)
from ..schemas import SIMULATED, Digest, LibraryDependency

router = APIRouter(prefix="/v1/recordings", tags=["recordings"], route_class=JsonRoute)

_FORMS: dict[str, Form] = {"application/x-hdf5": "h5", "text/csv": "csv"}
_CSV = """# two fictitious engagements
current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]
0,104.7197551,6,20,0.9
0,104.7197551,6,50,0.95
"""
_UPLOAD_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {
    "text/csv": {"schema": {"type": "string"}, "example": _CSV},
    "application/x-hdf5": {"schema": {"type": "string", "format": "binary"}},
}}}


class RecordingsEntry(BaseModel):
    """Recordings in the list of recordings."""

    name: str = Field(description="Name of the recordings, as used by all operations.")
    engagements: int | None = Field(description="Number of recorded engagements; null if the file is invalid.")
    digest: str | None = Field(description="SHA-256 digest of all numbers; null if the file is invalid.")
    description: str = Field(description=f"Description stored in the file. {SIMULATED}")
    problem: str | None = Field(default=None, description="Why the file is invalid, and what to do; null if valid.")
    href: str = Field(description="Address of the description of the recordings.")


class RecordingsList(Page):
    """A list of all recordings."""

    recordings: list[RecordingsEntry] = Field(description=f"The recordings, sorted by name. {SIMULATED}")


class SignalsDescription(BaseModel):
    """Description of the recorded signals."""

    units: dict[str, str] = Field(description="Units of the recorded signals, by name: all or some of pressure, "
                                               "input_speed, output_speed and output_torque.")
    samples: int = Field(description="Number of samples of each signal in each engagement.")
    start: float = Field(description="Time of the first sample in s after the shift command.")
    end: float = Field(description="Time of the last sample in s after the shift command.")


class RunsDescription(BaseModel):
    """Description of recorded runs of a declared machine."""

    name: str = Field(description="Name of the recordings.")
    digest: Digest
    description: str = Field(description="Description stored in the file.")
    machine: str = Field(description="Name of the machine, of which a worker needs the file to study the runs.")
    runs: int = Field(description="Number of runs.")
    names: list[str] = Field(description="Where each run is from, such as the file; empty where the recordings do not "
                                         "say so.")
    samples: int = Field(description="Number of samples of each signal in each run.")
    start: float = Field(description="Time of the first sample in s.")
    end: float = Field(description="Time of the last sample in s.")
    signals: list[str] = Field(description="Names of the measured signals.")
    commands: list[str] = Field(description="Names of the commands.")
    conditions: dict[str, list[float]] = Field(description="Value of each condition in each run, by name.")
    channels: list[str] = Field(description="Names of further channels.")
    units: dict[str, str] = Field(description="Units of all of them, by name.")

    @classmethod
    def of(cls, name: str, runs: Runs) -> "RunsDescription":
        """The runs `name` as the service describes them."""
        return cls(name=name, digest=runs.digest, description=runs.description, machine=runs.machine, runs=len(runs),
                   names=list(runs.names),
                   samples=len(runs.time), start=runs.time[0], end=runs.time[-1], signals=list(runs.signals),
                   commands=list(runs.commands), channels=list(runs.channels), units=dict(runs.units),
                   conditions={name: values.tolist() for name, values in runs.conditions.items()})


class RecordingsDescription(BaseModel):
    """Description of recordings."""

    name: str = Field(description="Name of the recordings.")
    digest: Digest
    conditions_digest: str = Field(description="SHA-256 digest of the conditions.")
    description: str = Field(description=f"Description stored in the file. {SIMULATED}")
    output: str = Field(description="What was measured: `shifting_time`, or the output of another machine.")
    unit: str = Field(description="Unit of the output: s for shifting times.")
    measured_time: list[float] = Field(description="Measured output of each engagement, in `unit`.")
    run_order: list[int] | None = Field(description="Position of each engagement in the order of the runs, from 0; "
                                                    "null if the order is unknown.")
    signals: SignalsDescription | None = Field(description="The recorded signals; null if only shifting times were "
                                                           "recorded.")
    conditions: Conditions = Field(description="The condition of each engagement.")
    condition_units: ConditionUnits
    current_profiles: list[CurrentProfile] = Field(description="The current profiles of the conditions.")


RecordingsNamePath = Annotated[str, Path(description="Name of the recordings.", openapi_examples={
    "measured": {"summary": "The recordings shipped with Slipstick (simulated)", "value": "measured"}})]
NewRecordingsName = Annotated[str, Query(
    description="Name of the new recordings: up to 64 letters, digits, - and _, starting with a letter or digit.",
    openapi_examples={"mine": {"summary": "A new name", "value": "two-engagements"}})]


RecordingsBench = Annotated[str | None, Query(
    description="Name of the bench whose current profiles a CSV file numbers; required for CSV.",
    openapi_examples={"heavy": {"summary": "The shipped bench of the recordings `measured`", "value": "heavy"}})]


MachineTable = Annotated[str | None, Query(
    description="Name of a table of another machine, of which a CSV file holds measurements: a column for each column "
                "of the conditions and one for the output, with units. Instead of `bench`.")]


async def _upload_body(request: Request) -> tuple[Form, bytes]:
    return _FORMS[require_media_type(request, *_FORMS)], await request.body()


@router.get("", summary="List the recordings", response_model=RecordingsList,
            responses=error_responses(503) | CSV_RESPONSE)
def list_recordings(library: LibraryDependency, request: Request, limit: Limit = 1000, offset: Offset = 0,
                    form: TableFormQuery = None) -> RecordingsList | Response:
    """Return all recordings; an invalid file is listed with the reason."""
    names = library.recordings()
    recordings = [entry(library, name) for name in names[offset:offset + limit]]
    if wants_csv(request, form):
        return entries_csv(recordings, RecordingsEntry, "recordings")
    return RecordingsList(recordings=recordings, total=len(names),
                          links=page_links(request, limit, offset, len(names)))


@router.get("/{name}", summary="Describe recordings", responses=error_responses(404, 503) | NOT_MODIFIED)
def describe_recordings(name: RecordingsNamePath, library: LibraryDependency,
                        client: RevalidationDependency) -> RecordingsDescription | RunsDescription:
    """Return the measured shifting times, the conditions, and a description of the recorded signals."""
    recordings = library.recorded(name)
    machine = recordings.machine if isinstance(recordings, Runs) else ""
    client.require_change(recordings.digest, recordings.description, machine)  # the digest is one of the numbers only
    return describe(name, recordings)


@router.post("", summary="Upload recordings", status_code=201, openapi_extra=_UPLOAD_BODY,
             responses=error_responses(404, 408, 409, 413, 415, 503) | {200: {
                 "description": "Identical recordings already existed under this name",
                 "model": RecordingsDescription | RunsDescription}})
@reads_upload
def upload_recordings(name: NewRecordingsName, upload: Annotated[tuple[Form, bytes], Depends(_upload_body)],
                      library: LibraryDependency, response: Response,
                      bench: RecordingsBench = None,
                      table: MachineTable = None) -> RecordingsDescription | RunsDescription:
    """Check a recordings file and store it.

    The request body is the file itself. A CSV file (Content-Type text/csv) has one row per engagement, with its
    condition and its shifting time, and numbers the current profiles of a `bench`; send it with `curl --data-binary
    @bench.csv --header 'Content-Type: text/csv'`. It is stored as HDF5. An HDF5 file (Content-Type application/x-hdf5)
    can contain signals as well, or runs of a declared machine, as `slipstick import --machine` writes them. With
    `table` instead of `bench`, the CSV holds measurements of the machine of that table. An existing file is never
    replaced: the upload of different content under an existing name is rejected with 409.
    """
    form, content = upload
    return store(library, response, name, content, form, bench, table)


def store(library: Library, response: Response, name: str, content: bytes, form: Form,
          bench: str | None = None, table: str | None = None) -> RecordingsDescription | RunsDescription:
    """Store recordings and set the Location of the response; its status is 200 if the same ones have this name already.

    Raises `Conflict` if other ones have it.
    """
    if table is not None and (form != "csv" or bench is not None):
        raise InvalidValue("Measurements of another machine are a CSV file without a bench",
                           "Send text/csv with either `bench` or `table`")
    stored: Recordings | Measurements | Runs
    try:
        stored = (library.add_recordings(name, content, form, bench) if table is None else
                  library.add_measurements(name, content, table))
    except FileExistsError:
        same = (library.read_recordings(content, form, bench) if table is None else
                library.read_measurements(content, table))
        if name not in library.recordings() or library.recorded(name).digest != same.digest:
            raise Conflict(f"A different file named '{name}' already exists", "Choose another name") from None
        stored, response.status_code = library.recorded(name), 200
    response.headers["Location"] = f"/v1/recordings/{name}"
    return describe(name, stored)


def describe(name: str, recordings: Recordings | Measurements | Runs) -> RecordingsDescription | RunsDescription:
    """The recordings `name` as the service describes them."""
    if isinstance(recordings, Runs):
        return RunsDescription.of(name, recordings)
    output, order, signals = ((recordings.output, None, None) if isinstance(recordings, Measurements) else
                              (Quantity("shifting_time", "s"), recordings.run_order, recordings.signals))
    return RecordingsDescription(
        name=name, digest=recordings.digest, conditions_digest=recordings.conditions.digest,
        description=recordings.description, output=output.name, unit=output.unit,
        measured_time=recordings.measured_time.tolist(), run_order=None if order is None else order.tolist(),
        signals=None if signals is None else SignalsDescription(
            units={signal: SIGNAL_UNITS[signal] for signal in signals.names}, samples=len(signals.time),
            start=signals.time[0], end=signals.time[-1]),
        conditions=list_conditions(recordings.conditions), current_profiles=list_profiles(recordings.conditions),
        condition_units=condition_units(recordings.conditions))


def entry(library: Library, name: str) -> RecordingsEntry:
    """Return the entry of a list of recordings, also of an invalid file."""
    href = f"/v1/recordings/{name}"
    try:
        return RecordingsEntry(name=name, href=href, **library.derive_from_recorded(name, _summarize))
    except SlipstickError as error:
        return RecordingsEntry(name=name, engagements=None, digest=None, description="", problem=str(error), href=href)


def _summarize(recordings: Recordings | Measurements | Runs) -> dict[str, Any]:
    return {"engagements": len(recordings), "digest": recordings.digest, "description": recordings.description}
