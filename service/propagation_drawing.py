"""The answer to a propagation as a picture or a page instead of numbers."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

import orjson
from fastapi import Query, Request, Response

from slipstick.pictures import propagation
from slipstick.report.made import PROPAGATION
from slipstick.table import Table
from slipstick.table.subject import columns

from .csv_form import CSV, condition_columns, csv_response
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
_POINTS = 161  # of a density, if the request asks for none

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


def drawable(body: "PropagateRequest", conditions: int) -> "PropagateRequest":
    """The request with densities, which do not exist without output noise; raises `TooLarge` for many `conditions`."""
    require_size(conditions, propagation.MOST, "conditions in a picture", "Select conditions, or request JSON")
    points = 0 if body.output_std == 0 else body.density_points or _POINTS
    return body.model_copy(update={"density_points": points, "coefficients": False})


def tabulated(answer: Response, request: dict[str, Any], table: Table) -> Response:
    """The JSON `answer` as CSV with a row for each condition, without densities and coefficients."""
    content = orjson.loads(answer.body)
    rows, unit = content["conditions"], table.output.unit
    found: dict[str, list[Any]] = {"condition": [row["condition"] for row in rows],
                                   **condition_columns(columns(table.conditions))}  # type: ignore[dict-item]
    found |= {f"{name} [{unit}]": [row[name] for row in rows] for name in ("mean", "std", "error")}
    found |= {f"quantile {probability:g} [{unit}]": [row["quantiles"][place] for row in rows]
              for place, probability in enumerate(request["quantiles"])}
    found |= {f"{name} of {axis['name']}": [row[name] and row[name][place] for row in rows]
              for name in ("first_order", "total") for place, axis in enumerate(content["axes"])}
    return csv_response({**found, "reason": [row["reason"] for row in rows]}, "propagation")


def drawn(drawings: Drawings, answer: Response, request: dict[str, Any], table: Table, form: Form) -> Response:
    """The JSON `answer` to a `request` for a `table` as a picture or a page."""
    content = {**orjson.loads(answer.body), "output": {"name": table.output.name, "unit": table.output.unit}}
    given = {"kind": "propagation", "answer": content, "request": request, "conditions": columns(table.conditions),
             "name": PROPAGATION, "form": form}
    made = drawings.made("page" if form == "html" else "picture", lambda: given)
    return Response(made, media_type=_MEDIA_TYPES[form], headers={"Vary": "Accept"})
