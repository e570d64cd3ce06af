"""Request bodies: limited in size and time before they reach a route, and parsed there as strict JSON."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import orjson
from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import problem_details
from service.query import QueryNames
from slipstick.errors import SlipstickError


class BodyLimits:
    """ASGI middleware that reads the complete request body of at most `size` bytes within `seconds` s.

    A body over either limit is rejected with an error response.
    """

    def __init__(self, app: ASGIApp, size: int, seconds: float) -> None:
        self.app, self.size, self.seconds = app, size, seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request once its body is complete."""
        if scope["type"] != "http" or scope["method"] in ("GET", "HEAD", "OPTIONS"):
            return await self.app(scope, receive, send)
        try:
            body = await asyncio.wait_for(self._read(scope, receive), self.seconds)
        except TimeoutError:
            return await _reject(scope, receive, send, problem_details.TooSlow(
                f"The request body did not arrive within {self.seconds:g} s",
                "Check the Content-Length header, or increase SLIPSTICK_BODY_SECONDS on the server"))
        except SlipstickError as error:
            return await _reject(scope, receive, send, error)
        buffered: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

        async def replay() -> Message:
            return buffered.pop() if buffered else await receive()

        return await self.app(scope, replay, send)

    async def _read(self, scope: Scope, receive: Receive) -> bytes:
        too_large = problem_details.TooLarge(f"The request body is larger than {self.size:,} bytes",
                                             "Send a smaller body, or increase SLIPSTICK_BODY_BYTES on the server")
        content_length = dict(scope["headers"]).get(b"content-length", b"")
        if content_length.isdigit() and int(content_length) > self.size:
            raise too_large
        body, more = bytearray(), True
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                raise problem_details.TooSlow("The connection closed before the complete request body was received",
                                              "Send the request again")
            body += message.get("body", b"")
            if len(body) > self.size:
                raise too_large
            more = message.get("more_body", False)
        return bytes(body)


async def _reject(scope: Scope, receive: Receive, send: Send, error: SlipstickError) -> None:
    # The rest of the body stays unread, so the connection cannot be reused.
    response = problem_details.problem_response(problem_details.problem_from(error), {"Connection": "close"})
    await response(scope, receive, send)


class _StrictRequest(Request):
    async def json(self) -> Any:
        # The standard parser accepts NaN, 1e999 and lone surrogates, which no JSON response can contain.
        return orjson.loads(await self.body())


class JsonRoute(APIRoute):
    """A route that refuses unknown query parameters, and requires strict JSON of this Content-Type if it takes JSON."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Wrap the handler that FastAPI builds."""
        handler, query = super().get_route_handler(), QueryNames(self.dependant)

        async def strict(request: Request) -> Response:
            query.require(request)
            if self.body_field is not None:
                require_media_type(request, "application/json")
            return await handler(_StrictRequest(request.scope, request.receive))

        return strict


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
