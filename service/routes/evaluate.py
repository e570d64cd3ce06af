"""Evaluation of a table: shifting times at given points."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool

from slipstick.errors import InvalidValue
from slipstick.inference.propagation import select_conditions
from slipstick.interface.tables import condition_columns, descriptions
from slipstick.storage.library import Library
from slipstick.table import Outside, Table
from slipstick.table.points import count_outside
from slipstick.table.subject import columns

from .. import npy
from ..bodies import Handler, JsonRoute, compute, parse, require_media_type, validate
from ..csv_form import CSV, TableForm, csv_response, wants_csv
from ..error_responses import error_responses
from ..schemas import (
    AxisUnit,
    AxisUnits,
    ConditionList,
    Description,
    OutsidePolicy,
    StrictModel,
    TableBench,
    TableDigest,
    TableName,
    json_response,
    open_table,
    require_size,
)
from ..settings import Settings

_Points = np.ndarray | list[Any]
_SHORT = 1000
"""Bytes of a body that may hold a single point only."""
_FEW_VALUES = 20_000
"""Values at the corners of a cell between which to interpolate, which takes some 0.01 ms."""


class EvaluateOptions(StrictModel):
    """The table to evaluate, its conditions, and the policy outside the table."""

    table: TableName = "nominal"
    bench: TableBench = None
    conditions: ConditionList = None
    outside: OutsidePolicy = "error"
    describe: bool = Field(default=True, description="Whether JSON contains the conditions in words.")


class EvaluateRequest(EvaluateOptions):
    """Points at which to evaluate a table."""

    points: list[list[float]] = Field(
        min_length=1, description="Points, each with one multiple of the nominal value per axis, in the order of the "
                                  "axes of the table.")


class NpyQuery(StrictModel):
    """Options of a request whose body is a .npy file."""

    model_config = ConfigDict(strict=False)  # query parameters are text

    table: str | None = Field(default=None, description="Name of the table, `nominal` by default. Only for a .npy "
                                                        "body.")
    bench: str | None = Field(default=None, description="Name of the bench of the table, not checked by default. Only "
                                                        "for a .npy body.")
    conditions: list[int] | None = Field(default=None, description="Indices of the conditions, by default all. Only "
                                                                   "for a .npy body.")
    outside: Outside | None = Field(default=None, description="Policy for points outside the table, `error` by "
                                                              "default. Only for a .npy body.")
    format: TableForm | None = Field(default=None, description="Form of the answer: `json`, or `csv` with a row for "
                                                               "each point and condition. By default the Accept header "
                                                               "decides.")


class _EvaluateRoute(JsonRoute):
    """Calls the endpoint itself if there is no query: FastAPI needs as long to find that as an evaluation takes."""

    def resolved(self) -> Handler:
        """The endpoint with its query."""
        handler = super().resolved()

        async def call(request: Request) -> Response:
            return await (handler(request) if request.scope["query_string"] else evaluate(request, NpyQuery()))

        return call


class EvaluateResponse(BaseModel):
    """Shifting times at the points."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    axes: AxisUnits
    outside: OutsidePolicy
    points_outside: int = Field(description="Number of points outside the table, to which `outside` was applied.")
    conditions: list[int] = Field(description="Indices of the conditions, in the order of the columns.")
    described: list[Description] | None = Field(description="The conditions in words; null with `\"describe\": false`.")
    shifting_time: list[list[float | None]] = Field(
        description="Shifting times in s, with one row per point and one column per condition. Null if the engagement "
                    "does not lock, or if the point lies outside the table and `outside` is `nan`.")


router = APIRouter(prefix="/v1/evaluate", tags=["evaluate"], route_class=_EvaluateRoute)
_EXAMPLE = {"table": "nominal", "points": [[1.0, 1.0], [0.9, 1.1]], "conditions": [0, 100, 215]}
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_REQUEST_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {
    "application/json": {"schema": EvaluateRequest.model_json_schema(), "example": _EXAMPLE},
    npy.MEDIA_TYPE: _BINARY,
}}}


@router.post("", summary="Evaluate a table", openapi_extra=_REQUEST_BODY, response_model=EvaluateResponse,
             responses=error_responses(404, 408, 413, 415, 503) | {
                 200: {"content": {npy.MEDIA_TYPE: _BINARY, CSV: {"schema": {"type": "string"}}}}})
