"""What a finished fit looks like: its report, and each picture of it."""

import re
from contextlib import suppress
from typing import Annotated, Any, Literal

import orjson
from dbos import WorkflowStatus
from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import HTMLResponse
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.job_store import JobStore
from service.problems import responses
from service.routes.fits import FitId, TheFits, describe, finished, ordered
from service.schemas import TheLibrary
from slipstick.errors import InvalidValue, SlipstickError, UnknownName
from slipstick.library import Library
from slipstick.pictures import CAPTIONS, Spec, pictures
from slipstick.pictures.rendering import render
from slipstick.report import page

router = APIRouter(prefix="/v1/fits/{id}", tags=["reports"], route_class=JsonRoute)

Form = Literal["json", "svg", "png"]
_MEDIA: dict[Form, str] = {"json": "application/json", "svg": "image/svg+xml", "png": "image/png"}
_ACCEPTED: dict[str, Form] = {**{media: form for form, media in _MEDIA.items()}, "image/*": "svg", "*/*": "json"}
_COMPARED = ("recordings_digest", "table_digest", "simulate", "parameters", "outside")
_COMPARED_SETTINGS = ("families", "correlated", "mean_bounds", "std_bounds", "output_std_bounds", "refine")
_HTML: dict[int | str, dict[str, Any]] = {200: {
    "description": "The report", "content": {"text/html": {"schema": {"type": "string"}}}}}
_PICTURE: dict[int | str, dict[str, Any]] = {200: {"description": "The picture", "content": {
    "application/json": {"schema": {"type": "object", "description": "Vega-Lite, version 5."}},
    "image/svg+xml": {"schema": {"type": "string"}},
    "image/png": {"schema": {"type": "string", "format": "binary"}}}}}


class PictureEntry(BaseModel):
    """A picture in the list."""

    name: str = Field(description="Name of the picture.")
    title: str = Field(description="What is seen on it.")
    caption: str = Field(description="How to read it.")
    href: str = Field(description="Address of the picture.")


class PictureList(BaseModel):
    """The pictures of a fit."""

    pictures: list[PictureEntry] = Field(description="In the order of the report.")


PictureName = Annotated[str, Path(description=f"Name of the picture: {', '.join(CAPTIONS)}.", openapi_examples={
    "comparison": {"summary": "Measured against simulated times", "value": "comparison"}})]
Beside = Annotated[str | None, Query(description="Id of a finished fit of the same by the other method: it fills the "
                                                 "other row of Table II.")]
Wanted = Annotated[Form | None, Query(
    description="json for Vega-Lite, svg, or png; without it the Accept header decides.")]


@router.get("/report", summary="Report of a fit", response_class=HTMLResponse, response_model=None,
            responses=responses(404, 409, 503) | _HTML)
def fit_report(id: FitId, store: TheFits, library: TheLibrary, beside: Beside = None) -> HTMLResponse:
    """One HTML page with all there is to know about a finished fit, to read, print, keep and pass on.

    What was found in words and numbers, the pictures, Table II of the paper with this fit beside it, where it comes
    from, and what it cannot say. The page needs no network.
    """
    fit = finished(store, id)
    other = None if beside is None else _comparable(fit, finished(store, beside))
    return HTMLResponse(page(describe(fit).model_dump(mode="json"), _output(fit), other, _description(library, fit)))


@router.get("/pictures", summary="List the pictures of a fit", responses=responses(404, 409, 503))
def fit_pictures(id: FitId, store: TheFits) -> PictureList:
    """The pictures that a finished fit has something to show on, with their titles and captions."""
    return PictureList(pictures=[
        PictureEntry(name=name, title=spec["title"]["text"], caption=CAPTIONS[name],
                     href=f"/v1/fits/{id}/pictures/{name}") for name, spec in _drawn(store, id).items()])


@router.get("/pictures/{name}", summary="A picture of a fit", response_model=None,
            responses=responses(404, 409, 503) | _PICTURE)
def fit_picture(id: FitId, name: PictureName, store: TheFits, request: Request, format: Wanted = None) -> Response:
    """A picture as Vega-Lite (JSON), SVG or PNG, by `format` or by the Accept header."""
    drawn = _drawn(store, id)
    if name not in drawn:
        raise UnknownName.of("picture", name, drawn)
    form = format or _accepted(request.headers.get("accept", ""))
    content = orjson.dumps(drawn[name]) if form == "json" else render(drawn[name], form)
    return Response(content, media_type=_MEDIA[form], headers={"Vary": "Accept"})


def _drawn(store: JobStore, id: str) -> dict[str, Spec]:
    output = _output(finished(store, id))
    return pictures(output["result"], output["evidence"])


def _output(fit: WorkflowStatus) -> dict[str, Any]:
    assert fit.output is not None
    output: dict[str, Any] = fit.output
    return output


def _accepted(header: str) -> Form:
    """What the Accept header likes best of what there is; JSON where it says nothing about it."""
    liked = re.findall(r"([\w*]+/[\w*+.-]+)\s*(?:;\s*q=([01](?:\.\d*)?))?", header)
    known = [(-float(weight or 1), _ACCEPTED[media]) for media, weight in liked if media in _ACCEPTED]
    return min(known, key=lambda entry: entry[0])[1] if known else "json"


def _comparable(fit: WorkflowStatus, other: WorkflowStatus) -> dict[str, Any]:
    """The output of the other fit; raises `InvalidValue` where Table II cannot have both."""
    same = all(ordered(fit)[name] == ordered(other)[name] for name in _COMPARED) and all(
        ordered(fit)["settings"][name] == ordered(other)["settings"][name] for name in _COMPARED_SETTINGS)
    if not same or _output(fit)["result"]["method"] == _output(other)["result"]["method"]:
        raise InvalidValue(f"The fit '{other.workflow_id}' has other recordings, another model, other inputs or "
                           "bounds, or is by the same method",
                           "Name a fit of the same inputs of the same table to the same recordings: one is classic, "
                           "the other genetic")
    return _output(other)


def _description(library: Library, fit: WorkflowStatus) -> str:
    """What the recordings say about themselves, if they are still those that were fitted."""
    order = ordered(fit)
    with suppress(SlipstickError):
        recordings = library.recording(order["recordings"])
        if recordings.digest == order["recordings_digest"]:
            return recordings.description
    return ""
