"""Error responses as problem details (RFC 9457), each with a cause and a remedy."""

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

from . import request_ids
from .front.page import error_page
from .pictures import preferred
from .request_keys import explain_unknown_key

MEDIA_TYPE = "application/problem+json"
CURL_JSON = "With curl 7.82 or newer, use `--json`; with an older version, add --header 'Content-Type: " \
            "application/json' to `--data`"
"""Remedy for a JSON body with another media type."""
_FORMS = {"text/html": "html", "application/json": "json", MEDIA_TYPE: "json", "*/*": "json"}
"""Form of a problem by the media type of the Accept header."""
_IN_JSON = {**dict.fromkeys(("model_type", "model_attributes_type", "dataclass_type", "dict_type"),
                            "Input should be a JSON object"),
            **dict.fromkeys(("list_type", "tuple_type"), "Input should be a JSON array")}
"""Kind of a validation error -> its message, where that of pydantic names types of Python."""
_MOST_ERRORS = 20
"""Maximum number of validation errors in a response: a large array of wrong type produces one error per element."""


RETRY_SECONDS = 2
"""Value of the header Retry-After."""
_LONGEST_TEXT = 1000
"""Maximum number of characters of a cause or remedy."""


class Conflict(errors.SlipstickError):
    """The request conflicts with the current state of the resource."""


class TooLarge(errors.SlipstickError):
    """The request body, the response or the computation exceeds a limit of the service."""


class TooSlow(errors.SlipstickError):
    """The request body did not arrive in time."""


class MalformedBody(errors.SlipstickError):
    """The request body is not valid JSON."""

    @classmethod
    def from_parser_message(cls, message: str) -> "MalformedBody":
        """Build the error from the message of the JSON parser."""
        return cls(f"The request body is not valid JSON: {message}",
                   "Send JSON encoded in UTF-8; NaN and infinity are not allowed")


class UnsupportedMedia(errors.SlipstickError):
    """The operation does not accept the media type of the request body."""


class Busy(errors.SlipstickError):
    """The service has no room for the request at the moment."""

    def __init__(self, cause: str, remedy: str = f"Send the request again after {RETRY_SECONDS} s") -> None:
        super().__init__(cause, remedy)


class WrongHost(errors.SlipstickError):
    """The header Host has a name that is not one of this service."""


class CrossSite(errors.SlipstickError):
    """A page of another site sent a request that changes or computes something."""


class TokenRequired(errors.SlipstickError):
    """The request has no token, or one that the service does not know."""


class RoleRequired(errors.SlipstickError):
    """The token of the request has a lower role than the request needs."""


class NotLocal(errors.SlipstickError):
    """The operation is available only from the machine of the service."""


class StoreUnavailable(errors.SlipstickError):
    """The job database does not respond, or the folder of the tables cannot be written."""


_STATUS: dict[type[errors.SlipstickError], int] = {
    errors.UnknownName: 404,
    errors.InvalidValue: 422,
    errors.BadBench: 422,
    errors.BadRecording: 422,
    errors.RefusedTable: 422,
    errors.NoFolder: 503,
    errors.LimitExceeded: 413,
    errors.OutsideTable: 422,
    errors.BadTable: 500,
    errors.SlipstickError: 500,
    MalformedBody: 400,
    TooSlow: 408,
    Conflict: 409,
    TooLarge: 413,
    UnsupportedMedia: 415,
    Busy: 503,
    TokenRequired: 401,
    CrossSite: 403,
    RoleRequired: 403,
    NotLocal: 403,
    WrongHost: 421,
    StoreUnavailable: 503,
}
"""HTTP status of each class of errors; a class that is not listed has the status of its base class."""
_TITLES: dict[type[errors.SlipstickError], str] = {
    errors.BadBench: "Invalid bench file",
    errors.BadRecording: "Invalid recordings file",
    errors.OutsideTable: "Point outside the table",
    errors.BadTable: "Invalid table file",
    errors.RefusedTable: "Invalid table file",
    MalformedBody: "Malformed request body",
    TooSlow: "Request timeout",
    TooLarge: "Request too large",
    UnsupportedMedia: "Unsupported media type",
    StoreUnavailable: "Storage unavailable",
    errors.NoFolder: "Storage unavailable",
}
"""Titles of the classes whose name is not suitable as a title."""


