"""Shifting times at points of the table."""

from typing import Annotated, Any

import numpy as np
import orjson
from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field, ValidationError

from service import npy
from service.bodies import JsonRoute, require_media
from service.problem_details import MalformedBody, responses
from service.schemas import (
    ConditionList,
    OutsidePolicy,
    Strict,
    TableDigest,
    TableName,
    TheLibrary,
    TheSettings,
    chosen,
    numbers,
    require_size,
)
from slipstick.errors import InvalidValue
from slipstick.table import Outside
from slipstick.uncertainty import count_outside

router = APIRouter(prefix="/v1/evaluate", tags=["evaluate"], route_class=JsonRoute)


class Choice(Strict):
    """What is asked of a table, besides the points."""

    table: TableName = "nominal"
    conditions: ConditionList = None
    outside: OutsidePolicy = "clip"


class EvaluateRequest(Choice):
    """Points of a table."""

    points: list[list[float]] = Field(
        min_length=1, description="Points, each one multiplier of the nominal value an axis, in the order of the axes.")


class NpyQuery(Strict):
    """The choice, where the body is .npy and has no room for it."""

    table: str | None = Field(default=None, description="Only with a .npy body: name of the table, else `nominal`.")
    conditions: list[int] | None = Field(default=None, description="Only with a .npy body: conditions, else all.")
    outside: Outside | None = Field(default=None, description="Only with a .npy body: policy outside, else `clip`.")


class EvaluateAnswer(BaseModel):
    """Shifting times."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    outside: OutsidePolicy
    points_outside: int = Field(description="How many of the points lie outside the table, where `outside` applied.")
    conditions: list[int] = Field(description="Numbers of the conditions, in the order of the columns.")
    shifting_time: list[list[float | None]] = Field(
        description="Shifting times in s, one row a point and one column a condition. Null where the engagement does "
                    "not lock, or where `outside` is `nan` and the point lies outside.")


_EXAMPLE = {"table": "nominal", "points": [[1.0, 1.0], [0.9, 1.1]], "conditions": [0, 100, 215], "outside": "clip"}
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {
    "application/json": {"schema": EvaluateRequest.model_json_schema(), "example": _EXAMPLE},
    npy.MEDIA_TYPE: _BINARY,
}}}


async def _body(request: Request) -> tuple[str, bytes]:
    return require_media(request, "application/json", npy.MEDIA_TYPE), await request.body()


@router.post("", summary="Shifting times at points", openapi_extra=_BODY, response_model=EvaluateAnswer,
             responses=responses(404, 408, 413, 415) | {200: {"content": {npy.MEDIA_TYPE: _BINARY}}})
def evaluate(request: Request, body: Annotated[tuple[str, bytes], Depends(_body)],
             query: Annotated[NpyQuery, Query()], library: TheLibrary, settings: TheSettings) -> Response:
    """Interpolate the table linearly at the points.

    With Content-Type application/x-npy the body is a float64 array (points, axes) as numpy.save writes it, and
    table, conditions and outside go into the query. With Accept: application/x-npy the answer is an array
    (points, conditions) in s, and its digest and points outside stand in the headers Slipstick-Table-Digest and
    Slipstick-Points-Outside.
    """
    media, content = body
    asked: Choice
    if media == npy.MEDIA_TYPE:
        asked, points = Choice(**query.model_dump(exclude_none=True)), npy.load(content)
    elif query.model_fields_set:
        raise InvalidValue("Beside a JSON body the query says nothing", "Put its choices into the body")
    else:
        asked, points = _parse(content)
    whole = library.table(asked.table)
    table, conditions = chosen(whole, asked.conditions)
    require_size(len(points) * len(conditions), settings.answer_values, "shifting times",
                 "Send fewer points at a time, or choose conditions")
    times = table.interpolate(points, asked.outside)
    outside = count_outside(points, table.lower, table.upper)
    headers = {"Slipstick-Table-Digest": whole.digest, "Slipstick-Points-Outside": str(outside)}
    if npy.MEDIA_TYPE in request.headers.get("accept", ""):
        return Response(npy.dump(times), headers=headers, media_type=npy.MEDIA_TYPE)
    return numbers({"table": asked.table, "table_digest": whole.digest, "outside": asked.outside,
                    "points_outside": outside, "conditions": conditions, "shifting_time": times}, headers)


def _parse(content: bytes) -> tuple[EvaluateRequest, np.ndarray]:
    try:
        asked = EvaluateRequest.model_validate(orjson.loads(content))
    except orjson.JSONDecodeError as error:
        raise MalformedBody.saying(error.msg) from error
    except ValidationError as error:
        faults = error.errors(include_url=False, include_input=False)
        raise RequestValidationError([{**fault, "loc": ("body", *fault["loc"])} for fault in faults]) from error
    columns = len(asked.points[0])
    ragged = next((row for row, point in enumerate(asked.points) if len(point) != columns), None)
    if ragged is not None:
        raise InvalidValue(f"Point {ragged} has {len(asked.points[ragged])} multipliers, point 0 has {columns}",
                           "Give every point one multiplier an axis")
    return asked, np.array(asked.points)
