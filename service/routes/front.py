"""The front page, and the stream that keeps its jobs up to date."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from starlette.responses import Response

from slipstick.black_box import BlackBoxDescription
from slipstick.errors import SlipstickError, UnknownName
from slipstick.machine import MachineDescription, Runs
from slipstick.report.markup import paragraph
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..computations import computes
from ..drawings import DrawingsDependency
from ..following import EventStream, FollowingDependency, LastEventId, State
from ..front.details import bench_page
from ..front.elements import Link
from ..front.file_actions import Folder, file_actions, invalid_page
from ..front.find import quick_form
from ..front.first_steps import first_steps
from ..front.forms import Form
from ..front.holdings import about, holdings
from ..front.jobs import job_sections
from ..front.laws import thumbnail
from ..front.machine_page import machine_entry, machine_links, machine_page
from ..front.mapped import table_page
from ..front.mapping import bench_rows, machine_rows
from ..front.orders import bench_orders, machine_orders, machine_tables, recordings_orders, table_orders
from ..front.page import FRESH, RELOAD, document, scripts
from ..front.recorded import recordings_page
from ..front.upload import upload_page
from ..job_filter import JobFilter
from ..job_store import JobStore
from ..jobs import JobStores, finished_job, output_of, version_of
from ..machines import MachinesDependency
from ..pictures import PICTURE_RESPONSE, picture_response
from ..revalidation import Revalidation, RevalidationDependency
from ..routes.benches import BenchNamePath
from ..routes.machines import MachineNamePath
from ..routes.recordings import RecordingsNamePath
from ..routes.studies import StudyId, StudyStore
from ..routes.tables import TableNamePath
from ..schemas import LibraryDependency
from ..subjects import ImportBench, ImportMachine, find_subject, list_declared

router = APIRouter(route_class=JsonRoute, include_in_schema=False)

Count = Annotated[int, Query(ge=1, le=1000, description="Maximum number of ended jobs of each kind.")]
_ABOUT = ("Slipstick finds where a simulation and recordings of its test bench disagree, names the physical effect "
          "that the model lacks, and measures how much of the gap it closes.")
Number = Annotated[int, Query(ge=0, description="Number of a run or a condition, from 0.")]
AxisName = Annotated[str | None, Query(description="Name of an axis of the map.")]


@router.get("/", response_class=HTMLResponse)
def front_page(request: Request, library: LibraryDependency, stores: JobStores, machines: MachinesDependency,
               count: Count = 10) -> HTMLResponse:
    """What the service holds, and what it is doing."""
    jobs = _jobs(request, library, stores, count)
    body = "\n".join(["<h1>Test bench against simulation</h1>", paragraph(_ABOUT, "lead"),
                      f'<div class="start"><a class="button" href="/upload">Add files</a>{quick_form()}</div>',
                      f'<div id="live" data-events="/events?count={count}">', jobs, "</div>",
                      holdings(library, [machine_entry(each) for each in machines.read_all()])])
    return HTMLResponse(document("Slipstick", body, f"{RELOAD}\n{scripts('live')}"), headers=FRESH)


@router.get("/events")
async def front_events(request: Request, library: LibraryDependency, stores: JobStores,
                       following: FollowingDependency, count: Count = 10, last: LastEventId = None) -> Response:
    """The sections of the jobs as HTML, each time they change."""
    def state() -> State:
        return State(_jobs(request, library, stores, count), ended=False)

    return EventStream(following, f"{request.base_url}events/{count}", state, last)


@router.get("/upload", response_class=HTMLResponse)
def add_files(library: LibraryDependency, machines: MachinesDependency, machine: ImportMachine = None) -> HTMLResponse:
    """The page on which files are added, those of a logger by default for this `machine`."""
    body = upload_page(library.benches(), list_declared(machines), machine_tables(library), machine)
    return HTMLResponse(document("Add files", body, scripts("act", "mapping", "flip")), headers=FRESH)


@router.get("/upload/mapping", response_class=HTMLResponse)
def mapping_rows(library: LibraryDependency, machines: MachinesDependency, bench: ImportBench = None,
                 machine: ImportMachine = None) -> HTMLResponse:
    """The fields of the mapping of a bench or machine, which the page of added files shows."""
    subject = find_subject(library, machines, bench, machine)
    rows = machine_rows(subject) if isinstance(subject, MachineDescription) else bench_rows(library.bench(subject.stem))
    return HTMLResponse(rows, headers=FRESH)


@router.get("/tables/{name}", response_class=HTMLResponse)
@computes
def table_details(name: TableNamePath, library: LibraryDependency, stores: JobStores, machines: MachinesDependency,
                  client: RevalidationDependency, drawings: DrawingsDependency, condition: Number = 0,
                  x: AxisName = None, y: AxisName = None) -> HTMLResponse:
    """The page of a table."""
    def content() -> _Content:
        table, holds = library.table(name), about("tables", name, library)
        machine = table.model.title if isinstance(table.model, BlackBoxDescription) else None
        return _Content((table.digest, holds), table_orders(library, name, table),
                        lambda: table_page(name, table, holds, condition, (x, y), drawings),
                        machine_links(machines, machine))

    return _file_page("tables", name, content, stores, JobFilter(table=name, status=["done"]), client)


@router.get("/recordings/{name}", response_class=HTMLResponse)
@computes
def recordings_details(name: RecordingsNamePath, library: LibraryDependency, stores: JobStores,
                       machines: MachinesDependency, client: RevalidationDependency, drawings: DrawingsDependency,
                       run: Number = 0) -> HTMLResponse:
    """The page of recordings."""
    def content() -> _Content:
        recordings, holds = library.recorded(name), about("recordings", name, library)
        machine = recordings.machine if isinstance(recordings, Runs) else None
        return _Content((recordings.digest, holds), recordings_orders(library, name, recordings, machines),
                        lambda: recordings_page(name, recordings, holds, run, drawings),
                        machine_links(machines, machine))

    return _file_page("recordings", name, content, stores, JobFilter(recordings=name, status=["done"]), client)


@router.get("/benches/{name}", response_class=HTMLResponse)
@computes
def bench_details(name: BenchNamePath, library: LibraryDependency, stores: JobStores, client: RevalidationDependency,
                  drawings: DrawingsDependency) -> HTMLResponse:
    """The page of a bench."""
    def content() -> _Content:
        bench, holds = library.bench(name), about("benches", name, library)
        return _Content((bench.digest, bench.sensing_digest, bench.conditions.digest, bench.source, holds),
                        bench_orders(library, name),
                        lambda: bench_page(name, bench, holds, drawings))

    return _file_page("benches", name, content, stores, JobFilter(bench=name, status=["done"]), client)


@router.get("/machines/{name:path}", response_class=HTMLResponse)
@computes
def machine_details(name: MachineNamePath, library: LibraryDependency, machines: MachinesDependency,
                    client: RevalidationDependency, drawings: DrawingsDependency) -> HTMLResponse:
    """The page of a machine that a worker has, or had."""
    stored = machines.find(name)
    body = machine_page(stored, machine_orders(name, stored), library, drawings)
    client.require_change(body)
    return HTMLResponse(document(name, body, scripts("act"), part_of="Machines"))


@router.get("/studies/{id}/law.svg", response_class=Response, responses=PICTURE_RESPONSE)
@computes
def law_thumbnail(id: StudyId, store: StudyStore, client: RevalidationDependency,
                  drawings: DrawingsDependency) -> Response:
    """The first measured law of a finished study, in small."""
    version = version_of(finished_job(store, id, output=False))
    client.require_change(version)
    return picture_response(drawings.made("svg", lambda: thumbnail(output_of(finished_job(store, id))), version), "svg")


@dataclass(frozen=True)
class _Content:
    """The page of a file: what identifies its content, the jobs that the file can be given to, and the HTML."""

    version: tuple[str, ...]
    orders: Mapping[str, Form]
    draw: Callable[[], str]
    links: Sequence[Link] = ()


def _file_page(folder: Folder, name: str, content: Callable[[], _Content], stores: JobStores, users: JobFilter,
               client: Revalidation) -> HTMLResponse:
    """The page of a file with what can be done with it, or that of an invalid one with the reason."""
    results = sum(store.total(users) for store in stores.values())
    try:
        shown = content()
    except UnknownName:
        raise
    except SlipstickError as error:
        return HTMLResponse(document(name, invalid_page(folder, name, str(error), results), scripts("act")))
    actions = file_actions(folder, name, shown.orders, results, shown.links)
    client.require_change(*shown.version, actions)
    head, first, details = shown.draw().partition("<section")  # what can be done stands before long tables
    return HTMLResponse(document(name, f"{head}{actions}\n{first}{details}", scripts("act", "flip")))


def _jobs(request: Request, library: Library, stores: Mapping[str, JobStore], count: int) -> str:
    alive: int = request.app.state.heartbeats.alive()
    total = sum(store.total() for store in stores.values())
    machines = [] if total else list_declared(request.app.state.machines)  # a first job is the end of their step
    return job_sections(stores, alive, library, count, first_steps(library, machines, alive, total))
