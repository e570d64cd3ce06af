"""The answer to a propagation as a picture or a page instead of numbers."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import Query, Request, Response

from slipstick.interface.propagate import DENSITY_POINTS, Propagation
from slipstick.pictures import propagation
from slipstick.report.made import PROPAGATION

from .csv_form import CSV
from .drawings import Drawings
from .pictures import preferred
from .schemas import require_size

if TYPE_CHECKING:
    from .routes.propagate import PropagateRequest

Form = Literal["json", "csv", "svg", "png", "html"]
_MEDIA_TYPES: dict[Form, str] = {"json": "application/json", "csv": CSV, "svg": "image/svg+xml",
                                 "png": "image/png", "html": "text/html"}
_ACCEPTED: dict[str, Form] = {**{media_type: form for form, media_type in _MEDIA_TYPES.items()},
                              "image/*": "svg", "*/*": "json"}

CONTENT: dict[str, dict[str, Any]] = {
    CSV: {"schema": {"type": "string"}},
    "image/svg+xml": {"schema": {"type": "string"}}, "text/html": {"schema": {"type": "string"}},
    "image/png": {"schema": {"type": "string", "format": "binary"}}}
"""OpenAPI description of the drawn answers."""
FormatQuery = Annotated[Form | None, Query(
    description="Form of the answer: `json` for numbers, `csv` for a row for each condition, `svg` or `png` for a "
                "picture, `html` for a page with a table. "
                f"At most {propagation.MOST} conditions are drawn. By default the Accept header decides.")]


def form(request: Request, format: Form | None) -> Form:
    """The form that a request asks for."""
    return format or preferred(request.headers.get("accept", ""), _ACCEPTED)


def require_drawable(body: "PropagateRequest", conditions: int) -> "PropagateRequest":
    """The request with densities, which do not exist without output noise; raises `TooLarge` for many `conditions`."""
    require_size(conditions, propagation.MOST, "conditions in a picture", "Select conditions, or request JSON")
    points = 0 if body.output_std == 0 else body.density_points or DENSITY_POINTS
    return body.model_copy(update={"density_points": points, "coefficients": False})


def draw_propagation(drawings: Drawings, result: Propagation, form: Form) -> Response:
    """The result as a picture or a page."""
    given = {"kind": "propagation", "answer": {**result.answer, "output": result.output}, "request": result.request,
             "conditions": result.condition_columns, "home": "../", "name": PROPAGATION, "form": form}
    drawing = drawings.made("page" if form == "html" else "picture", lambda: given)
    return Response(drawing, media_type=_MEDIA_TYPES[form], headers={"Vary": "Accept"})
