"""The front page, and the stream that keeps its jobs up to date."""

from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from starlette.responses import Response

from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..following import EventStream, FollowingDependency, LastEventId, State
from ..front.details import bench_page, recordings_page, table_page
from ..front.first_steps import first_steps
from ..front.holdings import about_bench, about_recordings, about_table, holdings
from ..front.jobs import Jobs
from ..front.page import document
from ..heartbeats import Heartbeats
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
                      f'<div id="live" data-events="/events?count={count}">', jobs, "</div>", holdings(library)])
    return HTMLResponse(document("Slipstick", body, f"{_NO_SCRIPT}\n{_SCRIPT}"), headers={"Cache-Control": "no-store"})


@router.get("/events")
async def front_events(request: Request, library: LibraryDependency, stores: JobStores,
                       following: FollowingDependency, count: Count = 10, last: LastEventId = None) -> Response:
    """The sections of the jobs as HTML, each time they change."""
    def state() -> State:
        return State(_jobs(request, library, stores, count), ended=False)

    return EventStream(following, f"{request.base_url}events/{count}", state, last)


@router.get("/tables/{name}", response_class=HTMLResponse)
def table_details(name: TableNamePath, library: LibraryDependency) -> HTMLResponse:
    """The page of a table."""
    table = library.table(name)
    return HTMLResponse(document(name, table_page(name, table, about_table(library, name))))


@router.get("/recordings/{name}", response_class=HTMLResponse)
def recordings_details(name: RecordingsNamePath, library: LibraryDependency) -> HTMLResponse:
    """The page of recordings."""
    recordings = library.recorded(name)
    return HTMLResponse(document(name, recordings_page(name, recordings, about_recordings(library, name))))


@router.get("/benches/{name}", response_class=HTMLResponse)
def bench_details(name: BenchNamePath, library: LibraryDependency) -> HTMLResponse:
    """The page of a bench."""
    bench = library.bench(name)
    return HTMLResponse(document(name, bench_page(name, bench, about_bench(library, name))))


def _jobs(request: Request, library: Library, stores: Mapping[str, JobStore], count: int) -> str:
    heartbeats: Heartbeats = request.app.state.heartbeats
    total = sum(store.total() for store in stores.values())
    steps = first_steps(library, heartbeats.alive(), total, str(request.base_url).rstrip("/"))
    return Jobs(stores, heartbeats).html(count, steps)
