"""The states of fits and studies as server-sent events."""

from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, Response
from starlette.concurrency import run_in_threadpool

from ..bodies import JsonRoute
from ..error_responses import error_responses
from ..following import EventStream, Following, FollowingDependency, LastEventId, State
from ..job_filter import ENDED
from ..jobs import Job
from ..routes import fits, studies

router = APIRouter(prefix="/v1", route_class=JsonRoute)

_EVENTS: dict[int | str, dict[str, Any]] = {
    200: {"description": "Events `state` and, last, `end`: their data is the JSON of the job",
          "content": {"text/event-stream": {"schema": {"type": "string"}}}},
    204: {"description": "The job has ended, and the client has had the last event"}}


def _about(kind: str, kinds: str) -> str:
    return f"""Send the {kind}, as `GET /v1/{kinds}/{{id}}` returns it, each time it changes, as server-sent events.

The stream ends after the event `end`, which has the {kind} after it has ended. It also ends after
SLIPSTICK_FOLLOW_SECONDS, and when the service stops; connect again with the header Last-Event-ID, as browsers do by
themselves."""


@router.get("/fits/{id}/events", summary="Follow a fit by events", description=_about("fit", "fits"),
            tags=["fits"], status_code=200, response_class=EventStream,
            responses=error_responses(404, 503) | _EVENTS)
async def fit_events(id: fits.FitId, store: fits.FitStore, following: FollowingDependency,
                     last: LastEventId = None) -> Response:
    """Send the states of a fit."""
    return await _stream(following, f"{store.address}/{id}", lambda: fits.with_progress(store, store.find(id)), last)


@router.get("/studies/{id}/events", summary="Follow a study by events", description=_about("study", "studies"),
            tags=["studies"], status_code=200, response_class=EventStream,
            responses=error_responses(404, 503) | _EVENTS)
async def study_events(id: studies.StudyId, store: studies.StudyStore, following: FollowingDependency,
                       last: LastEventId = None) -> Response:
    """Send the states of a study."""
    return await _stream(following, f"{store.address}/{id}", lambda: studies.with_progress(store, store.find(id)), last)


async def _stream(following: Following, key: str, read: Callable[[], Job], last: str | None) -> Response:
    def state() -> State:
        job = read()
        return State(job.model_dump_json(), job.status in ENDED)

    first = await run_in_threadpool(state)  # before the response begins, so that an unknown id is a 404
    if first.ended and first.id == last:
        return Response(status_code=204)
    return EventStream(following, f"{key}/events", state, last)
