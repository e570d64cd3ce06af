"""Answers as CSV for other programs: a heading with the unit for each column, and a row for each entry."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal

from fastapi import Query, Request, Response
from pydantic import BaseModel

from slipstick.interface.tables import csv_text

from .pictures import preferred

CSV = "text/csv"
CSV_RESPONSE: dict[int | str, dict[str, Any]] = {200: {"content": {CSV: {"schema": {"type": "string"}}}}}
"""OpenAPI description of a response that can be CSV."""
TableForm = Literal["json", "csv"]
_ACCEPTED: dict[str, TableForm] = {"application/json": "json", CSV: "csv", "*/*": "json"}
TableFormQuery = Annotated[TableForm | None, Query(
    alias="format", description="Form of the answer: `json`, or `csv` with a row for each entry. By default the Accept "
                                "header decides.")]


def wants_csv(request: Request, form: str | None) -> bool:
    """Whether a request asks for CSV."""
    return (form or preferred(request.headers.get("accept", ""), _ACCEPTED)) == "csv"


def csv_response(columns: Mapping[str, Iterable[Any]], name: str, headers: Mapping[str, str] | None = None) -> Response:
    """Return columns of equal length as a CSV file `name`; an entry without value is empty."""
    return Response(csv_text(columns), media_type=CSV, headers={
        "Vary": "Accept", "Content-Disposition": f'attachment; filename="{name}.csv"', **(headers or {})})


def entries_csv(entries: Sequence[BaseModel], model: type[BaseModel], name: str) -> Response:
    """Return the entries of a list as CSV: their fields, except for those that are objects; lists with spaces."""
    rows = [entry.model_dump(mode="json") for entry in entries]
    simple = [field for field in model.model_fields if not any(isinstance(row[field], dict) for row in rows)
              and field not in ("settings", "links", "error")]
    return csv_response({field: [_cell(row[field]) for row in rows] for field in simple}, name)


def _cell(value: Any) -> Any:
    return " ".join(str(element) for element in value) if isinstance(value, list) else value
