"""The front page, and the stream that keeps its jobs up to date."""

from collections.abc import Callable, Mapping
from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from starlette.responses import Response

from slipstick.errors import SlipstickError, UnknownName
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..following import EventStream, FollowingDependency, LastEventId, State
from ..front.details import bench_page, recordings_page, table_page
from ..front.file_actions import Folder, file_actions, invalid_page
from ..front.find import quick_form
from ..front.first_steps import first_steps
from ..front.forms import SCRIPT, Form
from ..front.holdings import about_bench, about_recordings, about_table, holdings
from ..front.jobs import Jobs
from ..front.orders import machine_tables, recordings_orders, table_orders
from ..front.page import document
from ..front.upload import SCRIPTS as UPLOAD_SCRIPTS
from ..front.upload import upload_page
from ..heartbeats import Heartbeats
from ..job_filter import JobFilter
from ..job_store import JobStore
from ..jobs import JobStores
from ..routes.benches import BenchNamePath
from ..routes.recordings import RecordingsNamePath
from ..routes.tables import TableNamePath
from ..schemas import LibraryDependency

router = APIRouter(route_class=JsonRoute, include_in_schema=False)

Count = Annotated[int, Query(ge=1, le=1000, description="Maximum number of ended jobs of each kind.")]
_NO_SCRIPT = '<noscript><meta http-equiv="refresh" content="10"></noscript>'
_SCRIPT = '<script src="/static/front/live.js" type="module"></script>'


@router.get("/", response_class=HTMLResponse)
def front_page(request: Request, library: LibraryDependency, stores: JobStores,
               count: Count = 10) -> HTMLResponse:
    """What the service holds, and what it is doing."""
    jobs = _jobs(request, library, stores, count)
    body = "\n".join(["<h1>Test bench against simulation</h1>",
                      f'<div class="start"><a class="button" href="/upload">Add files</a>{quick_form()}</div>',
                      f'<div id="live" data-events="/events?count={count}">', jobs, "</div>", holdings(library)])
    return HTMLResponse(document("Slipstick", body, f"{_NO_SCRIPT}\n{_SCRIPT}"), headers={"Cache-Control": "no-store"})


@router.get("/events")
async def front_events(request: Request, library: LibraryDependency, stores: JobStores,
                       following: FollowingDependency, count: Count = 10, last: LastEventId = None) -> Response:
    """The sections of the jobs as HTML, each time they change."""
    def state() -> State:
        return State(_jobs(request, library, stores, count), ended=False)

    return EventStream(following, f"{request.base_url}events/{count}", state, last)


@router.get("/upload", response_class=HTMLResponse)
def add_files(library: LibraryDependency) -> HTMLResponse:
    """The page on which files are added."""
    return HTMLResponse(document("Add files", upload_page(library.benches(), machine_tables(library)), UPLOAD_SCRIPTS),
                        headers={"Cache-Control": "no-store"})


@router.get("/tables/{name}", response_class=HTMLResponse)
def table_details(name: TableNamePath, library: LibraryDependency, stores: JobStores) -> HTMLResponse:
    """The page of a table."""
    def content() -> tuple[str, Mapping[str, Form]]:
        table = library.table(name)
        return table_page(name, table, about_table(library, name)), table_orders(library, name, table)

    return _file_page("tables", name, content, stores, JobFilter(table=name, status=["done"]))


@router.get("/recordings/{name}", response_class=HTMLResponse)
def recordings_details(name: RecordingsNamePath, library: LibraryDependency, stores: JobStores) -> HTMLResponse:
    """The page of recordings."""
    def content() -> tuple[str, Mapping[str, Form]]:
        recordings = library.recorded(name)
        return (recordings_page(name, recordings, about_recordings(library, name)),
                recordings_orders(library, name, recordings))

    return _file_page("recordings", name, content, stores, JobFilter(recordings=name, status=["done"]))


@router.get("/benches/{name}", response_class=HTMLResponse)
def bench_details(name: BenchNamePath, library: LibraryDependency, stores: JobStores) -> HTMLResponse:
    """The page of a bench."""
    def content() -> tuple[str, Mapping[str, Form]]:
        return bench_page(name, library.bench(name), about_bench(library, name)), {}

    return _file_page("benches", name, content, stores, JobFilter(bench=name, status=["done"]))


def _file_page(folder: Folder, name: str, content: Callable[[], tuple[str, Mapping[str, Form]]], stores: JobStores,
               users: JobFilter) -> HTMLResponse:
    """The page of a file with what can be done with it, or that of an invalid one with the reason."""
    results = sum(store.total(users) for store in stores.values())
    try:
        shown, orders = content()
        head, first, details = shown.partition("<section")  # what can be done stands before long tables
        body = f"{head}{file_actions(folder, name, orders, results)}\n{first}{details}"
    except UnknownName:
        raise
    except SlipstickError as error:
        body = invalid_page(folder, name, str(error), results)
    return HTMLResponse(document(name, body, SCRIPT))


def _jobs(request: Request, library: Library, stores: Mapping[str, JobStore], count: int) -> str:
    heartbeats: Heartbeats = request.app.state.heartbeats
    total = sum(store.total() for store in stores.values())
    steps = first_steps(library, heartbeats.alive(), total, str(request.base_url).rstrip("/"))
    return Jobs(stores, heartbeats).html(count, steps)
