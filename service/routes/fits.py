"""Fits: submitted here, run by the worker, followed and fetched here."""

import datetime
import uuid
from typing import Annotated, Any

import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Body, Depends, Header, Path, Query, Request, Response

from service.bodies import JsonRoute
from service.fit_schemas import Fit, FitList, FitRequest, FitResult, FollowedFit, Progress, Status
from service.job_store import JobStore, Order
from service.problems import Conflict, responses
from service.schemas import TheLibrary
from slipstick.errors import InvalidValue
from slipstick.library import Library
from slipstick.problem import simulated_problem, table_problem
from slipstick.uncertainty.fit import start

router = APIRouter(prefix="/v1/fits", tags=["fits"], route_class=JsonRoute)

_STATUS: dict[str, Status] = {
    "DELAYED": "queued", "ENQUEUED": "queued", "PENDING": "running", "SUCCESS": "done", "ERROR": "failed",
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": "failed", "CANCELLED": "cancelled"}
_ID = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
_ID_EXAMPLE: Any = {"first-fit": {"summary": "The fit of the example above", "value": "first-fit"}}


def fits(request: Request) -> JobStore:
    """The job store of the application that answers."""
    found: JobStore = request.app.state.fits
    return found


TheFits = Annotated[JobStore, Depends(fits)]
FitId = Annotated[str, Path(description="Id of the fit.", pattern=_ID, openapi_examples=_ID_EXAMPLE)]
Key = Annotated[str | None, Header(
    alias="Idempotency-Key", pattern=_ID, openapi_examples=_ID_EXAMPLE,
    description="Becomes the id of the fit. The same request with the same key is the same fit, however often it is "
                "sent; another request with that key is a conflict. Without a key every request is a new fit.")]


_EXAMPLE = {"table": "nominal", "recordings": "measured",
            "settings": {"population": 24, "generations": 12, "seed": 1}}


@router.post("", summary="Submit a fit", status_code=202, responses=responses(404, 408, 409, 413, 415, 503))
def submit_fit(asked: Annotated[FitRequest, Body(examples=[_EXAMPLE])], library: TheLibrary, store: TheFits,
               response: Response, key: Key = None) -> FollowedFit:
    """Put a fit of the inputs to the recordings into the queue of the worker.

    The answer comes at once, with the address of the fit in Location. The fit maximises the likelihood over mean and
    std of each input and the output noise by a genetic algorithm, then polishes the best on the exact likelihood.
    """
    order = _order(library, asked)
    fit = store.submit(key or str(uuid.uuid4()), order)
    if ordered(fit) != order:
        raise Conflict(f"The key '{key}' belongs to a fit with another request, table or recordings",
                       "Send the request as it was then, or take another Idempotency-Key")
    response.headers["Location"] = f"/v1/fits/{fit.workflow_id}"
    return _follow(store, fit)


@router.get("", summary="List the fits", responses=responses(503))
def list_fits(store: TheFits, limit: Annotated[int, Query(ge=1, le=1000, description="Most fits to list.")] = 50,
              offset: Annotated[int, Query(ge=0, description="Fits to skip, from the newest.")] = 0) -> FitList:
    """The fits of all tables and recordings, the newest first."""
    return FitList(fits=[describe(fit) for fit in store.newest(limit, offset)])


@router.get("/{id}", summary="Follow a fit", responses=responses(404, 503))
def follow_fit(id: FitId, store: TheFits) -> FollowedFit:
    """Status, progress of every generation, and the best candidate so far."""
    return _follow(store, store.find(id))


@router.get("/{id}/result", summary="Result of a fit", responses=responses(404, 409, 503))
def fit_result(id: FitId, store: TheFits) -> FitResult:
    """The fitted inputs with the likelihood before and after; a conflict until the fit is done."""
    fit = finished(store, id)
    order = ordered(fit)
    kept = ("table", "table_digest", "simulate", "recordings", "recordings_digest")
    output: dict[str, Any] = fit.output or {}
    found = {name: output[name] for name in ("result", "seconds", "processor_seconds")}
    return FitResult(id=id, **{name: order[name] for name in kept}, **found)


@router.post("/{id}/cancel", summary="Cancel a fit", responses=responses(404, 503))
def cancel_fit(id: FitId, store: TheFits) -> FollowedFit:
    """Stop a fit that waits or runs; one that has ended stays as it is. The worker is free within seconds."""
    store.cancel(id)
    return _follow(store, store.find(id))


def _order(library: Library, asked: FitRequest) -> Order:
    """What the worker is told. Whatever it would stumble over is refused here."""
    table, recordings = library.table(asked.table), library.recording(asked.recordings)
    chosen = asked.parameters or [axis.name for axis in table.axes]
    problem = (simulated_problem(table.model, recordings, chosen) if asked.simulate
               else table_problem(table, recordings, asked.outside, chosen))
    if asked.simulate and asked.outside != "clip":
        raise InvalidValue(f"The simulator has no edge for the policy '{asked.outside}'", "Leave `outside` out")
    search = asked.settings.checked()
    start(search, problem)
    order: Order = orjson.loads(orjson.dumps({
        "table": asked.table, "table_digest": table.digest, "simulate": asked.simulate, "parameters": chosen,
        "recordings": asked.recordings, "recordings_digest": recordings.digest,
        "outside": asked.outside, "settings": search.to_dict()}))
    return order


def finished(store: JobStore, id: str) -> WorkflowStatus:
    """The fit with its output; raises `UnknownName`, and `Conflict` where it is not done."""
    fit = store.find(id)
    if fit.status != "SUCCESS":
        status = _STATUS[fit.status]
        open_still = status in ("queued", "running")
        remedy = "Ask again when it is done" if open_still else "Submit it again, under another key"
        raise Conflict(f"The fit '{id}' has no result: it is {status}", remedy)
    return fit


def ordered(fit: WorkflowStatus) -> Order:
    """What the worker was told."""
    assert fit.input is not None
    order: Order = fit.input["args"][0]
    return order


def _follow(store: JobStore, fit: WorkflowStatus) -> FollowedFit:
    said = store.progress(fit.workflow_id)
    return FollowedFit(**vars(describe(fit)), progress=None if said is None else Progress(**said))


def describe(fit: WorkflowStatus) -> Fit:
    """What is known of a fit without its progress and result."""
    order, status, here = ordered(fit), _STATUS[fit.status], f"/v1/fits/{fit.workflow_id}"
    waiting = "It waits for the worker; if none is running, start one with `python -m worker serve-jobs`"
    running = f"If its worker has ended, it goes on with `python -m worker serve-jobs --name {fit.executor_id}`"
    return Fit(
        id=fit.workflow_id, status=status, note={"queued": waiting, "running": running}.get(status),
        problem=str(fit.error) if fit.error else None, **order, submitted=_time(fit.created_at),
        ended=_time(fit.completed_at), links={
            "self": here, **{name: f"{here}/{name}" for name in ("result", "report", "pictures", "cancel")}})


def _time(milliseconds: int | None) -> datetime.datetime | None:
    return None if milliseconds is None else datetime.datetime.fromtimestamp(milliseconds / 1000, datetime.UTC)
