"""What a finished study looks like: its report, and each picture of it."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse

from service.bodies import JsonRoute
from service.drawings import HTML, PICTURE, PictureList, Wanted, listed, name_in_path, picture
from service.job_store import JobStore
from service.jobs import finished, output
from service.problem_details import responses
from service.routes.studies import StudyId, TheStudies, describe
from service.routes.study_fits import StudyFits
from slipstick.pictures import Spec, study
from slipstick.report.study.page import study_page

router = APIRouter(prefix="/v1/studies/{id}", tags=["studies"], route_class=JsonRoute)

PictureName = Annotated[str, name_in_path(study.CAPTIONS, "gap", "The gap before and after")]


@router.get("/report", summary="Report of a study", response_class=HTMLResponse, response_model=None,
            responses=responses(404, 409, 503) | HTML)
def study_report(id: StudyId, store: TheStudies, fits: StudyFits) -> HTMLResponse:
    """One HTML page with all there is to know about a finished study, to read, print, keep and pass on.

    What is missing and how sure that is, where it shows, the gap before and after with a control, the pictures, and
    what such a study cannot say. With `before` and `after` also what adding it does to a fit: likelihood, scatter
    and output noise of the same fit on the tables of both models. The page needs no network.
    """
    study = finished(store, id)
    return HTMLResponse(study_page(describe(store, study).model_dump(mode="json"), output(study), fits))


@router.get("/pictures", summary="List the pictures of a study", responses=responses(404, 409, 503))
def study_pictures(id: StudyId, store: TheStudies, fits: StudyFits) -> PictureList:
    """The pictures that a finished study has something to show on, with their titles and captions.

    With `before` and `after`, `surfaces` is among them.
    """
    query = "" if fits is None else f"?before={fits['before']['id']}&after={fits['after']['id']}"
    return listed(_drawn(store, id, fits), study.CAPTIONS, f"{store.address}/{id}/pictures", query)


@router.get("/pictures/{name}", summary="A picture of a study", response_model=None,
            responses=responses(404, 409, 503) | PICTURE)
def study_picture(id: StudyId, name: PictureName, store: TheStudies, fits: StudyFits, request: Request,
                  format: Wanted = None) -> Response:
    """A picture as Vega-Lite (JSON), SVG or PNG, by `format` or by the Accept header."""
    return picture(_drawn(store, id, fits), name, request, format)


def _drawn(store: JobStore, id: str, fits: StudyFits) -> dict[str, Spec]:
    left = output(finished(store, id))
    return study.study_pictures(left["result"], left["figure_data"], fits)
