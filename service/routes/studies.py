"""Studies: submitted here, run by the worker, followed and fetched here."""

from dataclasses import asdict
from typing import Annotated, Literal

import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Body, Depends, Query, Request, Response

from service.bodies import JsonRoute
from service.job_store import JobStore, Order
from service.jobs import described, finished, id_in_path, idempotency_key, ordered, output, submit
from service.problem_details import responses
from service.schemas import TheLibrary
from service.study_schemas import FollowedStudy, ModelSpec, Study, StudyList, StudyProgress, StudyRequest, StudyResult
from slipstick.storage.library import Library
from slipstick.study.comparison import compare

router = APIRouter(prefix="/v1/studies", tags=["studies"], route_class=JsonRoute)


def studies(request: Request) -> JobStore:
    """The studies of the application that answers."""
    found: JobStore = request.app.state.studies
    return found


TheStudies = Annotated[JobStore, Depends(studies)]
StudyId = Annotated[str, id_in_path("study")]
Key = Annotated[str | None, idempotency_key("study")]

_EXAMPLE = {"recordings": "measured", "settings": {
    "catalogue": ["stribeck_friction", "quadratic_load_drag"], "shortlist": 1, "most_effects": 1}}


@router.post("", summary="Submit a study", status_code=202, responses=responses(404, 408, 409, 413, 415, 503))
def submit_study(asked: Annotated[StudyRequest, Body(examples=[_EXAMPLE])], library: TheLibrary, store: TheStudies,
                 response: Response, key: Key = None) -> FollowedStudy:
    """Ask which physical effect the recordings show that the model lacks; the worker finds out.

    The answer comes at once, with the address of the study in Location. The study fits parameters and their scatter
    from run to run, screens the catalogue of effects, fits the promising ones jointly, adds the best to the model,
    and goes on until nothing more is missing. Without `settings` all effects are tried.
    """
    study = submit(store, key, _order(library, asked))
    response.headers["Location"] = f"{store.address}/{study.workflow_id}"
    return _follow(store, study)


@router.get("", summary="List the studies", responses=responses(503))
def list_studies(store: TheStudies, limit: Annotated[int, Query(ge=1, le=1000, description="Most to list.")] = 50,
                 offset: Annotated[int, Query(ge=0, description="Studies to skip, from the newest.")] = 0) -> StudyList:
    """The studies of all recordings, the newest first."""
    return StudyList(studies=[describe(store, study) for study in store.newest(limit, offset)])


@router.get("/{id}", summary="Follow a study", responses=responses(404, 503))
def follow_study(id: StudyId, store: TheStudies) -> FollowedStudy:
    """Status, and what is being done: which round, which of how many candidates, and what has been added so far."""
    return _follow(store, store.find(id))


@router.get("/{id}/result", summary="Result of a study", responses=responses(404, 409, 503))
def study_result(id: StudyId, store: TheStudies) -> StudyResult:
    """What is missing, where it shows, how sure that is, and what adding it does; a conflict until it is done."""
    study = finished(store, id)
    found = {name: output(study)[name] for name in ("result", "seconds", "processor_seconds")}
    return StudyResult(id=id, **{name: ordered(study)[name] for name in ("recordings", "recordings_digest")}, **found)


@router.get("/{id}/model", summary="Extended model of a study", responses=responses(404, 409, 503))
def study_model(id: StudyId, store: TheStudies, which: Annotated[Literal["before", "after"], Query(
        description="The refitted model without the effects, or with them.")] = "after") -> ModelSpec:
    """The model with the effects added and the parameters refitted, as `python -m worker build --model` reads it.

    Where nothing is missing it is the refitted model, without effects. Its table is built by the worker, and served
    beside the old one. With fits on the tables of both, the report of the study shows what the effects do to a fit.
    """
    return ModelSpec(**output(finished(store, id))["result"]["models"][which])


@router.post("/{id}/cancel", summary="Cancel a study", responses=responses(404, 503))
def cancel_study(id: StudyId, store: TheStudies) -> FollowedStudy:
    """Stop a study that waits or runs; one that has ended stays as it is. The worker is free after its present step."""
    store.cancel(id)
    return _follow(store, store.find(id))


def _order(library: Library, asked: StudyRequest) -> Order:
    """What the worker is told. Whatever it would stumble over is refused here."""
    recordings, settings = library.recording(asked.recordings), asked.settings.checked()
    compare(recordings, settings.shifting_time_noise)
    order: Order = orjson.loads(orjson.dumps({
        "recordings": asked.recordings, "recordings_digest": recordings.digest, "settings": asdict(settings)}))
    return order


def describe(store: JobStore, study: WorkflowStatus) -> Study:
    """What is known of a study without its progress and result."""
    return Study(**described(store, study, "result", "report", "pictures", "model", "cancel"))


def _follow(store: JobStore, study: WorkflowStatus) -> FollowedStudy:
    said = store.progress(study.workflow_id)
    progress = None if said is None else StudyProgress(**said)
    return FollowedStudy(**vars(describe(store, study)), progress=progress)
