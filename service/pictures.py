"""Pictures of jobs as responses: a list of them, and each one as Vega-Lite, SVG or PNG."""

import re
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, TypeVar

import orjson
from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

Format = Literal["json", "svg", "png"]
_F = TypeVar("_F", bound=str)
_MEDIA_TYPES: dict[Format, str] = {"json": "application/json", "svg": "image/svg+xml", "png": "image/png"}
_ACCEPTED: dict[str, Format] = {**{media_type: format for format, media_type in _MEDIA_TYPES.items()},
                                "image/*": "svg", "*/*": "json"}

PICTURE_RESPONSE: dict[int | str, dict[str, Any]] = {200: {"description": "The picture", "content": {
    "application/json": {"schema": {"type": "object", "description": "A Vega-Lite 5 specification."}},
    "image/svg+xml": {"schema": {"type": "string"}},
    "image/png": {"schema": {"type": "string", "format": "binary"}}}}}
"""OpenAPI description of a response that contains a picture."""
HTML_RESPONSE: dict[int | str, dict[str, Any]] = {200: {
    "description": "The report", "content": {"text/html": {"schema": {"type": "string"}}}}}
"""OpenAPI description of a response that contains an HTML page."""

FormatQuery = Annotated[Format | None, Query(
    description="Format of the picture: `json` (Vega-Lite), `svg` or `png`. By default the Accept header decides.")]


class PictureEntry(BaseModel):
    """A picture in a list of pictures."""

    name: str = Field(description="Name of the picture.")
    title: str = Field(description="Title of the picture.")
    caption: str = Field(description="Explanation of the picture.")
    href: str = Field(description="Address of the picture.")


class PictureList(BaseModel):
    """The available pictures."""

    pictures: list[PictureEntry] = Field(description="The pictures, in the order of the report.")


def picture_name_path(names: Iterable[str], example: str, summary: str) -> Any:
    """Path parameter for the name of a picture, one of `names`."""
    return Path(alias="name", description=f"Name of the picture: {', '.join(names)}.",
                openapi_examples={example: {"summary": summary, "value": example}})


def picture_list(titles: bytes, address: str, query: str = "") -> PictureList:
    """List the pictures of these `titles`, a JSON object of titles and captions by name.

    Each has the address `address`/name followed by `query`.
    """
    return PictureList(pictures=[PictureEntry(name=name, title=title, caption=caption, href=f"{address}/{name}{query}")
                                 for name, (title, caption) in orjson.loads(titles).items()])


def form(request: Request, format: Format | None) -> Format:
    """The format of a picture that a request asks for, by its parameter or else by the Accept header."""
    return format or preferred(request.headers.get("accept", ""), _ACCEPTED)


def picture_response(picture: bytes, format: Format) -> Response:
    """Return a picture of this format."""
    return Response(picture, media_type=_MEDIA_TYPES[format], headers={"Vary": "Accept"})


def preferred(accept: str, available: Mapping[str, _F]) -> _F:
    """The format of the media range in `available` with the highest weight in the Accept header; that of */* if none.
    """
    media_ranges = re.findall(r"([\w*]+/[\w*+.-]+)\s*(?:;\s*q=([01](?:\.\d*)?))?", accept)
    accepted = [(-float(weight or 1), available[media_range]) for media_range, weight in media_ranges
                if media_range in available]
    return min(accepted, key=lambda entry: entry[0])[1] if accepted else available["*/*"]
