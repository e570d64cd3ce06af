"""Studies: submission, and what they have beyond other jobs; the worker runs them."""

from dataclasses import asdict
from typing import Annotated, Literal

from fastapi import APIRouter, Body, Query, Response

from slipstick.errors import InvalidValue
from slipstick.machine import Runs
from slipstick.machine_studies import require_enough
from slipstick.naming.study import scene_of
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..computations import computes
from ..error_responses import error_responses
from ..job_kind import JobKind
from ..job_store import JobInput, JobStore
from ..jobs import bench_input, finished_job, is_of_machine, output_of, require_complete, submit
from ..routes.job_routes import add_job_routes
from ..schemas import LibraryDependency
from ..study_schemas import FinishedStudy, ModelSpec, Study, StudyList, StudyRequest, StudyWithProgress

router = APIRouter(prefix="/v1/studies", tags=["studies"], route_class=JsonRoute)


STUDIES = JobKind(
    "study", Study, StudyWithProgress, StudyList, FinishedStudy, ("result", "laws", "report", "pictures"),
    about_state="Return the status of a study and its progress: its step, the share of steps that are done, and what "
                "it is doing.",
    about_result="Return what is missing, its measured law, the evidence for it and what it is worth",
    bench_links=("model",))
StudyStore = Annotated[JobStore, STUDIES.store]
StudyId = Annotated[str, STUDIES.id_path]
IdempotencyKey = Annotated[str | None, STUDIES.key_header]

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
    was given the file of this machine (`slipstick work --machine FILE.py`), with the settings `engine`. Fewer than 3
    runs are rejected with 422, and so are a bench or `settings` of a machine, and `engine` of a bench.
    """
    study = submit(store, key, _job_input(library, body), "long")
    response.headers["Location"] = f"{store.address}/{study.workflow_id}"
    return STUDIES.with_progress(store, study)


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


def _job_input(library: Library, body: StudyRequest) -> JobInput:
    """Return the input of the worker, after checks that reject a study that would fail later."""
    recorded = library.recorded(body.recordings)
    if isinstance(recorded, Runs):
        if body.bench is not None or "settings" in body.model_fields_set:
            raise InvalidValue(f"'{body.recordings}' has runs of the machine '{recorded.machine}', which has no bench, "
                               "and `settings` are those of a study of a bench",
                               "Omit `bench` and `settings`; the settings of a machine are `engine`")
        require_enough(recorded)
        return {"recordings": body.recordings, "recordings_digest": recorded.digest, "machine": recorded.machine,
                "settings": asdict(body.engine), "time_budget": body.time_budget, **bench_input(library, None)}
    recordings = library.recording(body.recordings)
    if "engine" in body.model_fields_set:
        raise InvalidValue(f"'{body.recordings}' has recordings of a bench, and `engine` has settings of a study of a "
                           "declared machine", "Omit `engine`; the settings of a bench are `settings`")
    bench = body.bench or library.bench_of_recordings(recordings)
    scene_of(library.bench(bench), recordings, body.settings.naming)
    return {
        "recordings": body.recordings, "recordings_digest": recordings.digest, "settings": asdict(body.settings),
        "time_budget": body.time_budget, **bench_input(library, bench)}


add_job_routes(router, STUDIES)
