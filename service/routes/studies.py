"""Studies: submission, status, results and cancellation; the worker runs them."""

from dataclasses import asdict
from typing import Annotated, Literal

import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Body, Depends, Query, Request, Response

from service.bodies import JsonRoute
from service.job_store import JobInput, JobStore
from service.jobs import (
    bench_input,
    finished_job,
    idempotency_key_header,
    input_of,
    job_fields,
    job_id_path,
    output_of,
    submit,
)
from service.problem_details import error_responses
from service.schemas import LibraryDependency
from service.study_schemas import (
    ModelSpec,
    Study,
    StudyList,
    StudyProgress,
    StudyRequest,
    StudyResult,
    StudyWithProgress,
)
from slipstick.storage.library import Library
from slipstick.study.comparison import compare

router = APIRouter(prefix="/v1/studies", tags=["studies"], route_class=JsonRoute)


def _study_store(request: Request) -> JobStore:
    store: JobStore = request.app.state.studies
    return store


StudyStore = Annotated[JobStore, Depends(_study_store)]
StudyId = Annotated[str, job_id_path("study")]
IdempotencyKey = Annotated[str | None, idempotency_key_header("study")]

_EXAMPLE = {"recordings": "measured", "settings": {
    "catalogue": ["stribeck_friction", "quadratic_load_drag"], "shortlist": 1, "most_effects": 1}}


@router.post("", summary="Submit a study", status_code=202, responses=error_responses(404, 408, 409, 413, 415, 503))
def submit_study(body: Annotated[StudyRequest, Body(examples=[_EXAMPLE])], library: LibraryDependency,
                 store: StudyStore, response: Response, key: IdempotencyKey = None) -> StudyWithProgress:
    """Submit a study, which identifies physical effects that the recordings show and the model lacks.

    The request returns immediately, with the address of the study in the header Location. A worker runs the study: it
    fits the parameters and their scatter from run to run, screens the catalogue of effects, fits the most promising
    effects jointly with the parameters, and adds the best one to the model. These steps are repeated until no further
    effect improves the model. By default the whole catalogue is screened.
    """
    study = submit(store, key, _job_input(library, body))
    response.headers["Location"] = f"{store.address}/{study.workflow_id}"
    return _with_progress(store, study)


@router.get("", summary="List the studies", responses=error_responses(503))
def list_studies(store: StudyStore,
                 limit: Annotated[int, Query(ge=1, le=1000, description="Maximum number of studies to return.")] = 50,
                 offset: Annotated[int, Query(ge=0, description="Number of newest studies to skip.")] = 0) -> StudyList:
    """Return the studies, newest first, without their progress and results."""
    return StudyList(studies=[without_progress(store, study) for study in store.newest(limit, offset)])


@router.get("/{id}", summary="Get the status of a study", responses=error_responses(404, 503))
def follow_study(id: StudyId, store: StudyStore) -> StudyWithProgress:
    """Return the status of a study and its progress: stage, number of candidates, and effects added so far."""
    return _with_progress(store, store.find(id))


@router.get("/{id}/result", summary="Get the result of a study", responses=error_responses(404, 409, 503))
def study_result(id: StudyId, store: StudyStore) -> StudyResult:
    """Return the missing effects, the evidence for them and the improvement of the model; 409 unless it is done."""
    study = finished_job(store, id)
    job_input, output = input_of(study), output_of(study)
    return StudyResult(id=id, recordings=job_input["recordings"], recordings_digest=job_input["recordings_digest"],
                       **{name: output[name] for name in ("result", "seconds", "processor_seconds")})


@router.get("/{id}/model", summary="Get the extended model of a study", response_model_exclude_unset=True,
            responses=error_responses(404, 409, 503))
def study_model(id: StudyId, store: StudyStore, which: Annotated[Literal["before", "after"], Query(
        description="`after`: the refitted model with the added effects. `before`: the refitted model without them.",
        )] = "after") -> ModelSpec:
    """Return a model of the study in the format that `python -m worker build --model` reads.

    If no effect was added, both models are the refitted model without effects. The worker builds a table from the
    model, which the service then serves with the other tables. The report of the study can compare fits on the tables
    of both models.
    """
    return ModelSpec(**output_of(finished_job(store, id))["result"]["models"][which])


@router.post("/{id}/cancel", summary="Cancel a study", responses=error_responses(404, 503))
def cancel_study(id: StudyId, store: StudyStore) -> StudyWithProgress:
    """Cancel a queued or running study. A study that has ended is unchanged. The worker first completes its step."""
    store.cancel(id)
    return _with_progress(store, store.find(id))


def _job_input(library: Library, body: StudyRequest) -> JobInput:
    """Return the input of the worker, after checks that reject a study that would fail later."""
    recordings, settings = library.recording(body.recordings), body.settings.checked()
    bench = body.bench or library.bench_of_recordings(recordings)
    compare(library.bench(bench), recordings, settings.shifting_time_noise)
    job_input: JobInput = orjson.loads(orjson.dumps({
        "recordings": body.recordings, "recordings_digest": recordings.digest, "settings": asdict(settings),
        **bench_input(library, bench)}))
    return job_input


def without_progress(store: JobStore, study: WorkflowStatus) -> Study:
    """Return a study without its progress and result."""
    return Study(**job_fields(store, study, "result", "report", "pictures", "model", "cancel"))


def _with_progress(store: JobStore, study: WorkflowStatus) -> StudyWithProgress:
    progress = store.progress(study.workflow_id)
    return StudyWithProgress(**vars(without_progress(store, study)),
                             progress=None if progress is None else StudyProgress(**progress))
