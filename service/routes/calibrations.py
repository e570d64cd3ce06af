"""Calibrations: submission, report, pictures and the calibrated model; the worker runs them."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Response

from slipstick.calibration import Calibration as FittedCalibration
from slipstick.calibration import require_signals
from slipstick.errors import InvalidValue
from slipstick.machine import Runs
from slipstick.report.calibration import CAPTIONS
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..calibration_schemas import (
    Calibration,
    CalibrationList,
    CalibrationRequest,
    CalibrationWithProgress,
    FinishedCalibration,
)
from ..computations import computes
from ..error_responses import error_responses
from ..job_kind import JobKind
from ..job_store import JobInput, JobStore
from ..jobs import bench_input, finished_job, is_of_machine, output_of, submit, version_of
from ..routes.drawing_routes import DrawingTexts, Drawn, add_drawing_routes
from ..routes.job_routes import add_job_routes
from ..schemas import LibraryDependency
from ..study_schemas import ModelSpec, model_input

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"], route_class=JsonRoute)

CALIBRATIONS = JobKind(
    "calibration", Calibration, CalibrationWithProgress, CalibrationList, FinishedCalibration,
    ("result", "report"),
    about_state="Return the status of a calibration and its progress: the iteration, and how far it moved.",
    about_result="Return the parameters with intervals and scatter in their units, and what is left",
    bench_links=("pictures", "model"))
CalibrationStore = Annotated[JobStore, CALIBRATIONS.store]
CalibrationId = Annotated[str, CALIBRATIONS.id_path]
IdempotencyKey = Annotated[str | None, CALIBRATIONS.key_header]

_EXAMPLE = {"recordings": "measured", "bench": "heavy"}
_TEXTS = DrawingTexts(
    report="The report contains the parameters with intervals and scatter, the noise of the sensors with what is left "
           "beyond it, the correlation of the estimates, and the provenance.",
    pictures=" A declared machine has none, because its parameters have different units.",
    names=CAPTIONS, example=("parameters", "The parameters with their intervals"))


@router.post("", summary="Submit a calibration", status_code=202,
             responses=error_responses(404, 408, 409, 413, 415, 503))
@computes
def submit_calibration(body: Annotated[CalibrationRequest, Body(examples=[_EXAMPLE])], library: LibraryDependency,
                       store: CalibrationStore, response: Response,
                       key: IdempotencyKey = None) -> CalibrationWithProgress:
    """Submit a calibration: the uncertain parameters of a bench, and their scatter from run to run, from recordings.

    The request returns immediately, with the address of the calibration in the header Location. A worker runs it. The
    bench file says which parameters are uncertain, and between which bounds. Recordings need at least one signal, and
    two engagements for each of these parameters; others are rejected with 422. A calibration to recordings that cannot
    be of the bench fails within seconds. The parameters of a declared machine are fitted to its runs, without `bench`
    and `model`, by a worker that was given the file of this machine (`slipstick work --machine FILE.py`).
    """
    calibration = submit(store, key, _job_input(library, body), "long")
    response.headers["Location"] = f"{store.address}/{calibration.workflow_id}"
    return CALIBRATIONS.with_progress(store, calibration)


@router.get("/{id}/model", summary="Get the calibrated model", response_model_exclude_unset=True,
            responses=error_responses(404, 409, 503))
def calibration_model(id: CalibrationId, store: CalibrationStore) -> ModelSpec:
    """Return the model with the estimates, from which a table is built (`POST /v1/builds`, `slipstick build --model`).

    A calibration with parameters at a bound has no such model, and neither has one of a declared machine: 422.
    """
    calibration = finished_job(store, id)
    if is_of_machine(calibration):
        raise InvalidValue(f"The calibration '{id}' is of a declared machine, which has no model file",
                           "Write the parameters of its result into the file of the machine")
    result = output_of(calibration)["result"]
    FittedCalibration.from_spec(result).require_inside()
    return ModelSpec(**result["model"])


def _job_input(library: Library, body: CalibrationRequest) -> JobInput:
    """Return the input of the worker, after checks that reject a calibration that would fail later."""
    recorded = library.recorded(body.recordings)
    bench = None
    if isinstance(recorded, Runs):
        if body.bench is not None or body.model is not None:
            raise InvalidValue(f"'{body.recordings}' has runs of the machine '{recorded.machine}', which has no bench "
                               "and no model file", "Omit `bench` and `model`")
    else:
        recordings = library.recording(body.recordings)
        bench = body.bench or library.bench_of_recordings(recordings)
        require_signals(recordings, library.bench(bench))
    return {
        "recordings": body.recordings, "recordings_digest": recorded.digest,
        "machine": recorded.machine if isinstance(recorded, Runs) else None, "time_budget": body.time_budget,
        **model_input(None if bench is None else library.bench(bench), body.model), **bench_input(library, bench)}


def drawn_calibration(id: CalibrationId, store: CalibrationStore) -> Drawn:
    """What is drawn of a calibration."""
    def request() -> dict[str, Any]:
        finished = finished_job(store, id)
        return {"kind": "calibration", "output": output_of(finished),
                "job": CALIBRATIONS.without_progress(store, finished).model_dump(mode="json")}

    return Drawn((version_of(finished_job(store, id, output=False)),), request, f"{store.address}/{id}")


add_job_routes(router, CALIBRATIONS)
add_drawing_routes(router, CALIBRATIONS, _TEXTS, drawn_calibration)