async def evaluate(request: Request, query: Annotated[NpyQuery, Query()]) -> Response:
    """Return the shifting times at the given points, by linear interpolation or by the surrogate.

    A point outside the table is rejected with 422, unless `outside` says what its shifting time is.

    Points and shifting times can also be sent as NumPy arrays. With Content-Type application/x-npy, the request body
    is a float64 array of shape (points, axes) written by numpy.save, and the options are query parameters. With Accept
    application/x-npy, the response body is an array of shape (points, conditions) in s, and the headers
    Slipstick-Table-Digest and Slipstick-Points-Outside contain the digest of the table and the number of points
    outside. Such a response may have more values than one in another form: `array_values` instead of `answer_values` of
    the limits in /v1. With `?format=csv` or Accept text/csv, the response has a row for each point and condition.
    """
    # Not by dependencies: for one point, FastAPI takes as long for three of them as the evaluation does.
    media_type, body = require_media_type(request, "application/json", npy.MEDIA_TYPE), await request.body()
    library: Library = request.app.state.library
    if len(body) <= _SHORT:
        options, points = _read(media_type, body, query)
        if (table := _find_quick_table(options, len(points), library)) is not None:
            return _answer(request, query, options, points, table)

    def answer() -> Response:
        options, points = _read(media_type, body, query)
        return _answer(request, query, options, points, open_table(library, options.table, options.bench))

    return await compute(lambda _: run_in_threadpool(answer), request, request.app.state.computations)


def _find_quick_table(options: EvaluateOptions, points: int, library: Library) -> Table | None:
    """The table, if the answer takes less time than the way into a thread, so that it holds up no other request.

    It takes no place among the computations either: to watch whether the client is gone would take as long.
    """
    if points > 1 or options.conditions is not None or options.bench is not None:
        return None
    table = library.table_in_memory(options.table)
    return table if table is not None and len(table.conditions) << len(table.axes) <= _FEW_VALUES else None


def _read(media_type: str, content: bytes, query: NpyQuery) -> tuple[EvaluateOptions, _Points]:
    """The options and the points of a request; those of JSON are unchecked."""
    if media_type == npy.MEDIA_TYPE:
        return EvaluateOptions(**query.model_dump(exclude_none=True, exclude={"format"})), npy.load(content)
    if query.model_fields_set - {"format"}:
        raise InvalidValue("Query parameters cannot be combined with a JSON body", "Move them into the body")
    return _parse(content)


def _answer(request: Request, query: NpyQuery, options: EvaluateOptions, points: _Points, table: Table) -> Response:
    """The response; raises all errors of a request."""
    settings: Settings = request.app.state.settings
    selected, conditions = select_conditions(table, options.conditions)
    as_csv = wants_csv(request, query.format)
    as_npy = not as_csv and query.format is None and npy.MEDIA_TYPE in request.headers.get("accept", "")
    # Counted before each point is checked, which takes longer than the evaluation.
    require_size(len(points) * len(conditions), settings.array_values if as_npy else settings.answer_values,
                 "shifting times", "Send fewer points per request, or select conditions" if as_npy else
                 "Send fewer points per request, select conditions, or request .npy")
    points = points if isinstance(points, np.ndarray) else _check_points(points)
    times = selected.interpolate(points, options.outside)
    outside = count_outside(table.axes, points)
    headers = {"Slipstick-Table-Digest": table.digest, "Slipstick-Points-Outside": str(outside)}
    if as_csv:
        return _csv(points, times, selected, conditions, settings, headers)
    if as_npy:
        return npy.response(times, headers)
    return json_response({"table": options.table, "table_digest": table.digest, "axes": AxisUnit.of(table),
                          "outside": options.outside, "points_outside": outside, "conditions": conditions,
                          "described": _describe_conditions(table, conditions) if options.describe else None,
                          "shifting_time": times}, headers)


def _describe_conditions(table: Table, conditions: list[int]) -> list[str]:
    words = descriptions(table.conditions)
    return [words[number] for number in conditions]


def _csv(points: np.ndarray, times: np.ndarray, table: Table, conditions: list[int], settings: Settings,
         headers: dict[str, str]) -> Response:
    """The shifting times with a row for each point and condition; raises `TooLarge`."""
    count, given = len(conditions), condition_columns(columns(table.conditions))
    width = 3 + len(table.axes) + len(given)
    require_size(times.size * width, settings.answer_values, "values in the response",
                 "Send fewer points per request, select conditions, or request .npy")
    output = table.output
    return csv_response({
        "point": np.repeat(np.arange(len(points)), count).tolist(),
        **{axis.name: np.repeat(column, count).tolist() for axis, column in zip(table.axes, points.T, strict=True)},
        "condition": conditions * len(points), **{name: list(column) * len(points) for name, column in given.items()},
        f"{output.name} [{output.unit}]": ["" if np.isnan(time) else time for time in times.ravel().tolist()],
    }, "evaluation", headers)


def _parse(content: bytes) -> tuple[EvaluateOptions, list[Any]]:
    """The options and the unchecked points of a JSON body."""
    body = parse(content)
    if not isinstance(body, dict) or not isinstance(points := body.get("points"), list):
        return validate(EvaluateRequest, body, "body"), []
    options = {name: value for name, value in body.items() if name != "points"}
    return validate(EvaluateOptions, options, "body"), points


def _check_points(points: list[Any]) -> np.ndarray:
    checked = validate(EvaluateRequest, {"points": points}, "body").points
    columns = len(checked[0])
    ragged = next((row for row, point in enumerate(checked) if len(point) != columns), None)
    if ragged is not None:
        raise InvalidValue(f"Point {ragged} has {len(checked[ragged])} entries, but point 0 has {columns}",
                           "Give each point one entry per axis of the table")
    return np.array(checked)
