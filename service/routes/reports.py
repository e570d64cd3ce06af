"""The report and the pictures of a fit."""

from contextlib import suppress
from typing import Annotated, Any

from dbos import WorkflowStatus
from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import HTMLResponse

from slipstick.errors import InvalidValue, SlipstickError
from slipstick.pictures import CAPTIONS
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..computations import computes
from ..drawings import DrawingsDependency
from ..error_responses import error_responses
from ..job_store import JobStore
from ..jobs import finished_job, input_of, output_of, require_complete, version_of
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
from ..routes.fits import FitId, FitStore, without_progress
from ..schemas import LibraryDependency

router = APIRouter(prefix="/v1/fits/{id}", tags=["reports"], route_class=JsonRoute)

_EQUAL_INPUTS = ("recordings_digest", "table_digest", "simulate", "parameters", "outside")
_EQUAL_SETTINGS = ("families", "correlated", "mean_bounds", "std_bounds", "output_std_bounds", "refine")
"""Entries of the job input, and of its settings, in which two fits must agree to be compared in Table II."""

PictureName = Annotated[str, picture_name_path(CAPTIONS, "comparison", "Measured against simulated shifting times")]
OtherFitQuery = Annotated[str | None, Query(
    description="Id of a finished fit of the same inputs by the other method (`genetic` or `classic`). The report then "
                "compares the cost of both methods, as in Table II of the paper.")]


@router.get("/report", summary="Get the report of a fit", response_class=HTMLResponse, response_model=None,
            responses=error_responses(404, 409, 503) | HTML_RESPONSE | NOT_MODIFIED)
@computes
def fit_report(id: FitId, store: FitStore, library: LibraryDependency, client: RevalidationDependency,
               drawings: DrawingsDependency, beside: OtherFitQuery = None) -> HTMLResponse:
    """Return the report of a finished fit as a single HTML page that needs no network access.

    The report contains the fitted distributions, the pictures, the computational cost in comparison with Table II of
    the paper, the provenance of the result, and its limitations.
    """
    fit = finished_job(store, id, output=beside is not None)
    other = None if beside is None else finished_job(store, beside)
    if other is not None:
        require_complete(store, other)
    description = _recordings_description(library, fit)
    version = version_of(fit, *([other] if other else [])), description
    client.require_change(*version)
    other_output = None if other is None else _comparable_output(fit, other)
    return HTMLResponse(drawings.made("page", lambda: {
        **_read_job(store, id), "job": without_progress(store, fit).model_dump(mode="json"), "other": other_output,
        "description": description}, "fit", *version))


@router.get("/pictures", summary="List the pictures of a fit", responses=error_responses(404, 409, 503))
@computes
def fit_pictures(id: FitId, store: FitStore, drawings: DrawingsDependency) -> PictureList:
    """Return the available pictures of a finished fit, with titles and captions."""
    fit = finished_job(store, id, output=False)
    titles = drawings.made("titles", lambda: _read_job(store, id), "fit", version_of(fit))
    return picture_list(titles, f"{store.address}/{id}/pictures")


@router.get("/pictures/{name}", summary="Get a picture of a fit", response_model=None,
            responses=error_responses(404, 409, 503) | PICTURE_RESPONSE | NOT_MODIFIED)
@computes
def fit_picture(id: FitId, name: PictureName, store: FitStore, request: Request, client: RevalidationDependency,
                drawings: DrawingsDependency, format: FormatQuery = None) -> Response:
    """Return a picture as Vega-Lite (JSON), SVG or PNG, as selected by `format` or the Accept header."""
    version, chosen = version_of(finished_job(store, id, output=False)), form(request, format)
    client.require_change(version)
    return picture_response(drawings.made("picture", lambda: {**_read_job(store, id), "name": name, "form": chosen},
                                          "fit", version, name, chosen), chosen)


def _read_job(store: JobStore, id: str) -> dict[str, Any]:
    return {"kind": "fit", "output": output_of(finished_job(store, id))}


def _comparable_output(fit: WorkflowStatus, other: WorkflowStatus) -> dict[str, Any]:
    """Return the output of the other fit; raises `InvalidValue` if Table II cannot compare the two."""
    equal = all(input_of(fit)[name] == input_of(other)[name] for name in _EQUAL_INPUTS) and all(
        input_of(fit)["settings"][name] == input_of(other)["settings"][name] for name in _EQUAL_SETTINGS)
    if not equal or output_of(fit)["result"]["method"] == output_of(other)["result"]["method"]:
        raise InvalidValue(f"The fit '{other.workflow_id}' differs in its recordings, table, inputs or bounds, or "
                           "uses the same method",
                           "Give a fit of the same inputs of the same table to the same recordings by the other method "
                           "(`genetic` or `classic`)")
    return output_of(other)


def _recordings_description(library: Library, fit: WorkflowStatus) -> str:
    """Return the description of the fitted recordings, or an empty string if they have changed since."""
    job_input = input_of(fit)
    with suppress(SlipstickError):
        recordings = library.recording(job_input["recordings"])
        if recordings.digest == job_input["recordings_digest"]:
            return recordings.description
    return ""