class RequestFieldError(BaseModel):
    """A validation error of one field of the request."""

    where: str = Field(description="Path of the field in the request.", examples=["body.inputs.mean.0"])
    what: str = Field(description="What is wrong with the field.", examples=["Input should be a valid number"])


class ProblemDetails(BaseModel):
    """Problem details according to RFC 9457 (application/problem+json)."""

    type: str = Field(description="URN that identifies the kind of problem.",
                      examples=["urn:slipstick:problem:unknown-name"])
    title: str = Field(description="The kind of problem in words.", examples=["Unknown name"])
    status: int = Field(description="HTTP status code.", examples=[404])
    detail: str = Field(description="The cause of this problem.", examples=["There is no table 'nominl'"])
    remedy: str = Field(description="How to correct the request or resolve the problem.",
                        examples=["Did you mean 'nominal'? Known: calibrated, nominal"])
    errors: list[RequestFieldError] = Field(
        default_factory=list, description=f"Validation errors of the request, at most {_MOST_ERRORS}.")
    request_id: str | None = Field(default=None, description="Id of the request, which the log of the service has as "
                                                             "well.")
    errors_left_out: int = Field(default=0, description="Number of further validation errors that are not listed.")


def problem_response(problem: ProblemDetails, headers: dict[str, str] | None = None, form: str = "json") -> Response:
    """Return the problem as a response: problem details, or a page for the `form` "html"."""
    problem = problem.model_copy(update={"request_id": request_ids.current.get()})
    if form == "html":
        cause = ": ".join([problem.detail, *(f"{field.where}: {field.what}" for field in problem.errors[:1])])
        page = error_page(problem.title, cause, problem.remedy, problem.request_id)
        content, media_type = page.encode(errors="backslashreplace"), "text/html"
    else:
        # Escaped ASCII, because a lone surrogate that is quoted from the request cannot be encoded in UTF-8.
        content, media_type = problem.model_dump_json(ensure_ascii=True, exclude_defaults=True).encode(), MEDIA_TYPE
    retry = {"Retry-After": str(RETRY_SECONDS)} if problem.status == 503 else {}
    return Response(content, problem.status, {**retry, **(headers or {})}, media_type=media_type)


def _answer(request: Request, problem: ProblemDetails, headers: dict[str, str] | None = None) -> Response:
    """Return the problem in the form that the Accept header prefers: a page for a browser that opens one."""
    form = preferred(request.headers.get("accept", ""), _FORMS) if request.method in ("GET", "HEAD") else "json"
    return problem_response(problem, {"Vary": "Accept", **(headers or {})}, form)


def problem_from(error: errors.SlipstickError) -> ProblemDetails:
    """Convert an error into problem details."""
    listed = next(base for base in type(error).__mro__ if base in _STATUS)
    name = type(error).__name__
    return ProblemDetails(type=_urn(name), title=_TITLES.get(type(error), _in_words(name)), status=_STATUS[listed],
                          detail=_shorten(error.cause), remedy=_shorten(error.remedy))


def install(app: FastAPI) -> None:
    """Make the application return every error as problem details."""
    app.add_exception_handler(errors.SlipstickError, _on_slipstick_error)
    app.add_exception_handler(RequestValidationError, _on_validation_error)
    app.add_exception_handler(HTTPException, _on_http_exception)
    app.add_exception_handler(SQLAlchemyError, _on_database_error)


def invalid_request(field_errors: list[RequestFieldError], left_out: int) -> ProblemDetails:
    """The problem of a request with invalid fields, of which so many are left out."""
    count = len(field_errors) + left_out
    return ProblemDetails(type=_urn("InvalidRequest"), title="Invalid request", status=422,
                          detail=f"The request has {count} invalid field{'s' * (count != 1)}",
                          remedy="Correct the fields listed under `errors`; /docs describes every field",
                          errors=field_errors, errors_left_out=left_out)


