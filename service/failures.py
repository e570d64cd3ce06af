"""The outermost layer of the service: what no handler expects becomes a complete response, and HEAD is answered."""

import logging

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from . import problem_details

_LOG = logging.getLogger("uvicorn.error")


class UnexpectedErrors:
    """ASGI middleware that logs an unexpected error and answers it with status 500, on a connection that stays usable.

    Starlette's own handler raises the error again after the response, and the server then resets the connection.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request."""
        started = False

        async def send_watched(message: Message) -> None:
            nonlocal started
            started = started or message["type"] == "http.response.start"
            await send(message)

        try:
            await self.app(scope, receive, send_watched)
        except Exception:
            if scope["type"] != "http" or started:
                raise  # a response that has begun cannot be replaced: the server closes the connection
            _LOG.exception("Unexpected error in %s %s", scope["method"], scope["path"][:200])
            await problem_details.problem_response(problem_details.internal_error())(scope, receive, send)


class HeadRequests:
    """ASGI middleware that answers HEAD as GET without the body."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            return await self.app(scope, receive, send)

        async def send_without_body(message: Message) -> None:
            await send({**message, "body": b""} if message["type"] == "http.response.body" else message)

        # An endless response, such as a stream of events, has to know that nobody reads its body.
        inner = {**scope, "method": "GET", "slipstick.head": True}
        await self.app(inner, receive, send_without_body)
        scope["route"] = inner.get("route")
