"""Pictures on the wire, whatever they are of: listed, and each as Vega-Lite, SVG or PNG."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import orjson
from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

from slipstick.errors import UnknownName
from slipstick.pictures import Spec
from slipstick.pictures.rendering import render

Form = Literal["json", "svg", "png"]
_MEDIA: dict[Form, str] = {"json": "application/json", "svg": "image/svg+xml", "png": "image/png"}
_ACCEPTED: dict[str, Form] = {**{media: form for form, media in _MEDIA.items()}, "image/*": "svg", "*/*": "json"}

PICTURE: dict[int | str, dict[str, Any]] = {200: {"description": "The picture", "content": {
    "application/json": {"schema": {"type": "object", "description": "Vega-Lite, version 5."}},
    "image/svg+xml": {"schema": {"type": "string"}},
    "image/png": {"schema": {"type": "string", "format": "binary"}}}}}
"""What an operation that answers with a picture documents."""
HTML: dict[int | str, dict[str, Any]] = {200: {
    "description": "The report", "content": {"text/html": {"schema": {"type": "string"}}}}}
"""What one that answers with a page documents."""

Wanted = Annotated[Form | None, Query(
    description="json for Vega-Lite, svg, or png; without it the Accept header decides.")]


class PictureEntry(BaseModel):
    """A picture in the list."""

    name: str = Field(description="Name of the picture.")
    title: str = Field(description="What is seen on it.")
    caption: str = Field(description="How to read it.")
    href: str = Field(description="Address of the picture.")


class PictureList(BaseModel):
    """The pictures that there are."""

    pictures: list[PictureEntry] = Field(description="In the order of the report.")


def name_in_path(captions: Mapping[str, str], example: str, summary: str) -> Any:
    """The parameter of a path that names one of the pictures with these captions."""
    return Path(description=f"Name of the picture: {', '.join(captions)}.",
                openapi_examples={example: {"summary": summary, "value": example}})


def listed(drawn: Mapping[str, Spec], captions: Mapping[str, str], address: str, query: str = "") -> PictureList:
    """The pictures `drawn`, each below `address`, with the `query` that it takes."""
    return PictureList(pictures=[
        PictureEntry(name=name, title=spec["title"]["text"], caption=captions[name], href=f"{address}/{name}{query}")
        for name, spec in drawn.items()])


def picture(drawn: Mapping[str, Spec], name: str, request: Request, format: Form | None) -> Response:
    """Answer with one of the pictures `drawn`, by `format` or by the Accept header; raises `UnknownName`."""
    if name not in drawn:
        raise UnknownName.of("picture", name, drawn)
    form = format or _accepted(request.headers.get("accept", ""))
    content = orjson.dumps(drawn[name]) if form == "json" else render(drawn[name], form)
    return Response(content, media_type=_MEDIA[form], headers={"Vary": "Accept"})


def _accepted(header: str) -> Form:
    """What the Accept header likes best of what there is; JSON where it says nothing about it."""
    liked = re.findall(r"([\w*]+/[\w*+.-]+)\s*(?:;\s*q=([01](?:\.\d*)?))?", header)
    known = [(-float(weight or 1), _ACCEPTED[media]) for media, weight in liked if media in _ACCEPTED]
    return min(known, key=lambda entry: entry[0])[1] if known else "json"
