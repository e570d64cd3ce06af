"""Errors of the UM-Bridge routes in the form of the protocol, and whom these routes answer.

The routes raise the same errors as all others, which become problem details. A middleware converts those under the
prefix, so that errors of the layers around the routes, such as a body that is too large, have the form as well.
"""

import ipaddress
from typing import Any

import orjson
from fastapi import Request
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..problem_details import MEDIA_TYPE, NotLocal

PREFIX = "/umbridge"
_TYPES = {"unknown-name": ("ModelNotFound", 400), "undefined-output": ("InvalidOutput", 500)}
_INVALID = (400, 415, 422)  # statuses of problems that the protocol calls InvalidInput, always with status 400


class ErrorContent(BaseModel):
    """The error of a request."""

    type: str = Field(description="`ModelNotFound`, `InvalidInput`, `InvalidOutput` (the model has no value at this "
                                  "point), or the kind of another problem, such as `Busy`.", examples=["InvalidInput"])
    message: str = Field(description="The cause, and how to correct the request.")


class BridgeError(BaseModel):
    """An error in the form of UM-Bridge."""

    error: ErrorContent = Field(description="The error of the request.")


def error_responses() -> dict[int | str, dict[str, Any]]:
    """OpenAPI descriptions of the error responses of every UM-Bridge operation."""
    described = {400: "There is no such model (`ModelNotFound`), or the request is invalid (`InvalidInput`)",
                 403: "The request comes from another machine",
                 413: "The request body or the computation would exceed a limit of the service",
                 500: "The model has no value at this point (`InvalidOutput`), or the service failed",
                 503: "The service is busy; the header Retry-After states when to try again"}
    return {status: {"description": text, "model": BridgeError} for status, text in described.items()}


async def require_loopback(request: Request) -> None:
    """Raise `NotLocal` unless the client is on this machine: UM-Bridge has no way to send a token.

    This is the only check of who may use these routes: paths under `PREFIX` need no token (`required_role`).
    """
    host = request.client.host if request.client else ""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        address = ipaddress.ip_address("0.0.0.0")
    mapped = getattr(address, "ipv4_mapped", None)  # an IPv4 client of an IPv6 socket
    if not (mapped or address).is_loopback:
        raise NotLocal("UM-Bridge requests carry no token, and are answered only from the machine of the service",
                       "Run the client on that machine, or forward a port of yours to it, as ssh -L does")


class BridgeErrors:
    """ASGI middleware that converts problem details under `PREFIX` to errors in the form of UM-Bridge."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request."""
        concerned = scope["type"] == "http" and f"{scope['path']}/".startswith(f"{PREFIX}/")
        if not concerned or scope["method"] == "HEAD":
            return await self.app(scope, receive, send)
        # Problem details are read here, and on this machine compression saves nothing.
        scope = {**scope, "headers": [header for header in scope["headers"] if header[0] != b"accept-encoding"]}
        started: Message | None = None

        async def send_converted(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start" and _is_problem(message):
                started = message  # problem details come in one piece
            elif started is not None and message["type"] == "http.response.body" and message.get("body"):
                await _convert_problem(started, message["body"])(scope, receive, send)
            elif started is None:
                await send(message)

        await self.app(scope, receive, send_converted)


def _is_problem(message: Message) -> bool:
    headers: dict[bytes, bytes] = dict(message["headers"])
    return headers.get(b"content-type", b"").startswith(MEDIA_TYPE.encode())


def _convert_problem(started: Message, body: bytes) -> JSONResponse:
    problem = orjson.loads(body)
    kind = problem["type"].rpartition(":")[2]
    invalid = ("InvalidInput", 400) if problem["status"] in _INVALID else (
        kind.title().replace("-", ""), problem["status"])
    name, status = _TYPES.get(kind, invalid)
    # The remedy of invalid fields refers to the member `errors`, which the protocol does not have.
    fields = "; ".join(f"{entry['where'] or 'body'}: {entry['what']}" for entry in problem.get("errors", ()))
    remedy = f"Correct {fields}" if fields else problem["remedy"]
    message = f"{problem['detail']}. {remedy}."
    kept = {name.decode(): value.decode() for name, value in started["headers"]
            if name.lower() not in (b"content-type", b"content-length")}
    return JSONResponse({"error": {"type": name, "message": message}}, status, kept)