def malformed_request(id: str) -> ProblemDetails:
    """The problem of bytes that are no HTTP request, which gets the id `id`."""
    return ProblemDetails(type=_urn("MalformedRequest"), title="Malformed request", status=400,
                          detail="The connection received bytes that are no valid HTTP/1.1 request",
                          remedy="Send HTTP/1.1 with a request line and headers of at most 64 KiB; for https, place a "
                                 "reverse proxy in front of the service",
                          request_id=id)


def internal_error() -> ProblemDetails:
    """The problem of a request that failed unexpectedly."""
    return ProblemDetails(type=_urn("InternalError"), title="Internal error", status=500,
                          detail="The service failed to process the request",
                          remedy="Try again; if the error persists, report the request and the log of the service")


def _on_slipstick_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, errors.SlipstickError)
    return _answer(request, problem_from(error))


def _on_validation_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    entries = error.errors()
    if entries and entries[0]["type"] == "json_invalid":
        return problem_response(problem_from(MalformedBody.from_parser_message(entries[0]["ctx"]["error"])))
    field_errors = list(_field_errors(request, entries[:_MOST_ERRORS]))
    return _answer(request, invalid_request(field_errors, max(0, len(entries) - _MOST_ERRORS)))


def _field_errors(request: Request, entries: Iterable[dict[str, Any]]) -> Iterable[RequestFieldError]:
    for entry in entries:
        # The invalid value itself is left out: it may be huge, or not representable in JSON.
        what = explain_unknown_key(request, entry) or _IN_JSON.get(entry["type"]) or \
            str(entry["msg"]).removeprefix("Value error, ")
        yield RequestFieldError(where=".".join(str(part) for part in entry["loc"])[:200], what=what[:500])


def _on_http_exception(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    phrase = http.HTTPStatus(error.status_code).phrase
    headers = dict(error.headers or {})
    detail, remedy = str(error.detail), "Compare the request with the documentation at /docs"
    if error.status_code == 404:
        detail, remedy = f"There is no resource at {request.url.path[:200]}", "See /v1 for the resources, or open /docs"
    elif error.status_code == 405:
        detail = f"{request.url.path[:200]} does not support the method {request.method[:20]}"
        headers["Allow"] = ", ".join(sorted(_methods(request)))
        if request.method == "OPTIONS":
            return Response(status_code=204, headers=headers)
        remedy = f"Use one of the supported methods: {headers['Allow']}"
    return _answer(request, ProblemDetails(
        type=_urn(phrase.title().replace(" ", "")), title=phrase.capitalize(), status=error.status_code,
        detail=detail, remedy=remedy), headers)


def _methods(request: Request) -> set[str]:
    """All methods that the path of the request supports; the exception names those of a single route only."""
    methods = {method for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
               if any(route.matches({**request.scope, "method": method})[0] is Match.FULL
                      for route in request.app.routes)}
    return methods | {"OPTIONS"} | ({"HEAD"} if "GET" in methods else set())


def _on_database_error(request: Request, error: Exception) -> Response:
    cause = getattr(error, "orig", error)
    logging.getLogger("uvicorn.error").error("The job database does not respond: %s", cause)
    return problem_response(problem_from(DATABASE_ERROR))


def _shorten(text: str) -> str:
    """A text of at most `_LONGEST_TEXT` characters: a message quotes what the client sent, which may be megabytes."""
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]} ..."


def _urn(name: str) -> str:
    return "urn:slipstick:problem:" + "-".join(_in_words(name).lower().split())


def _in_words(name: str) -> str:
    """A name in CamelCase as words: UnknownName becomes "Unknown name"."""
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name).strip().capitalize()


DATABASE_ERROR = StoreUnavailable("The job database does not respond",
                                   "Try again in a moment; the log of the service has the cause")
