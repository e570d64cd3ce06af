"""Studies: submission, status, results and cancellation; the worker runs them."""

from dataclasses import asdict
from typing import Annotated, Literal

import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Body, Depends, Query, Request, Response

from slipstick.errors import InvalidValue
from slipstick.machine import Runs
from slipstick.naming.study import scene_of
from slipstick.storage.library import Library
from slipstick.studies.progress import StudyProgress

from ..bodies import JsonRoute
from ..computations import computes
from ..csv_form import CSV_RESPONSE, TableFormQuery, entries_csv, wants_csv
from ..error_responses import error_responses
from ..following import FollowingDependency, Wait
from ..job_filter import JobFilter
from ..job_store import JobInput, JobStore
from ..jobs import (
    bench_input,
    delete,
    finished_job,
    idempotency_key_header,
    input_of,
    is_of_machine,
    job_fields,
    job_filter,
    job_id_path,
    output_of,
    require_complete,
    store_of,
    submit,
    version_of,
    wait_for_end,
)
from ..paging import Limit, Offset, page_links
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..schemas import LibraryDependency
from ..study_schemas import FinishedStudy, ModelSpec, Study, StudyList, StudyRequest, StudyWithProgress

router = APIRouter(prefix="/v1/studies", tags=["studies"], route_class=JsonRoute)


StudyStore = Annotated[JobStore, store_of("study")]
Wanted = Annotated[JobFilter, Depends(job_filter)]
StudyId = Annotated[str, job_id_path("study")]
IdempotencyKey = Annotated[str | None, idempotency_key_header("study")]

_EXAMPLE = {"recordings": "measured", "settings": {"level": 0.9, "seed": 1}}


@router.post("", summary="Submit a study", status_code=202, responses=error_responses(404, 408, 409, 413, 415, 503))
@computes
def submit_study(body: Annotated[StudyRequest, Body(examples=[_EXAMPLE])], library: LibraryDependency,
                 store: StudyStore, response: Response, key: IdempotencyKey = None) -> StudyWithProgress:
    """Submit a study, which finds and measures physical effects that the recordings show and the model lacks.

    The request returns immediately, with the address of the study in the header Location. A worker runs the study. It
    splits the model into blocks at its measured signals, and tests in each block, with measured signals as its input,
    which quantity depends on something that the model does not contain. Findings are named after effects of the
    catalogue, and confirmed by fits of the simulation of the whole test bench without and with them. Recordings need
    the pressure, or the torque and a speed, and 24 or more engagements; others are rejected with 422. A study of
    recordings that cannot be of the bench fails within seconds. Runs of a declared machine are studied by a worker that
    was given the file of this machine (`slipstick work --machine FILE.py`), with the settings `engine`.
    """
    study = submit(store, key, _job_input(library, body), "long")
    response.headers["Location"] = f"{store.address}/{study.workflow_id}"
    return with_progress(store, study)


@router.get("", summary="List the studies", response_model=StudyList,
            responses=error_responses(503) | CSV_RESPONSE)
def list_studies(store: StudyStore, request: Request, wanted: Wanted, limit: Limit = 50,
                 offset: Offset = 0, form: TableFormQuery = None) -> StudyList | Response:
    """Return the studies, newest first, without their progress and results; filters select some of them."""
    jobs, total = store.newest(limit, offset, wanted), store.total(wanted)
    studies = [without_progress(store, study) for study in jobs]
    if wants_csv(request, form):
        return entries_csv(studies, Study, "studies")
    return StudyList(studies=studies, total=total,
                     links=page_links(request, limit, offset, total))


@router.get("/{id}", summary="Get the status of a study", responses=error_responses(404, 503))
async def follow_study(id: StudyId, store: StudyStore, following: FollowingDependency, request: Request,
                       wait: Wait = 0) -> StudyWithProgress:
    """Return the status of a study and its progress: its step, the share of steps that are done, and what it is doing.

    With `wait`, the response comes when the study has ended, or after this time.
    """
    return await wait_for_end(following, request, f"{store.address}/{id}",
                              lambda: with_progress(store, store.find(id)), wait)


