"""Fits: submission; the worker runs them."""

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Body, Depends, Query, Response

from slipstick.black_box import BlackBoxDescription
from slipstick.errors import InvalidValue
from slipstick.inference.fitting import complete_settings
from slipstick.inference.problems import machine_problem, require_reach, simulated_problem, table_problem
from slipstick.storage.library import Library
from slipstick.storage.queues import name_machine_queue

from ..bodies import JsonRoute
from ..computations import computes
from ..error_responses import error_responses
from ..fit_cost import fit_cost, queue_of, require_cost
from ..fit_schemas import Fit, FitList, FitRequest, FitResult, FitWithProgress
from ..job_filter import JobFilter
from ..job_kind import JobKind
from ..job_store import JobInput, JobStore
from ..jobs import bench_input, job_filter, submit
from ..routes.job_routes import add_job_routes
from ..schemas import LibraryDependency, SettingsDependency

router = APIRouter(prefix="/v1/fits", tags=["fits"], route_class=JsonRoute)


FITS = JobKind(
    "fit", Fit, FitWithProgress, FitList, FitResult, ("result", "residuals", "report", "pictures"),
    about_state="Return the status of a fit, its progress after every generation, and its best candidate so far.",
    about_result="Return the fitted distributions, their likelihood and diagnostics", ends_complete=False)
FitStore = Annotated[JobStore, FITS.store]
TableFilter = Annotated[str | None, Query(alias="table", description="Only fits of this table.")]


async def _fit_filter(jobs: Annotated[JobFilter, Depends(job_filter)], table: TableFilter = None) -> JobFilter:
    return replace(jobs, table=table)


FitId = Annotated[str, FITS.id_path]
IdempotencyKey = Annotated[str | None, FITS.key_header]

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
    return FITS.with_progress(store, fit)


def _job(library: Library, body: FitRequest, most_values: int) -> tuple[JobInput, str]:
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
    job_input = {
        "table": body.table, "table_digest": table.digest, "simulate": body.simulate, "parameters": parameters,
        "recordings": body.recordings, "recordings_digest": recordings.digest,
        "outside": body.outside, "settings": settings.to_dict(), "time_budget": body.time_budget,
        **bench_input(library, bench)}
    if body.simulate and isinstance(table.model, BlackBoxDescription):
        return job_input, name_machine_queue(table.model.title)
    return job_input, queue_of(cost)


def _only_in_workers(points: np.ndarray, conditions: Any, /) -> np.ndarray:
    """The simulator of another machine: the service never runs what a file names."""
    raise NotImplementedError


add_job_routes(router, FITS, _fit_filter)
