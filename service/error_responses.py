"""OpenAPI descriptions of the error responses of an operation, with an example of each status."""

from typing import Any

from slipstick import errors

from .problem_details import (
    CURL_JSON,
    DATABASE_ERROR,
    MEDIA_TYPE,
    Conflict,
    MalformedBody,
    ProblemDetails,
    RequestFieldError,
    RoleRequired,
    TokenRequired,
    TooLarge,
    TooSlow,
    UnsupportedMedia,
    internal_error,
    invalid_request,
    problem_from,
)

_DESCRIPTIONS = {
    400: "The request body is not valid JSON",
    401: "The request has no token, or an unknown one; only if the service requires tokens",
    403: "The token does not have the role that the operation needs, or a page of another site sent the request",
    404: "No resource of this name exists",
    408: "The request body did not arrive in time",
    409: "The request conflicts with the current state of the resource",
    413: "The request body, the response or the computation would exceed a limit of the service",
    415: "The operation does not accept the media type of the request body",
    422: "A parameter or a field of the request body is invalid",
    500: "A table file is invalid, or the service failed to process the request",
    503: "The job database or the folder of the tables is not there, or the service is busy; the header Retry-After "
         "states when to try again",
}
_EXAMPLES: dict[int, ProblemDetails] = {
    problem.status: problem for problem in (
        problem_from(MalformedBody.from_parser_message("unexpected end of data")),
        problem_from(TokenRequired("The request has no token", "Send the header 'Authorization: Bearer TOKEN'; in a "
                                                               "browser, enter the token as the password")),
        problem_from(RoleRequired("The request needs the role admin; the token 'alice' has the role run",
                                  "Ask the administrator of the service for a token with this role")),
        problem_from(errors.UnknownName.of("table", "nominl", ["calibrated", "nominal"])),
        problem_from(TooSlow("The request body did not arrive within 30 s",
                             "Check the Content-Length header, or increase SLIPSTICK_BODY_SECONDS on the server")),
        problem_from(Conflict("A different file named 'measured' already exists", "Choose another name")),
        problem_from(TooLarge("The request requires 21,600,000 shifting times; the limit is 2,000,000",
                              "Send fewer points per request, select conditions, or request .npy")),
        problem_from(UnsupportedMedia("The media type of the request body is application/x-www-form-urlencoded",
                                      f"Send application/json. {CURL_JSON}")),
        problem_from(DATABASE_ERROR),
        invalid_request([RequestFieldError(where="body.inputs.mean.0", what="Input should be a valid number")], 0),
        internal_error(),
    )
}


def error_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """OpenAPI descriptions of the error responses of an operation; 422 and 500 are always included.

    An operation with a body, which states 415, can have a malformed one as well (400).
    """
    malformed = {400} if 415 in statuses else set()
    return {status: error_response(status) for status in sorted({*statuses, *malformed, 422, 500})}


def error_response(status: int) -> dict[str, Any]:
    """OpenAPI description of the responses with this status."""
    return {"description": _DESCRIPTIONS[status],
            "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/ProblemDetails"},
                                     "example": _EXAMPLES[status].model_dump(exclude_defaults=True)}}}
