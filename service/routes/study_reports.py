"""The report and the pictures of a study."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse

from service.bodies import JsonRoute
from service.computations import computes
from service.job_store import JobStore
from service.jobs import finished_job, input_of, output_of, version_of
from service.pictures import (
    HTML_RESPONSE,
    PICTURE_RESPONSE,
    FormatQuery,
    PictureList,
    picture_list,
    picture_name_path,
    picture_response,
)
from service.problem_details import error_responses
from service.revalidation import NOT_MODIFIED, RevalidationDependency
from service.routes.studies import StudyId, StudyStore, without_progress
from service.routes.study_fits import StudyFits
from slipstick.pictures import Spec
from slipstick.pictures.study import CAPTIONS
from slipstick.pictures.study import study_pictures as picture_specs
from slipstick.report.study.page import study_page
from slipstick.study import StudySettings
from slipstick.study.record import figures_from_dict, result_from_dict

router = APIRouter(prefix="/v1/studies/{id}", tags=["studies"], route_class=JsonRoute)

PictureName = Annotated[str, picture_name_path(CAPTIONS, "gap", "Held-out error without and with the findings")]


@router.get("/report", summary="Get the report of a study", response_class=HTMLResponse, response_model=None,
            responses=error_responses(404, 409, 503) | HTML_RESPONSE | NOT_MODIFIED)
@computes
def study_report(id: StudyId, store: StudyStore, fits: StudyFits, client: RevalidationDependency) -> HTMLResponse:
    """Return the report of a finished study as a single HTML page that needs no network access.

    The report contains what is missing and the evidence for it, what each block of the model says, the gap between
    model and recordings before and after with a control, the pictures, and the limitations of a study. With `before`
    and `after` it also compares two fits, on tables of the models without and with what was found: likelihood, scatter
    of the inputs, and output noise.
    """
    study = finished_job(store, id)
    client.require_change(version_of(study), *_ends(fits))
    return HTMLResponse(study_page(without_progress(store, study).model_dump(mode="json"), output_of(study), fits))


@router.get("/pictures", summary="List the pictures of a study", responses=error_responses(404, 409, 503))
@computes
def study_pictures(id: StudyId, store: StudyStore, fits: StudyFits) -> PictureList:
    """Return the available pictures of a finished study, with titles and captions.

    The picture `surfaces` is available only if `before` and `after` are given.
    """
    query = "" if fits is None else f"?before={fits['before']['id']}&after={fits['after']['id']}"
    return picture_list(_specs(store, id, fits), CAPTIONS, f"{store.address}/{id}/pictures", query)


@router.get("/pictures/{name}", summary="Get a picture of a study", response_model=None,
            responses=error_responses(404, 409, 503) | PICTURE_RESPONSE | NOT_MODIFIED)
@computes
def study_picture(id: StudyId, name: PictureName, store: StudyStore, fits: StudyFits, request: Request,
                  client: RevalidationDependency, format: FormatQuery = None) -> Response:
    """Return a picture as Vega-Lite (JSON), SVG or PNG, as selected by `format` or the Accept header."""
    client.require_change(version_of(finished_job(store, id)), *_ends(fits))
    return picture_response(_specs(store, id, fits), CAPTIONS, name, request, format)


def _ends(fits: StudyFits) -> list[str]:
    """When the fits ended that are compared: another fit may have taken the id of one."""
    return [] if fits is None else [f"{fit['id']} {fit['ended']}" for fit in fits.values()]


def _specs(store: JobStore, id: str, fits: StudyFits) -> dict[str, Spec]:
    study = finished_job(store, id)
    output, settings = output_of(study), StudySettings.from_dict(input_of(study)["settings"])
    return picture_specs(result_from_dict(output["result"]), figures_from_dict(output["figure_data"]), fits, settings)
