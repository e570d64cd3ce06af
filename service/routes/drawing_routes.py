"""What the jobs of every kind that is drawn have: a report, a list of pictures, and each picture."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import HTMLResponse

from ..computations import computes
from ..drawings import DrawingsDependency
from ..error_responses import error_responses
from ..job_kind import JobKind
from ..jobs import Job
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


@dataclass(frozen=True, eq=False)
class Drawn:
    """What is drawn of a finished job: the `request` to slipstick.report.made, and what identifies it, its `version`.

    The addresses of pictures begin with `address` and end with `query`.
    """

    version: tuple[str, ...]
    request: Callable[[], Mapping[str, Any]]
    address: str
    query: str = ""


@dataclass(frozen=True)
class DrawingTexts:
    """What the documentation says about report and pictures, of these `names`; `example` is one, and its content."""

    report: str
    names: Iterable[str]
    example: tuple[str, str]
    pictures: str = ""


def add_drawing_routes(router: APIRouter, kind: JobKind[Job, Job], texts: DrawingTexts,
                       drawn_pictures: Callable[..., Drawn], drawn_page: Callable[..., Drawn] | None = None) -> None:
    """Add the routes. The dependencies give what is drawn: `drawn_page` for the report, by default as for pictures."""
    name, errors = kind.name, error_responses(404, 409, 503)
    picture_path = picture_name_path(texts.names, *texts.example)

    @router.get("/{id}/report", name=f"{name}_report", summary=f"Get the report of a {name}",
                response_class=HTMLResponse, response_model=None, responses=errors | HTML_RESPONSE | NOT_MODIFIED,
                description=f"Return the report of a finished {name} as a single HTML page that needs no network "
                            f"access.\n\n{texts.report}")
    @computes
    def get_report(drawn: Annotated[Drawn, Depends(drawn_page or drawn_pictures)], client: RevalidationDependency,
                   drawings: DrawingsDependency) -> HTMLResponse:
        client.require_change(*drawn.version)
        return HTMLResponse(drawings.made("page", drawn.request, name, *drawn.version))

    @router.get("/{id}/pictures", name=f"{name}_pictures", summary=f"List the pictures of a {name}",
                response_model=PictureList, responses=errors,
                description=f"Return the available pictures of a finished {name}, with titles and captions."
                            f"{texts.pictures}")
    @computes
    def list_pictures(drawn: Annotated[Drawn, Depends(drawn_pictures)], drawings: DrawingsDependency) -> PictureList:
        titles = drawings.made("titles", drawn.request, name, *drawn.version)
        return picture_list(titles, f"{drawn.address}/pictures", drawn.query)

    @router.get("/{id}/pictures/{name}", name=f"{name}_picture", summary=f"Get a picture of a {name}",
                response_model=None, responses=errors | PICTURE_RESPONSE | NOT_MODIFIED,
                description="Return a picture as Vega-Lite (JSON), SVG or PNG, as selected by `format` or the Accept "
                            "header.")
    @computes
    def get_picture(drawn: Annotated[Drawn, Depends(drawn_pictures)], picture: Annotated[str, picture_path],
                    request: Request, client: RevalidationDependency, drawings: DrawingsDependency,
                    format: FormatQuery = None) -> Response:
        chosen = form(request, format)
        client.require_change(*drawn.version)
        return picture_response(drawings.made("picture", lambda: {
            **drawn.request(), "name": picture, "form": chosen}, name, *drawn.version, picture, chosen), chosen)
