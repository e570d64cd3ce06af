"""What the jobs of every kind have: a list, status, events, result, cancellation and deletion."""

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request, Response
from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool

from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..following import EventStream, FollowingDependency, LastEventId, State, Wait
from ..job_filter import ENDED, JobFilter
from ..job_kind import JobKind
from ..job_store import JobStore
from ..jobs import Job, delete, finished_job, job_filter, version_of, wait_for_end
from ..paging import Limit, Offset, page_links
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..schemas import LibraryDependency

_EVENTS: dict[int | str, dict[str, Any]] = {
    200: {"description": "Events `state` and, last, `end`: their data is the JSON of the job",
          "content": {"text/event-stream": {"schema": {}}}},  # OpenAPI 3.1 has no schema of one event
    204: {"description": "The job has ended, and the client has had the last event"}}


def add_job_routes(router: APIRouter, kind: JobKind[Job, Job], wanted_jobs: Callable[..., Any] = job_filter) -> None:
    """Add the routes that all kinds of jobs share; `wanted_jobs` is the dependency that makes the filter of the list.
    """
    store_dependency, id_path, name, plural = kind.store, kind.id_path, kind.name, kind.plural

    @router.get("", name=f"list_{plural}", summary=f"List the {plural}", response_model=kind.listing,
                responses=error_responses(503) | CSV_RESPONSE,
                description=f"Return the {plural}, newest first, without their progress and results; filters select "
                            "some of them.")
    def list_jobs(store: Annotated[JobStore, store_dependency], request: Request,
                  wanted: Annotated[JobFilter, Depends(wanted_jobs)], limit: Limit = 50, offset: Offset = 0,
                  form: TableFormQuery = None) -> Any:
        total = store.total(wanted)
        jobs = [kind.without_progress(store, job) for job in store.newest(limit, offset, wanted)]
        if wants_csv(request, form):
            return entries_csv(jobs, kind.entry, plural)
        return kind.listing(**{plural: jobs}, total=total, links=page_links(request, limit, offset, total))

    @router.get("/{id}", name=f"follow_{name}", summary=f"Get the status of a {name}", response_model=kind.state,
                responses=error_responses(404, 503),
                description=f"{kind.about_state}\n\nWith `wait`, the response comes when the {name} has ended, or "
                            "after this time.")
    async def follow_job(id: Annotated[str, id_path], store: Annotated[JobStore, store_dependency],
                         following: FollowingDependency, request: Request, wait: Wait = 0) -> Any:
        return await wait_for_end(following, request, f"{store.address}/{id}",
                                  lambda: kind.with_progress(store, store.find(id)), wait)

    @router.get("/{id}/events", name=f"{name}_events", summary=f"Follow a {name} by events", status_code=200,
                response_class=EventStream, responses=error_responses(404, 503) | _EVENTS,
                description=f"Send the {name}, as `GET {kind.address}/{{id}}` returns it, each time it changes, as "
                            f"server-sent events.\n\nThe stream ends after the event `end`, which has the {name} after "
                            "it has ended. It also ends after SLIPSTICK_FOLLOW_SECONDS, and when the service stops; "
                            "connect again with the header Last-Event-ID, as browsers do by themselves.")
    async def send_events(id: Annotated[str, id_path], store: Annotated[JobStore, store_dependency],
                          following: FollowingDependency, last: LastEventId = None) -> Response:
        def state() -> State:
            job = kind.with_progress(store, store.find(id))
            return State(job.model_dump_json(), job.status in ENDED)

        first = await run_in_threadpool(state)  # before the response begins, so that an unknown id is a 404
        if first.ended and first.id == last:
            return Response(status_code=204)
        return EventStream(following, f"{store.address}/{id}/events", state, last)

    @router.get("/{id}/result", name=f"{name}_result", summary=f"Get the result of a {name}",
                response_model=kind.result, responses=error_responses(404, 409, 503) | NOT_MODIFIED,
                description=f"{kind.about_result}; 409 unless the {name} is done.")
    def get_result(id: Annotated[str, id_path], store: Annotated[JobStore, store_dependency],
                   client: RevalidationDependency) -> BaseModel:
        job = finished_job(store, id)
        client.require_change(version_of(job))
        return kind.finished(job)

    @router.post("/{id}/cancel", name=f"cancel_{name}", summary=f"Cancel a {name}", response_model=kind.state,
                 responses=error_responses(404, 503),
                 description=f"Cancel a queued or running {name}. A {name} that has ended is unchanged. The worker "
                             "stops within a second.")
    def cancel_job(id: Annotated[str, id_path], store: Annotated[JobStore, store_dependency]) -> Any:
        store.cancel(id)
        return kind.with_progress(store, store.find(id))

    @router.delete("/{id}", name=f"delete_{name}", summary=f"Delete a {name}", status_code=204,
                   responses=error_responses(404, 409, 503),
                   description=f"Delete a {name} with its result; 409 while it is queued or running. Its id can then "
                               "be used again.")
    def delete_job(id: Annotated[str, id_path], store: Annotated[JobStore, store_dependency],
                   library: LibraryDependency) -> None:
        job_input = delete(store, id)
        kind.forget(library, store, job_input)
