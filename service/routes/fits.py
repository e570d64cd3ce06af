"""Fits: submitted here, run by the worker, followed and fetched here."""

from typing import Annotated

import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Body, Depends, Query, Request, Response

from service.bodies import JsonRoute
from service.fit_schemas import Fit, FitList, FitRequest, FitResult, FollowedFit, Progress
from service.job_store import JobStore, Order
from service.jobs import described, finished, id_in_path, idempotency_key, ordered, output, submit
from service.problem_details import responses
from service.schemas import TheLibrary
from slipstick.errors import InvalidValue
from slipstick.inference import simulated_problem, table_problem
from slipstick.storage.library import Library
from slipstick.uncertainty.fit import initial_state

router = APIRouter(prefix="/v1/fits", tags=["fits"], route_class=JsonRoute)


def fits(request: Request) -> JobStore:
    """The fits of the application that answers."""
    found: JobStore = request.app.state.fits
    return found


TheFits = Annotated[JobStore, Depends(fits)]
FitId = Annotated[str, id_in_path("fit")]
Key = Annotated[str | None, idempotency_key("fit")]

_EXAMPLE = {"table": "nominal", "recordings": "measured",
            "settings": {"population": 24, "generations": 12, "seed": 1}}


@router.post("", summary="Submit a fit", status_code=202, responses=responses(404, 408, 409, 413, 415, 503))
def submit_fit(asked: Annotated[FitRequest, Body(examples=[_EXAMPLE])], library: TheLibrary, store: TheFits,
               response: Response, key: Key = None) -> FollowedFit:
    """Put a fit of the inputs to the recordings into the queue of the worker.

    The answer comes at once, with the address of the fit in Location. The fit maximises the likelihood over mean and
    std of each input and the output noise by a genetic algorithm, then polishes the best on the exact likelihood.
    """
    fit = submit(store, key, _order(library, asked))
    response.headers["Location"] = f"{store.address}/{fit.workflow_id}"
    return _follow(store, fit)


@router.get("", summary="List the fits", responses=responses(503))
def list_fits(store: TheFits, limit: Annotated[int, Query(ge=1, le=1000, description="Most fits to list.")] = 50,
              offset: Annotated[int, Query(ge=0, description="Fits to skip, from the newest.")] = 0) -> FitList:
    """The fits of all tables and recordings, the newest first."""
    return FitList(fits=[describe(store, fit) for fit in store.newest(limit, offset)])


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
    found = {name: output(fit)[name] for name in ("result", "seconds", "processor_seconds")}
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
    initial_state(search, problem)
    order: Order = orjson.loads(orjson.dumps({
        "table": asked.table, "table_digest": table.digest, "simulate": asked.simulate, "parameters": chosen,
        "recordings": asked.recordings, "recordings_digest": recordings.digest,
        "outside": asked.outside, "settings": search.to_dict()}))
    return order


def describe(store: JobStore, fit: WorkflowStatus) -> Fit:
    """What is known of a fit without its progress and result."""
    return Fit(**described(store, fit, "result", "report", "pictures", "cancel"))


def _follow(store: JobStore, fit: WorkflowStatus) -> FollowedFit:
    said = store.progress(fit.workflow_id)
    return FollowedFit(**vars(describe(store, fit)), progress=None if said is None else Progress(**said))
