"""Request bodies: limited in size and time before they reach a route, and parsed there as strict JSON."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import Any, TypeVar

import orjson
from fastapi import Depends, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipstick.errors import InvalidValue, SlipstickError

from . import problem_details
from .computations import Client, Computations
from .query import QueryNames
from .revalidation import headers_of
from .settings import Settings

Handler = Callable[[Request], Coroutine[Any, Any, Response]]
_Body = TypeVar("_Body", bound=BaseModel)
READING = "reading"
_ONCE = ("Content-Type", "Idempotency-Key")
"""Headers that are not repeated: the limit would be that of one Content-Type, and the body read as another one."""


class BodyLimits:
    """ASGI middleware that reads the complete request body, and rejects it as soon as it exceeds a limit.

    A body has at most `body_bytes`, one of JSON `json_bytes`, and all bodies in memory together `bodies_bytes`. It has
    to arrive within `body_seconds`.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app, self.settings, self.seconds = app, settings, settings.body_seconds
        self.held = 0  # bytes of all bodies in memory

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request once its body is complete."""
        if scope["type"] != "http" or scope["method"] in ("GET", "HEAD", "OPTIONS"):
            return await self.app(scope, receive, send)
        body = bytearray()
        try:
            await self._forward(scope, receive, send, body)
        finally:
            self.held -= len(body)

    async def _forward(self, scope: Scope, receive: Receive, send: Send, body: bytearray) -> None:
        try:
            async with asyncio.timeout(self.seconds):
                await self._read(scope, receive, body)
        except TimeoutError:
            return await _reject(scope, receive, send, problem_details.TooSlow(
                f"The request body did not arrive within {self.seconds:g} s",
                "Check the Content-Length header, or increase SLIPSTICK_BODY_SECONDS on the server"))
        except SlipstickError as error:
            return await _reject(scope, receive, send, error)
        buffered: list[Message] = [{"type": "http.request", "body": bytes(body), "more_body": False}]

        async def replay() -> Message:
            return buffered.pop() if buffered else await receive()

        return await self.app(scope, replay, send)

    async def _read(self, scope: Scope, receive: Receive, body: bytearray) -> None:
        headers = dict(scope["headers"])
        for name in _ONCE:
            if (count := sum(header == name.lower().encode() for header, _ in scope["headers"])) > 1:
                raise InvalidValue(f"The header {name} is given {count} times", "Give it once")
        is_json = headers.get(b"content-type", b"").partition(b";")[0].strip().lower() == b"application/json"
        most, setting = (self.settings.json_bytes, "JSON") if is_json else (self.settings.body_bytes, "BODY")
        hint = "Send arrays as .npy or in several requests" if is_json else "Send a smaller body"
        kind = "JSON" if is_json else "request"
        too_large = problem_details.TooLarge(f"The {kind} body is larger than {most:,} bytes",
                                             f"{hint}, or increase SLIPSTICK_{setting}_BYTES on the server")
        content_length = headers.get(b"content-length", b"")
        if content_length.isdigit() and int(content_length) > most:
            raise too_large
        more = True
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                raise problem_details.TooSlow("The connection closed before the complete request body was received",
                                              "Send the request again")
            part = message.get("body", b"")
            if len(body) + len(part) > most:
                raise too_large
            if self.held + len(part) > self.settings.bodies_bytes:
                raise problem_details.Busy("The bodies of other requests take all memory reserved for bodies")
            body += part
            self.held += len(part)
            more = message.get("more_body", False)


async def _reject(scope: Scope, receive: Receive, send: Send, error: SlipstickError) -> None:
    # The rest of the body stays unread, so the connection cannot be reused.
    response = problem_details.problem_response(problem_details.problem_from(error), {"Connection": "close"})
    await response(scope, receive, send)


class _StrictRequest(Request):
    async def json(self) -> Any:
        # The standard parser accepts NaN, 1e999 and lone surrogates, which no JSON response can contain.
        return orjson.loads(await self.body())


class JsonRoute(APIRoute):
    """A route that refuses unknown query parameters, and requires strict JSON of this Content-Type if it takes JSON.

    If its endpoint `computes` or `reads_upload`, a request waits for a place among the computations or uploads of the
    application, unless its client closes the connection. Other endpoints that run in a thread wait for their turn to
    read, except those marked `at_once`.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        # Clients generated from the OpenAPI document name their functions by this id.
        super().__init__(path, endpoint, **{**options, "operation_id": options.get("name") or endpoint.__name__})

    def resolved(self) -> Handler:
        """The endpoint with its parameters, as FastAPI resolves them."""
        return super().get_route_handler()

    def get_route_handler(self) -> Handler:
        """Wrap the handler that FastAPI builds."""
        handler, query = self.resolved(), QueryNames(self.dependant)
        places = getattr(self.endpoint, "places", None if iscoroutinefunction(self.endpoint) else READING)

        async def strict(request: Request) -> Response:
            if request.scope["query_string"]:
                query.require(request)
            if self.body_field is not None:
                require_media_type(request, "application/json")
            strict_request = _StrictRequest(request.scope, request.receive)
            if places is None:
                response = await handler(strict_request)
            elif places == READING:
                async with request.app.state.reading:
                    response = await handler(strict_request)
            else:
                await strict_request.body()
                response = await compute(handler, strict_request, getattr(request.app.state, places))
            response.headers.update(headers_of(request))
            return response

        return strict


async def compute(handler: Handler, request: Request, computations: Computations) -> Response:
    """Handle the request, whose body was read, at a place among these `computations`.

    `request.state.client` learns if the client is gone.
    """
    client = request.state.client = Client(threading.Event())
    computing, task = False, asyncio.current_task()
    assert task is not None

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        client.gone.set()
        if not computing:
            task.cancel()

    watcher = asyncio.create_task(watch())
    try:
        async with computations.place():
            computing = True
            return await handler(request)
    except asyncio.CancelledError:
        if client.gone.is_set():  # cancelled by `watch`; otherwise by the server, which stops
            task.uncancel()
            client.require()
        raise
    finally:
        watcher.cancel()


def require_media_type(request: Request, *accepted: str) -> str:
    """Return the media type of the request body; raises `UnsupportedMedia` if it is none of `accepted`."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type not in accepted:
        cause = f"The media type of the request body is {media_type[:100]}" if media_type else \
            "The request has no Content-Type header"
        hint = problem_details.CURL_JSON if "application/json" in accepted else \
            "With curl, add --header 'Content-Type: ...'"
        raise problem_details.UnsupportedMedia(cause, f"Send {' or '.join(accepted)}. {hint}")
    return media_type


def parse(content: bytes) -> object:
    """Return the value of strict JSON; raises `MalformedBody`."""
    try:
        return orjson.loads(content)
    except orjson.JSONDecodeError as error:
        raise problem_details.MalformedBody.from_parser_message(error.msg) from error


def validate(model: type[_Body], body: object, *place: str) -> _Body:
    """Return a body that an endpoint has read itself; raises `RequestValidationError` for fields of this `place`."""
    try:
        return model.model_validate(body)
    except ValidationError as error:
        entries = error.errors(include_url=False, include_input=False)
        raise RequestValidationError([{**entry, "loc": (*place, *entry["loc"])} for entry in entries]) from error


def upload_of(media_type: str) -> Any:
    """Dependency: a request body of this media type, as bytes."""
    async def read(request: Request) -> bytes:
        require_media_type(request, media_type)
        return await request.body()

    return Depends(read)
