"""Benches: list, description and upload."""

from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from slipstick.bench import TEMPLATE, Bench, parameters
from slipstick.errors import SlipstickError
from slipstick.storage.library import Library

from ..bodies import JsonRoute, upload_of
from ..computations import computes
from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..paging import Limit, Offset, Page, page_links
from ..problem_details import Conflict
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..routes.tables import CurrentProfile, list_profiles
from ..schemas import LibraryDependency

router = APIRouter(prefix="/v1/benches", tags=["benches"], route_class=JsonRoute)
_MEDIA_TYPE = "application/toml"


class BenchEntry(BaseModel):
    """A bench in the list of benches."""

    name: str = Field(description="Name of the bench, as used by all operations.")
    title: str = Field(description="Title of the bench; empty if the file is invalid.")
    digest: str | None = Field(description="SHA-256 digest of its physics; null if the file is invalid.")
    problem: str | None = Field(default=None, description="Why the file is invalid, and what to do; null if valid.")
    href: str = Field(description="Path of the bench.")


class BenchList(Page):
    """A list of all benches."""

    benches: list[BenchEntry] = Field(description="The benches, sorted by name.")


class BenchParameter(BaseModel):
    """A parameter of a bench."""

    name: str = Field(description="Name of the parameter.")
    value: float = Field(description="Nominal value.")
    unit: str = Field(description="Unit of the value.")
    meaning: str = Field(description="Meaning of the parameter.")
    uncertain: bool = Field(description="Whether a calibration estimates the parameter.")
    lower: float = Field(description="Lower bound, in multiples of the nominal value.")
    upper: float = Field(description="Upper bound, in multiples of the nominal value.")
    scatter: float | None = Field(description="Known standard deviation from run to run, as a fraction of the nominal "
                                              "value; null if unknown.")


class BenchSensor(BaseModel):
    """A sensor of a bench, in the unit of its signal; null where unknown."""

    noise: float | None = Field(description="Standard deviation of the noise.")
    resolution: float | None = Field(description="Resolution.")
    lag: float | None = Field(description="Lag in s.")


class BenchDescription(BaseModel):
    """Description of a bench."""

    name: str = Field(description="Name of the bench.")
    title: str = Field(description="Title of the bench.")
    source: str = Field(description="Where the numbers of the bench come from.")
    digest: str = Field(description="SHA-256 digest of the physics: parameters and torque converter.")
    sensing_digest: str = Field(description="SHA-256 digest of sensors and priors.")
    parameters: list[BenchParameter] = Field(description="The parameters of the model on this bench.")
    torque_converter: dict[str, list[float]] | None = Field(
        description="Characteristic curves of the torque converter; null for a bench without one.")
    sensors: dict[str, BenchSensor] = Field(description="The sensors by signal, and the shifting time.")
    sample_time: float = Field(description="Sample time of the signals in s.")
    conditions: int = Field(description="Number of conditions.")
    current_profiles: list[CurrentProfile] = Field(description="The current profiles.")


BenchNamePath = Annotated[str, Path(description="Name of the bench.", openapi_examples={
    "heavy": {"summary": "The nominal bench shipped with Slipstick", "value": "heavy"}})]
NewBenchName = Annotated[str, Query(
    description="Name of the new bench: up to 64 letters, digits, - and _, starting with a letter or digit.",
    openapi_examples={"mine": {"summary": "A new name", "value": "my-bench"}})]
_UPLOAD_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {
    _MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}, "example": TEMPLATE.read_text()}}}}


@router.get("", summary="List the benches", response_model=BenchList, responses=error_responses(503) | CSV_RESPONSE)
def list_benches(library: LibraryDependency, request: Request, limit: Limit = 1000, offset: Offset = 0,
                 form: TableFormQuery = None) -> BenchList | Response:
    """Return all benches; an invalid file is listed with the reason."""
    names = library.benches()
    benches = [entry(library, name) for name in names[offset:offset + limit]]
    if wants_csv(request, form):
        return entries_csv(benches, BenchEntry, "benches")
    return BenchList(benches=benches, total=len(names),
                     links=page_links(request, limit, offset, len(names)))


@router.get("/{name}", summary="Describe a bench", responses=error_responses(404, 503) | NOT_MODIFIED)
def describe_bench(name: BenchNamePath, library: LibraryDependency, client: RevalidationDependency) -> BenchDescription:
    """Return parameters with their priors, torque converter, sensors and current profiles of a bench."""
    bench = library.bench(name)
    client.require_change(bench.digest, bench.sensing_digest, bench.conditions.digest, bench.title, bench.source)
    return _describe(name, bench)


@router.post("", summary="Upload a bench", status_code=201, openapi_extra=_UPLOAD_BODY,
             responses=error_responses(408, 409, 413, 415, 503))
@computes
def upload_bench(name: NewBenchName, content: Annotated[bytes, upload_of(_MEDIA_TYPE)], library: LibraryDependency,
                 response: Response) -> BenchDescription:
    """Check a bench file (TOML) and store it.

    The request body is the file itself, with profiles and conditions inline: `curl --data-binary @bench.toml --header
    'Content-Type: application/toml'`. `slipstick bench new FILE` writes a template. An existing bench is never
    replaced.
    """
    try:
        bench = library.add_bench(name, content)
    except FileExistsError:
        raise Conflict(f"A bench named '{name}' already exists", "Choose another name") from None
    response.headers["Location"] = f"/v1/benches/{name}"  # a header cannot hold the characters of an invalid name
    return _describe(name, bench)


def _describe(name: str, bench: Bench) -> BenchDescription:
    physics = bench.physics
    return BenchDescription(
        name=name, title=bench.title, source=bench.source.strip(), digest=bench.digest,
        sensing_digest=bench.sensing_digest, sample_time=bench.sample_time, conditions=len(bench.conditions),
        parameters=[BenchParameter(name=entry.name, value=value, unit=entry.unit, meaning=entry.meaning, **vars(prior))
                    for entry, value, prior in zip(parameters.PARAMETERS, physics.nominal, bench.priors, strict=True)],
        torque_converter=None if physics.converter is None else physics.converter.spec(),
        sensors={name: BenchSensor(**vars(sensor)) for name, sensor in bench.sensors.items()},
        current_profiles=list_profiles(bench.conditions))


def entry(library: Library, name: str) -> BenchEntry:
    """Return the entry of a list of benches, also of an invalid file."""
    href = f"/v1/benches/{name}"
    try:
        return BenchEntry(name=name, href=href, **library.derive_from_bench(name, _summarize))
    except SlipstickError as error:
        return BenchEntry(name=name, title="", digest=None, problem=str(error), href=href)


def _summarize(bench: Bench) -> dict[str, Any]:
    return {"title": bench.title, "digest": bench.digest}
