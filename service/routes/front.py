"""The front page, and the stream that keeps its jobs up to date."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from starlette.responses import Response

from slipstick.report.markup import paragraph
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..computations import computes
from ..drawings import DrawingsDependency
from ..following import EventStream, FollowingDependency, LastEventId, State
from ..front.details import bench_page
from ..front.first_steps import first_steps
from ..front.holdings import about_bench, about_recordings, about_table, holdings
from ..front.jobs import Jobs
from ..front.laws import thumbnail
from ..front.mapped import table_page
from ..front.page import document
from ..front.recorded import recordings_page
from ..heartbeats import Heartbeats
from ..job_store import JobStore
from ..jobs import finished_job, output_of, version_of
from ..pictures import PICTURE_RESPONSE, picture_response
from ..revalidation import RevalidationDependency
from ..routes.benches import BenchNamePath
from ..routes.fits import FitStore
from ..routes.recordings import RecordingsNamePath
from ..routes.studies import StudyId, StudyStore
from ..routes.tables import TableNamePath
from ..schemas import LibraryDependency

router = APIRouter(route_class=JsonRoute, include_in_schema=False)

Count = Annotated[int, Query(ge=1, le=1000, description="Maximum number of ended jobs of each kind.")]
_ABOUT = ("Slipstick finds where a simulation and recordings of its test bench disagree, names the physical effect "
          "that the model lacks, and measures how much of the gap it closes.")
_FLIP = '<script src="/static/front/flip.js" type="module"></script>'
Number = Annotated[int, Query(ge=0, description="Number of a run or a condition, from 0.")]
AxisName = Annotated[str | None, Query(description="Name of an axis of the map.")]
_NO_SCRIPT = '<noscript><meta http-equiv="refresh" content="10"></noscript>'
_SCRIPT = '<script src="/static/front/live.js" type="module"></script>'


@router.get("/", response_class=HTMLResponse)
def front_page(request: Request, library: LibraryDependency, fits: FitStore, studies: StudyStore,
               count: Count = 10) -> HTMLResponse:
    """What the service holds, and what it is doing."""
    jobs = _jobs(request, library, fits, studies, count)
    body = "\n".join(["<h1>Test bench against simulation</h1>", paragraph(_ABOUT, "lead"),
                      f'<div id="live" data-events="/events?count={count}">', jobs, "</div>", holdings(library)])
    return HTMLResponse(document("Slipstick", body, f"{_NO_SCRIPT}\n{_SCRIPT}"), headers={"Cache-Control": "no-store"})


@router.get("/events")
async def front_events(request: Request, library: LibraryDependency, fits: FitStore, studies: StudyStore,
                       following: FollowingDependency, count: Count = 10, last: LastEventId = None) -> Response:
    """The sections of the jobs as HTML, each time they change."""
    def state() -> State:
        return State(_jobs(request, library, fits, studies, count), ended=False)

    return EventStream(following, f"{request.base_url}events/{count}", state, last)


@router.get("/tables/{name}", response_class=HTMLResponse)
@computes
def table_details(name: TableNamePath, library: LibraryDependency, client: RevalidationDependency,
                  drawings: DrawingsDependency, condition: Number = 0, x: AxisName = None,
                  y: AxisName = None) -> HTMLResponse:
    """The page of a table."""
    table, about = library.table(name), about_table(library, name)
    client.require_change(table.digest, about)
    return HTMLResponse(document(name, table_page(name, table, about, condition, (x, y), drawings)))


@router.get("/recordings/{name}", response_class=HTMLResponse)
@computes
def recordings_details(name: RecordingsNamePath, library: LibraryDependency, client: RevalidationDependency,
                       drawings: DrawingsDependency, run: Number = 0) -> HTMLResponse:
    """The page of recordings."""
    recordings, about = library.recorded(name), about_recordings(library, name)
    client.require_change(recordings.digest, about)
    return HTMLResponse(document(name, recordings_page(name, recordings, about, run, drawings), _FLIP))


@router.get("/benches/{name}", response_class=HTMLResponse)
@computes
def bench_details(name: BenchNamePath, library: LibraryDependency, client: RevalidationDependency,
                  drawings: DrawingsDependency) -> HTMLResponse:
    """The page of a bench."""
    bench, about = library.bench(name), about_bench(library, name)
    client.require_change(bench.digest, bench.sensing_digest, bench.conditions.digest, bench.source, about)
    return HTMLResponse(document(name, bench_page(name, bench, about, drawings)))


@router.get("/studies/{id}/law.svg", response_class=Response, responses=PICTURE_RESPONSE)
@computes
def law_thumbnail(id: StudyId, store: StudyStore, client: RevalidationDependency,
                  drawings: DrawingsDependency) -> Response:
    """The first measured law of a finished study, in small."""
    version = version_of(finished_job(store, id, output=False))
    client.require_change(version)
    return picture_response(drawings.made("svg", lambda: thumbnail(output_of(finished_job(store, id))), version), "svg")


def _jobs(request: Request, library: Library, fits: JobStore, studies: JobStore, count: int) -> str:
    heartbeats: Heartbeats = request.app.state.heartbeats
    total = fits.total() + studies.total()
    steps = first_steps(library, heartbeats.alive(), total, str(request.base_url).rstrip("/"))
    return Jobs(fits, studies, heartbeats).html(count, steps)
