"""Request bodies: bounded in size and time before they reach a route, and read as strict JSON there."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import orjson
from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import problem_details
from slipstick.errors import SlipstickError


class BodyLimits:
    """ASGI middleware that takes in a whole body, at most `size` bytes within `seconds` s, or refuses it."""

    def __init__(self, app: ASGIApp, size: int, seconds: float) -> None:
        self.app, self.size, self.seconds = app, size, seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on once its body is here."""
        if scope["type"] != "http" or scope["method"] in ("GET", "HEAD", "OPTIONS"):
            return await self.app(scope, receive, send)
        try:
            body = await asyncio.wait_for(self._read(scope, receive), self.seconds)
        except TimeoutError:
            return await _refuse(scope, receive, send, problem_details.TooSlow(
                f"The body did not arrive within {self.seconds:g} s",
                "Check its Content-Length, or raise SLIPSTICK_BODY_SECONDS"))
        except SlipstickError as error:
            return await _refuse(scope, receive, send, error)
        first: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

        async def replay() -> Message:
            return first.pop() if first else await receive()

        return await self.app(scope, replay, send)

    async def _read(self, scope: Scope, receive: Receive) -> bytes:
        too_large = problem_details.TooLarge(f"The body is larger than {self.size:,} bytes",
                                      "Send it in parts, or raise SLIPSTICK_BODY_BYTES")
        declared = dict(scope["headers"]).get(b"content-length", b"")
        if declared.isdigit() and int(declared) > self.size:
            raise too_large
        body, more = bytearray(), True
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                raise problem_details.TooSlow("The connection closed before the whole body was here", "Send it again")
            body += message.get("body", b"")
            if len(body) > self.size:
                raise too_large
            more = message.get("more_body", False)
        return bytes(body)


async def _refuse(scope: Scope, receive: Receive, send: Send, error: SlipstickError) -> None:
    # What is left of the body stays unread, so the connection cannot be used again.
    await problem_details.answer(problem_details.describe(error), {"Connection": "close"})(scope, receive, send)


class _StrictRequest(Request):
    async def json(self) -> Any:
        # The standard parser takes NaN, 1e999 and lone surrogates, which no answer could echo; this one does not.
        return orjson.loads(await self.body())


class JsonRoute(APIRoute):
    """A route whose body, where it has one, must say that it is JSON and be strictly so."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Wrap the handler that FastAPI makes."""
        handler = super().get_route_handler()

        async def strict(request: Request) -> Response:
            if self.body_field is not None:
                require_media(request, "application/json")
            return await handler(_StrictRequest(request.scope, request.receive))

        return strict


def require_media(request: Request, *accepted: str) -> str:
    """Return the media type of the body; raises `UnsupportedMedia` where it is none of `accepted`."""
    media = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media not in accepted:
        said = f"is of type {media[:100]}" if media else "has no Content-Type"
        hint = "With curl, send JSON by `--json` instead of `-d`, which claims a form" \
            if "application/json" in accepted else "With curl, add -H 'Content-Type: ...'"
        raise problem_details.UnsupportedMedia(f"The body {said}", f"Send {' or '.join(accepted)}. {hint}")
    return media
