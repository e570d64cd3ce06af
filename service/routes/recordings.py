"""The recordings: which there are, what each holds, and the way to add some."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Query, Request, Response
from pydantic import BaseModel, Field

from service.bodies import JsonRoute, require_media
from service.problem_details import Conflict, responses
from service.routes.tables import Condition, CurrentProfile, list_conditions, list_profiles
from service.schemas import SIMULATED, Digest, TheLibrary
from slipstick.errors import SlipstickError
from slipstick.recordings import Form, Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.storage.library import Library

router = APIRouter(prefix="/v1/recordings", tags=["recordings"], route_class=JsonRoute)

_FORMS: dict[str, Form] = {"application/x-hdf5": "h5", "text/csv": "csv"}
_CSV = """# two engagements, made up for this page
current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]
0,104.7197551,6,20,0.9
0,104.7197551,6,50,0.95
"""
_UPLOAD: dict[str, Any] = {"requestBody": {"required": True, "content": {
    "text/csv": {"schema": {"type": "string"}, "example": _CSV},
    "application/x-hdf5": {"schema": {"type": "string", "format": "binary"}},
}}}


class RecordingsEntry(BaseModel):
    """Recordings in the list."""

    name: str = Field(description="Name, as in the other operations.")
    engagements: int | None = Field(description="Number of recorded engagements; null where the file is bad.")
    digest: str | None = Field(description="Digest (SHA-256) of all numbers; null where the file is bad.")
    description: str = Field(description=f"What the file says about itself. {SIMULATED}")
    problem: str | None = Field(default=None, description="Why the file cannot be used, and what to do.")
    href: str = Field(description="Address of the description.")


class RecordingsList(BaseModel):
    """All recordings."""

    recordings: list[RecordingsEntry] = Field(description=f"In the order of their names. {SIMULATED}")


class SignalsDescription(BaseModel):
    """The signals of the recordings."""

    units: dict[str, str] = Field(description="Signal -> unit.")
    samples: int = Field(description="Samples of each signal of each engagement.")
    start: float = Field(description="Time of the first sample in s after the shift command.")
    end: float = Field(description="Time of the last sample in s.")


class RecordingsDescription(BaseModel):
    """What recordings hold."""

    name: str = Field(description="Name of the recordings.")
    digest: Digest
    conditions_digest: str = Field(description="SHA-256 of the conditions.")
    description: str = Field(description=f"What the file says about itself. {SIMULATED}")
    measured_time: list[float] = Field(description="Measured shifting time of each engagement in s.")
    run_order: list[int] | None = Field(description="Place of each engagement in the order they were run, from 0.")
    signals: SignalsDescription | None = Field(description="What signals there are; null where there are none.")
    conditions: list[Condition] = Field(description="The experiments, in their order.")
    current_profiles: list[CurrentProfile] = Field(description="The current profiles the conditions refer to.")


RecordingsInPath = Annotated[str, Path(description="Name of the recordings.", openapi_examples={
    "measured": {"summary": "The shipped recordings (simulated)", "value": "measured"}})]
NewName = Annotated[str, Query(description="Name to keep them under: letters, digits, - and _.", openapi_examples={
    "mine": {"summary": "A name of your own", "value": "two-engagements"}})]


async def _upload(request: Request) -> tuple[Form, bytes]:
    return _FORMS[require_media(request, *_FORMS)], await request.body()


@router.get("", summary="List the recordings", responses=responses())
def list_recordings(library: TheLibrary) -> RecordingsList:
    """Every recordings file in the folder; one that cannot be used is listed with the reason."""
    return RecordingsList(recordings=[_entry(library, name) for name in library.recordings()])


@router.get("/{name}", summary="Describe recordings", responses=responses(404))
def describe_recordings(name: RecordingsInPath, library: TheLibrary) -> RecordingsDescription:
    """Measured shifting times, conditions, and which signals there are."""
    return _describe(name, library.recording(name))


@router.post("", summary="Upload recordings", status_code=201, openapi_extra=_UPLOAD,
             responses=responses(408, 409, 413, 415) | {200: {
                 "description": "The same recordings were there under this name already",
                 "model": RecordingsDescription}})
def upload_recordings(name: NewName, upload: Annotated[tuple[Form, bytes], Depends(_upload)], library: TheLibrary,
                      response: Response) -> RecordingsDescription:
    """Check a recordings file and keep it.

    The body is the file itself: `curl --data-binary @bench.csv -H 'Content-Type: text/csv'` for CSV, one row a
    condition with its shifting time, or application/x-hdf5 for HDF5, which can hold the signals too. A file that is
    there is never replaced: other content under a taken name is a conflict.
    """
    form, content = upload
    response.headers["Location"] = f"/v1/recordings/{name}"
    try:
        return _describe(name, library.add_recordings(name, content, form))
    except FileExistsError:
        if name in library.recordings():
            there = library.recording(name)
            if there.digest == Recordings.read(content, form).digest:
                response.status_code = 200
                return _describe(name, there)
        raise Conflict(f"There is already another file named '{name}'", "Choose another name") from None


def _describe(name: str, recordings: Recordings) -> RecordingsDescription:
    signals = recordings.signals
    return RecordingsDescription(
        name=name, digest=recordings.digest, conditions_digest=recordings.conditions.digest,
        description=recordings.description, measured_time=recordings.measured_time.tolist(),
        run_order=None if recordings.run_order is None else recordings.run_order.tolist(),
        signals=None if signals is None else SignalsDescription(
            units=SIGNAL_UNITS, samples=len(signals.time), start=signals.time[0], end=signals.time[-1]),
        conditions=list_conditions(recordings.conditions), current_profiles=list_profiles(recordings.conditions))


def _entry(library: Library, name: str) -> RecordingsEntry:
    href = f"/v1/recordings/{name}"
    try:
        found = library.recording(name)
    except SlipstickError as error:
        return RecordingsEntry(name=name, engagements=None, digest=None, description="", problem=str(error), href=href)
    return RecordingsEntry(name=name, engagements=len(found), digest=found.digest, description=found.description,
                           href=href)
