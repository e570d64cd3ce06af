"""Fits: submission, status, results and cancellation; the worker runs them."""

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Body, Depends, Query, Request, Response

from slipstick.black_box import BlackBoxDescription
from slipstick.errors import InvalidValue
from slipstick.inference.fitting import complete_settings
from slipstick.inference.problems import machine_problem, require_reach, simulated_problem, table_problem
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..computations import computes
from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..fit_cost import fit_cost, queue_of, require_cost
from ..fit_schemas import Fit, FitList, FitProgress, FitRequest, FitResult, FitWithProgress
from ..following import FollowingDependency, Wait
from ..job_filter import JobFilter
from ..job_store import JobInput, JobStore, Queue
from ..jobs import (
    bench_input,
    delete,
    finished_job,
    idempotency_key_header,
    input_of,
    job_fields,
    job_filter,
    job_id_path,
    output_of,
    store_of,
    submit,
    version_of,
    wait_for_end,
)
from ..paging import Limit, Offset, page_links
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..schemas import LibraryDependency, SettingsDependency

router = APIRouter(prefix="/v1/fits", tags=["fits"], route_class=JsonRoute)


FitStore = Annotated[JobStore, store_of("fit")]
TableFilter = Annotated[str | None, Query(alias="table", description="Only fits of this table.")]


async def _fit_filter(jobs: Annotated[JobFilter, Depends(job_filter)], table: TableFilter = None) -> JobFilter:
    return replace(jobs, table=table)


Wanted = Annotated[JobFilter, Depends(_fit_filter)]
FitId = Annotated[str, job_id_path("fit")]
IdempotencyKey = Annotated[str | None, idempotency_key_header("fit")]

_EXAMPLE = {"table": "nominal", "recordings": "measured",
            "settings": {"population": 24, "generations": 12, "seed": 1}}


@router.post("", summary="Submit a fit", status_code=202, responses=error_responses(404, 408, 409, 413, 415, 503))
@computes
def submit_fit(body: Annotated[FitRequest, Body(examples=[_EXAMPLE])], library: LibraryDependency, store: FitStore,
               settings: SettingsDependency, response: Response, key: IdempotencyKey = None) -> FitWithProgress:
    """Submit a fit of the distributions of the inputs to recordings.

    The request returns immediately, with the address of the fit in the header Location. A worker runs the fit: a
    genetic algorithm (by default) maximises the likelihood over the mean and standard deviation of each input and the
    output noise; its best candidate is then refined on the exact likelihood. Measurements that no inputs of the table
    reach, such as those in another unit, are rejected with 422.
    """
    fit = submit(store, key, *_job(library, body, settings.fit_values))
    response.headers["Location"] = f"{store.address}/{fit.workflow_id}"
    return with_progress(store, fit)


@router.get("", summary="List the fits", response_model=FitList, responses=error_responses(503) | CSV_RESPONSE)
def list_fits(store: FitStore, request: Request, wanted: Wanted, limit: Limit = 50, offset: Offset = 0,
              form: TableFormQuery = None) -> FitList | Response:
    """Return the fits, newest first, without their progress and results; filters select some of them."""
    jobs, total = store.newest(limit, offset, wanted), store.total(wanted)
    fits = [without_progress(store, fit) for fit in jobs]
    if wants_csv(request, form):
        return entries_csv(fits, Fit, "fits")
    return FitList(fits=fits, total=total,
                   links=page_links(request, limit, offset, total))


@router.get("/{id}", summary="Get the status of a fit", responses=error_responses(404, 503))
async def follow_fit(id: FitId, store: FitStore, following: FollowingDependency, request: Request,
                     wait: Wait = 0) -> FitWithProgress:
    """Return the status of a fit, its progress after every generation, and its best candidate so far.

    With `wait`, the response comes when the fit has ended, or after this time.
    """
    return await wait_for_end(following, request, f"{store.address}/{id}",
                              lambda: with_progress(store, store.find(id)), wait)


@router.get("/{id}/result", summary="Get the result of a fit", responses=error_responses(404, 409, 503) | NOT_MODIFIED)
def fit_result(id: FitId, store: FitStore, client: RevalidationDependency) -> FitResult:
    """Return the fitted distributions, their likelihood and diagnostics; 409 unless the fit is done."""
    fit = finished_job(store, id)
    client.require_change(version_of(fit))
    job_input, output = input_of(fit), output_of(fit)
    return FitResult(id=id, **{name: job_input[name] for name in ("table", "table_digest", "recordings",
                                                                  "recordings_digest")},
                     **{name: output[name] for name in ("result", "physical", "seconds", "processor_seconds")})


@router.post("/{id}/cancel", summary="Cancel a fit", responses=error_responses(404, 503))
def cancel_fit(id: FitId, store: FitStore) -> FitWithProgress:
    """Cancel a queued or running fit. A fit that has ended is unchanged. The worker stops within a second."""
    store.cancel(id)
    return with_progress(store, store.find(id))


@router.delete("/{id}", summary="Delete a fit", status_code=204, responses=error_responses(404, 409, 503))
def delete_fit(id: FitId, store: FitStore) -> None:
    """Delete a fit with its result; 409 while it is queued or running. Its id can then be used again."""
    delete(store, id)


def _job(library: Library, body: FitRequest, most_values: int) -> tuple[JobInput, Queue]:
    """Return the input of the worker and the queue, after checks that reject a fit that would fail later."""
    table, recordings = library.table(body.table), library.measured(body.recordings)
    parameters = body.parameters or [axis.name for axis in table.axes]
    bench = None
    if body.bench or (body.simulate and not isinstance(table.model, BlackBoxDescription)):
        bench = body.bench or library.bench_of_model(table.clutch.physics)
        library.bench(bench).require(table.clutch.physics)
    if not body.simulate:
        problem = table_problem(table, recordings, body.outside, parameters)
        require_reach(problem, table.output)
    elif isinstance(table.model, BlackBoxDescription):
        problem = machine_problem(table.model, _only_in_workers, recordings, parameters)
    else:
        assert bench is not None
        problem = simulated_problem(table.model, library.recording(body.recordings), parameters, library.bench(bench))
    if body.simulate and body.outside != "clip":
        raise InvalidValue(f"`outside` is `{body.outside}`, but the simulator has no edges", "Omit `outside`")
    settings = complete_settings(body.settings.checked(), problem)
    cost = fit_cost(settings, problem, body.simulate)
    require_cost(cost, most_values)
    job_input: JobInput = orjson.loads(orjson.dumps({
        "table": body.table, "table_digest": table.digest, "simulate": body.simulate, "parameters": parameters,
        "recordings": body.recordings, "recordings_digest": recordings.digest,
        "outside": body.outside, "settings": settings.to_dict(), "time_budget": body.time_budget,
        **bench_input(library, bench)}))
    return job_input, queue_of(cost)


def _only_in_workers(points: np.ndarray, conditions: Any, /) -> np.ndarray:
    """The simulator of another machine: the service never runs what a file names."""
    raise NotImplementedError


def without_progress(store: JobStore, fit: WorkflowStatus) -> Fit:
    """Return a fit without its progress and result."""
    return Fit(**job_fields(store, fit, "result", "residuals", "report", "pictures", "events", "cancel"))


def with_progress(store: JobStore, fit: WorkflowStatus) -> FitWithProgress:
    """Return a fit with its place in the queue and its progress."""
    progress = store.progress(fit.workflow_id)
    return FitWithProgress(**vars(without_progress(store, fit)), ahead=store.ahead(fit),
                           progress=None if progress is None else FitProgress(**progress))
