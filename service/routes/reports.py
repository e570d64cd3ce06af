"""The report and the pictures of a fit."""

from contextlib import suppress
from dataclasses import replace
from typing import Annotated, Any

from dbos import WorkflowStatus
from fastapi import APIRouter, Query

from slipstick.errors import InvalidValue, SlipstickError
from slipstick.pictures import CAPTIONS
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..jobs import finished_job, input_of, output_of, require_complete, version_of
from ..routes.drawing_routes import DrawingTexts, Drawn, add_drawing_routes
from ..routes.fits import FITS, FitId, FitStore
from ..schemas import LibraryDependency

router = APIRouter(prefix="/v1/fits", tags=["reports"], route_class=JsonRoute)

_EQUAL_INPUTS = ("recordings_digest", "table_digest", "simulate", "parameters", "outside")
_EQUAL_SETTINGS = ("families", "correlated", "mean_bounds", "std_bounds", "output_std_bounds", "refine")
"""Entries of the job input, and of its settings, in which two fits must agree to be compared in Table II."""

OtherFitQuery = Annotated[str | None, Query(
    description="Id of a finished fit of the same inputs by the other method (`genetic` or `classic`). The report then "
                "compares the cost of both methods, as in Table II of the paper.")]


_TEXTS = DrawingTexts(
    report="The report contains the fitted distributions, the pictures, the computational cost in comparison with "
           "Table II of the paper, the provenance of the result, and its limitations.",
    names=CAPTIONS, example=("comparison", "Measured against simulated shifting times"))


def drawn_fit(id: FitId, store: FitStore) -> Drawn:
    """What is drawn of a fit."""
    version = version_of(finished_job(store, id, output=False))
    return Drawn((version,), lambda: {"kind": "fit", "output": output_of(finished_job(store, id))},
                 f"{store.address}/{id}")


def _drawn_page(id: FitId, store: FitStore, library: LibraryDependency, beside: OtherFitQuery = None) -> Drawn:
    """As for its pictures, with the other fit that the report compares; raises `InvalidValue` if it cannot."""
    fit = finished_job(store, id, output=beside is not None)
    other = None if beside is None else finished_job(store, beside)
    if other is not None:
        require_complete(store, other)
    description = _recordings_description(library, fit)
    other_output = None if other is None else _comparable_output(fit, other)
    pictures = drawn_fit(id, store)
    return replace(pictures, version=(version_of(fit, *([other] if other else [])), description), request=lambda: {
        **pictures.request(), "job": FITS.without_progress(store, fit).model_dump(mode="json"), "other": other_output,
        "description": description})


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


add_drawing_routes(router, FITS, _TEXTS, drawn_fit, _drawn_page)
