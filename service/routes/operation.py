"""For supervisors: whether the process lives, whether it is ready, and its metrics."""

import tempfile
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import PlainTextResponse
from prometheus_client import CONTENT_TYPE_PLAIN_0_0_4
from pydantic import BaseModel, Field
from sqlalchemy.exc import SQLAlchemyError

from slipstick import __version__
from slipstick.errors import SlipstickError

from ..bodies import JsonRoute
from ..computations import at_once
from ..error_responses import error_responses
from ..problem_details import StoreUnavailable
from ..routes.fits import FitStore
from ..schemas import LibraryDependency

router = APIRouter(tags=["operation"], route_class=JsonRoute)

Workers = Annotated[int, Query(ge=0, le=1000, description="Number of workers that have to be alive.")]


class Live(BaseModel):
    """The process answers."""

    status: str = Field(description="Always `live`.")
    version: str = Field(description="Version of Slipstick.")


class Ready(BaseModel):
    """The service can do its work."""

    status: str = Field(description="Always `ready`; a service that is not ready returns 503 with the causes.")
    workers: int = Field(description="Number of workers that are alive.")


@router.get("/v1/live", summary="Check that the process answers", responses=error_responses())
async def live() -> Live:
    """Return at once, without a look at tables or jobs. A supervisor restarts a process that does not answer."""
    return Live(status="live", version=__version__)


@router.get("/v1/ready", summary="Check that the stores work", responses=error_responses(503))
@at_once
def ready(request: Request, library: LibraryDependency, fits: FitStore, workers: Workers = 0) -> Ready:
    """Write a temporary file in the folder of the tables, list it, read the job database, and count the workers.

    503 names every cause. By default no worker is required: without one, everything but jobs works, and they wait.
    """
    def folder() -> None:
        try:
            library.tables()
            with tempfile.TemporaryFile(dir=library.folder) as file:
                file.write(b"ready")
                file.flush()
        except OSError as error:
            raise StoreUnavailable(f"The folder '{library.folder}' cannot be read and written ({error.strerror})",
                                   "Check its permissions and the free space") from error

    def database() -> int:
        try:
            fits.newest(1, 0)
            alive: int = request.app.state.heartbeats.alive()
        except SQLAlchemyError as error:
            raise StoreUnavailable("The job database does not respond", "Check SLIPSTICK_JOBS, and the log") from error
        if alive < workers:
            raise StoreUnavailable(f"{alive} of {workers} workers are alive",
                                   "Start workers with `slipstick work`")
        return alive

    alive, _ = _run_checks(database, folder)
    return Ready(status="ready", workers=alive)


@router.get("/metrics", summary="Get metrics for Prometheus", response_class=PlainTextResponse, response_model=None,
            responses=error_responses() | {200: {"description": "Metrics in the text format of Prometheus",
                                                 "content": {"text/plain": {"schema": {"type": "string"}}}}})
def metrics(request: Request) -> Response:
    """Return the numbers and durations of requests, jobs, queues, workers, computations, and of the process."""
    return Response(request.app.state.metrics.text(), media_type=CONTENT_TYPE_PLAIN_0_0_4)


def _run_checks(*checks: Callable[[], Any]) -> list[Any]:
    """Return the results of the checks; raises `StoreUnavailable` with the causes of all that fail."""
    results, failed = [], []
    for check in checks:
        try:
            results.append(check())
        except SlipstickError as error:
            failed.append(error)
    if failed:
        raise StoreUnavailable("; ".join(error.cause for error in failed), "; ".join(error.remedy for error in failed))
    return results
