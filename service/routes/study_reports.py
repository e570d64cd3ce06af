"""The report and the pictures of a study."""

from typing import Annotated, Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse

from slipstick.pictures.study import NAMES

from ..bodies import JsonRoute
from ..computations import computes
from ..drawings import DrawingsDependency
from ..error_responses import error_responses
from ..job_store import JobStore
from ..jobs import finished_job, output_of, version_of
from ..pictures import (
    HTML_RESPONSE,
    PICTURE_RESPONSE,
    FormatQuery,
    PictureList,
    form,
    picture_list,
    picture_name_path,
    picture_response,
)
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..routes.studies import StudyId, StudyStore, without_progress
from ..routes.study_fits import StudyFits

router = APIRouter(prefix="/v1/studies/{id}", tags=["studies"], route_class=JsonRoute)

PictureName = Annotated[str, picture_name_path(NAMES, "gap", "Held-out error without and with the findings")]


@router.get("/report", summary="Get the report of a study", response_class=HTMLResponse, response_model=None,
            responses=error_responses(404, 409, 503) | HTML_RESPONSE | NOT_MODIFIED)
@computes
def study_report(id: StudyId, store: StudyStore, fits: StudyFits, client: RevalidationDependency,
                 drawings: DrawingsDependency) -> HTMLResponse:
    """Return the report of a finished study as a single HTML page that needs no network access.

    The report begins with what to do: what to add to the model with its numbers, where that holds, files of the laws
    and of the extended model, and the next experiment. Then come the evidence, the result of each block, the gap
    between model and recordings before and after with a control, and the limitations. It also compares two fits, on
    tables of the models without and with what was found (`before` and `after`, or the newest ones): likelihood, scatter
    of the inputs, and output noise.
    """
    version = _version(store, id, fits)
    client.require_change(*version)
    return HTMLResponse(drawings.made("page", lambda: _read_job(store, id, fits), *version))


@router.get("/pictures", summary="List the pictures of a study", responses=error_responses(404, 409, 503))
@computes
def study_pictures(id: StudyId, store: StudyStore, fits: StudyFits, drawings: DrawingsDependency) -> PictureList:
    """Return the available pictures of a finished study, with titles and captions.

    The picture `surfaces` is available only if there are fits to compare, `before` and `after`.
    """
    query = "" if fits is None else f"?before={fits['before']['id']}&after={fits['after']['id']}"
    titles = drawings.made("titles", lambda: _read_job(store, id, fits), *_version(store, id, fits))
    return picture_list(titles, f"{store.address}/{id}/pictures", query)


@router.get("/pictures/{name}", summary="Get a picture of a study", response_model=None,
            responses=error_responses(404, 409, 503) | PICTURE_RESPONSE | NOT_MODIFIED)
@computes
def study_picture(id: StudyId, name: PictureName, store: StudyStore, fits: StudyFits, request: Request,
                  client: RevalidationDependency, drawings: DrawingsDependency,
                  format: FormatQuery = None) -> Response:
    """Return a picture as Vega-Lite (JSON), SVG or PNG, as selected by `format` or the Accept header."""
    version, chosen = _version(store, id, fits), form(request, format)
    client.require_change(*version)
    return picture_response(drawings.made("picture", lambda: {
        **_read_job(store, id, fits), "name": name, "form": chosen}, *version, name, chosen), chosen)


def _version(store: JobStore, id: str, fits: StudyFits) -> list[str]:
    """What identifies the study, and the fits that are compared: another fit may have taken the id of one."""
    compared = [] if fits is None else [f"{fit['id']} {fit['ended']}" for fit in fits.values()]
    return ["study", version_of(finished_job(store, id, output=False)), *compared]


def _read_job(store: JobStore, id: str, fits: StudyFits) -> dict[str, Any]:
    study = finished_job(store, id)
    return {"kind": "study", "job": without_progress(store, study).model_dump(mode="json"), "output": output_of(study),
            "fits": fits}