@router.get("/{id}/result", summary="Get the result of a study",
            responses=error_responses(404, 409, 503) | NOT_MODIFIED)
def study_result(id: StudyId, store: StudyStore, client: RevalidationDependency) -> FinishedStudy:
    """Return what is missing, its measured law, the evidence for it and what it is worth; 409 unless it is done."""
    study = finished_job(store, id)
    client.require_change(version_of(study))
    job_input, output = input_of(study), output_of(study)
    return FinishedStudy(id=id, recordings=job_input["recordings"], recordings_digest=job_input["recordings_digest"],
                         **{name: output[name] for name in ("result", "seconds", "processor_seconds")})


@router.get("/{id}/model", summary="Get the extended model of a study", response_model_exclude_unset=True,
            responses=error_responses(404, 409, 503))
def study_model(id: StudyId, store: StudyStore, which: Annotated[Literal["before", "after"], Query(
        description="`after`: the refitted model with what was found. `before`: the refitted model without it.",
        )] = "after") -> ModelSpec:
    """Return a model of the study in the format that `slipstick build --model` reads.

    A finding is added as the effect of the catalogue that it is named after, or else as its measured law, where the
    simulation has such a quantity. If nothing is added, both models are the refitted model. The worker builds a table
    from the model, which the service then serves with the other tables. The report of the study can compare fits on the
    tables of both models.
    """
    study = finished_job(store, id)
    require_complete(store, study)
    if is_of_machine(study):
        raise InvalidValue(f"The study '{id}' is of a declared machine, which has no model file",
                           "Fetch its laws, and add them to the equations")
    return ModelSpec(**output_of(study)["result"][which]["model"])


@router.post("/{id}/cancel", summary="Cancel a study", responses=error_responses(404, 503))
def cancel_study(id: StudyId, store: StudyStore) -> StudyWithProgress:
    """Cancel a queued or running study. A study that has ended is unchanged. The worker stops within a second."""
    store.cancel(id)
    return with_progress(store, store.find(id))


@router.delete("/{id}", summary="Delete a study", status_code=204, responses=error_responses(404, 409, 503))
def delete_study(id: StudyId, store: StudyStore) -> None:
    """Delete a study with its result; 409 while it is queued or running. Its id can then be used again."""
    delete(store, id)


def _job_input(library: Library, body: StudyRequest) -> JobInput:
    """Return the input of the worker, after checks that reject a study that would fail later."""
    recorded = library.recorded(body.recordings)
    if isinstance(recorded, Runs):
        return {"recordings": body.recordings, "recordings_digest": recorded.digest, "machine": recorded.machine,
                "settings": asdict(body.engine), "time_budget": body.time_budget, **bench_input(library, None)}
    recordings = library.recording(body.recordings)
    bench = body.bench or library.bench_of_recordings(recordings)
    scene_of(library.bench(bench), recordings, body.settings.naming)
    job_input: JobInput = orjson.loads(orjson.dumps({
        "recordings": body.recordings, "recordings_digest": recordings.digest, "settings": asdict(body.settings),
        "time_budget": body.time_budget, **bench_input(library, bench)}))
    return job_input


def without_progress(store: JobStore, study: WorkflowStatus) -> Study:
    """Return a study without its progress and result."""
    return Study(**job_fields(store, study, "result", "laws", "report", "pictures", "model", "events", "cancel"))


def with_progress(store: JobStore, study: WorkflowStatus) -> StudyWithProgress:
    """Return a study with its place in the queue and its progress."""
    progress, share = store.progress(study.workflow_id), {"done": 1.0} if study.status == "SUCCESS" else {}
    known = None if progress is None or "done" not in progress else StudyProgress(**{**progress, **share})
    return StudyWithProgress(**vars(without_progress(store, study)), ahead=store.ahead(study), progress=known)
