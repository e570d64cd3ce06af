"""Every refusal is an RFC 9457 problem: what is wrong, and what to do about it."""

import http
import logging
from collections.abc import Iterable
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from pydantic import BaseModel, Field
from sqlalchemy.exc import SQLAlchemyError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from slipstick import errors

MEDIA_TYPE = "application/problem+json"
_LISTED = 20
"""Errors of one body listed at most: a hundred thousand bad numbers are one mistake, not as many."""


class Conflict(errors.SlipstickError):
    """The request contradicts what is already there."""


class TooLarge(errors.SlipstickError):
    """The body, or the answer asked for, is larger than the service allows."""


class TooSlow(errors.SlipstickError):
    """The body did not arrive in time."""


class MalformedBody(errors.SlipstickError):
    """The body is not JSON."""

    @classmethod
    def saying(cls, reason: str) -> "MalformedBody":
        """Build the error from what the parser says."""
        return cls(f"The body is not JSON: {reason}", "Send valid JSON in UTF-8; it has neither NaN nor infinities")


class UnsupportedMedia(errors.SlipstickError):
    """The body is of a type that the operation does not read."""


class StoreUnavailable(errors.SlipstickError):
    """The database of the jobs does not answer, or the folder of the tables is not there."""


_STATUS: dict[type[errors.SlipstickError], int] = {
    errors.UnknownName: 404,
    errors.InvalidValue: 422,
    errors.BadRecording: 422,
    errors.OutsideTable: 422,
    errors.BadTable: 500,
    errors.SlipstickError: 500,
    MalformedBody: 400,
    TooSlow: 408,
    Conflict: 409,
    TooLarge: 413,
    UnsupportedMedia: 415,
    StoreUnavailable: 503,
}


class Fault(BaseModel):
    """One thing wrong with a request."""

    where: str = Field(description="Place in the request.", examples=["body.inputs.mean.0"])
    what: str = Field(description="What is wrong there.", examples=["Input should be a valid number"])


class Problem(BaseModel):
    """A refusal after RFC 9457 (application/problem+json)."""

    type: str = Field(description="Name of the kind of problem, fit for a program.",
                      examples=["urn:slipstick:problem:unknown-name"])
    title: str = Field(description="The kind of problem in words.", examples=["Unknown name"])
    status: int = Field(description="HTTP status.", examples=[404])
    detail: str = Field(description="What is wrong with this request.", examples=["There is no table 'nominl'"])
    remedy: str = Field(description="What to do about it.",
                        examples=["Did you mean 'nominal'? Known: calibrated, nominal"])
    errors: list[Fault] = Field(default_factory=list, description=f"Up to {_LISTED} faults of the body, each placed.")
    errors_left_out: int = Field(default=0, description="Faults found beyond those listed.")


def answer(problem: Problem, headers: dict[str, str] | None = None) -> Response:
    """Return the problem as a response."""
    # Plain ASCII with escapes: a lone surrogate echoed from the request must not break the answer.
    text = problem.model_dump_json(ensure_ascii=True, exclude_defaults=True)
    return Response(text, problem.status, headers, media_type=MEDIA_TYPE)


def describe(error: errors.SlipstickError) -> Problem:
    """Turn an error into its problem by the one table that ties errors to statuses."""
    kind = next(kind for kind in type(error).__mro__ if kind in _STATUS)
    return Problem(type=_urn(type(error).__name__), title=_words(type(error).__name__), status=_STATUS[kind],
                   detail=error.cause, remedy=error.remedy)


def responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Document the problems that an operation can answer with; 422 and 500 are always among them."""
    return {status: {
        "description": f"{http.HTTPStatus(status).phrase}: what is wrong, and what to do about it",
        "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"},
                                 "example": _EXAMPLES[status].model_dump(exclude_defaults=True)}},
    } for status in sorted({*statuses, 422, 500})}


def install(app: FastAPI) -> None:
    """Make every refusal of the application a problem."""
    app.add_exception_handler(errors.SlipstickError, _on_error)
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(HTTPException, _on_http)
    app.add_exception_handler(SQLAlchemyError, _on_store)
    app.add_exception_handler(Exception, _on_surprise)


def _invalid(faults: list[Fault], left_out: int) -> Problem:
    count = len(faults) + left_out
    return Problem(type=_urn("InvalidRequest"), title="Invalid request", status=422,
                   detail=f"{count} value{'s' * (count != 1)} of the request cannot be used",
                   remedy="Correct what is listed under errors; /docs describes every field",
                   errors=faults, errors_left_out=left_out)


def _internal() -> Problem:
    return Problem(type=_urn("InternalError"), title="Internal error", status=500,
                   detail="The service failed on this request",
                   remedy="Try again; if it stays, report the request and the log of the service")


def _on_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, errors.SlipstickError)
    return answer(describe(error))


def _on_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    found = error.errors()
    if found and found[0]["type"] == "json_invalid":
        return answer(describe(MalformedBody.saying(found[0]["ctx"]["error"])))
    return answer(_invalid(list(_faults(found[:_LISTED])), max(0, len(found) - _LISTED)))


def _faults(found: Iterable[dict[str, Any]]) -> Iterable[Fault]:
    for one in found:
        # The value itself is never echoed: it may be huge, or not fit into JSON.
        yield Fault(where=".".join(str(part) for part in one["loc"])[:200], what=str(one["msg"])[:500])


def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    phrase = http.HTTPStatus(error.status_code).phrase
    headers = dict(error.headers or {})
    detail, remedy = str(error.detail), "Check the request against /docs"
    if error.status_code == 404:
        detail, remedy = f"There is nothing at {request.url.path[:200]}", "Start at /v1 or open /docs in a browser"
    elif error.status_code == 405:
        detail = f"{request.url.path[:200]} does not answer to {request.method[:20]}"
        headers["Allow"] = ", ".join(sorted(_methods(request)))
        remedy = f"Use {headers['Allow']}"
    return answer(Problem(type=_urn(phrase.title().replace(" ", "")), title=phrase.capitalize(),
                          status=error.status_code, detail=detail, remedy=remedy), headers)


def _methods(request: Request) -> set[str]:
    """All methods that the path of the request answers to; the router itself names those of one route only."""
    return {method for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
            if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in request.app.routes)}


def _on_store(request: Request, error: Exception) -> Response:
    said = getattr(error, "orig", error)
    logging.getLogger("uvicorn.error").error("The database of the jobs does not answer: %s", said)
    return answer(describe(_STORE))


def _on_surprise(request: Request, error: Exception) -> Response:
    return answer(_internal())


def _urn(name: str) -> str:
    return "urn:slipstick:problem:" + "-".join(_words(name).lower().split())


def _words(name: str) -> str:
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name).strip().capitalize()


_STORE = StoreUnavailable("The database of the jobs does not answer",
                          "Try again in a moment; the log of the service says more")
_EXAMPLES: dict[int, Problem] = {
    problem.status: problem for problem in (
        describe(errors.UnknownName.of("table", "nominl", ["calibrated", "nominal"])),
        describe(TooSlow("The body did not arrive within 30 s", "Check its Content-Length, or send it again")),
        describe(Conflict("There is already another file named 'measured'", "Choose another name")),
        describe(TooLarge("The request asks for 21,600,000 shifting times, the service allows 2,000,000",
                          "Send fewer points at a time, or choose conditions")),
        describe(UnsupportedMedia("The body is of type application/x-www-form-urlencoded",
                                  "With curl, send JSON by `--json` instead of `-d`, which claims a form")),
        describe(_STORE),
        _invalid([Fault(where="body.inputs.mean.0", what="Input should be a valid number")], 0),
        _internal(),
    )
}
