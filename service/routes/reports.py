"""What a finished fit looks like: its report, and each picture of it."""

from contextlib import suppress
from typing import Annotated, Any

from dbos import WorkflowStatus
from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import HTMLResponse

from service.bodies import JsonRoute
from service.drawings import HTML, PICTURE, PictureList, Wanted, listed, name_in_path, picture
from service.job_store import JobStore
from service.jobs import finished, ordered, output
from service.problem_details import responses
from service.routes.fits import FitId, TheFits, describe
from service.schemas import TheLibrary
from slipstick.errors import InvalidValue, SlipstickError
from slipstick.pictures import CAPTIONS, Spec, pictures
from slipstick.report import page
from slipstick.storage.library import Library

router = APIRouter(prefix="/v1/fits/{id}", tags=["reports"], route_class=JsonRoute)

_COMPARED = ("recordings_digest", "table_digest", "simulate", "parameters", "outside")
_COMPARED_SETTINGS = ("families", "correlated", "mean_bounds", "std_bounds", "output_std_bounds", "refine")

PictureName = Annotated[str, name_in_path(CAPTIONS, "comparison", "Measured against simulated times")]
Beside = Annotated[str | None, Query(description="Id of a finished fit of the same by the other method: it fills the "
                                                 "other row of Table II.")]


@router.get("/report", summary="Report of a fit", response_class=HTMLResponse, response_model=None,
            responses=responses(404, 409, 503) | HTML)
def fit_report(id: FitId, store: TheFits, library: TheLibrary, beside: Beside = None) -> HTMLResponse:
    """One HTML page with all there is to know about a finished fit, to read, print, keep and pass on.

    What was found in words and numbers, the pictures, Table II of the paper with this fit beside it, where it comes
    from, and what it cannot say. The page needs no network.
    """
    fit = finished(store, id)
    other = None if beside is None else _comparable(fit, finished(store, beside))
    described = describe(store, fit).model_dump(mode="json")
    return HTMLResponse(page(described, output(fit), other, _description(library, fit)))


@router.get("/pictures", summary="List the pictures of a fit", responses=responses(404, 409, 503))
def fit_pictures(id: FitId, store: TheFits) -> PictureList:
    """The pictures that a finished fit has something to show on, with their titles and captions."""
    return listed(_drawn(store, id), CAPTIONS, f"{store.address}/{id}/pictures")


@router.get("/pictures/{name}", summary="A picture of a fit", response_model=None,
            responses=responses(404, 409, 503) | PICTURE)
def fit_picture(id: FitId, name: PictureName, store: TheFits, request: Request, format: Wanted = None) -> Response:
    """A picture as Vega-Lite (JSON), SVG or PNG, by `format` or by the Accept header."""
    return picture(_drawn(store, id), name, request, format)


def _drawn(store: JobStore, id: str) -> dict[str, Spec]:
    left = output(finished(store, id))
    return pictures(left["result"], left["figure_data"])


def _comparable(fit: WorkflowStatus, other: WorkflowStatus) -> dict[str, Any]:
    """The output of the other fit; raises `InvalidValue` where Table II cannot have both."""
    same = all(ordered(fit)[name] == ordered(other)[name] for name in _COMPARED) and all(
        ordered(fit)["settings"][name] == ordered(other)["settings"][name] for name in _COMPARED_SETTINGS)
    if not same or output(fit)["result"]["method"] == output(other)["result"]["method"]:
        raise InvalidValue(f"The fit '{other.workflow_id}' has other recordings, another model, other inputs or "
                           "bounds, or is by the same method",
                           "Name a fit of the same inputs of the same table to the same recordings: one is classic, "
                           "the other genetic")
    return output(other)


def _description(library: Library, fit: WorkflowStatus) -> str:
    """What the recordings say about themselves, if they are still those that were fitted."""
    order = ordered(fit)
    with suppress(SlipstickError):
        recordings = library.recording(order["recordings"])
        if recordings.digest == order["recordings_digest"]:
            return recordings.description
    return ""
