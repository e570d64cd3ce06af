"""What is observed of every request: its id, its entry in the log, and its part in the metrics."""

import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from . import request_ids
from .logs import ACCESS
from .metrics import RequestMetrics


class Observed:
    """The outermost ASGI middleware: gives the request an id, then counts and logs its response.

    The path in the log is the one that was sent, with its escapes and without its query.
    """

    def __init__(self, app: ASGIApp, metrics: RequestMetrics) -> None:
        self.app, self.metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request."""
        if scope["type"] != "http":
            return await self.app(scope, receive, send)
        given = dict(scope["headers"]).get(request_ids.HEADER.lower().encode(), b"").decode("latin-1")
        id = request_ids.request_id(given)
        begin, status = time.perf_counter(), 0  # 0: the connection ended before the response

        async def send_observed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                header = (request_ids.HEADER.lower().encode(), id.encode())
                message = {**message, "headers": [*message.get("headers", ()), header]}
            await send(message)

        token = request_ids.current.set(id)
        try:
            await self.app(scope, receive, send_observed)
        finally:
            seconds = time.perf_counter() - begin
            route = getattr(scope.get("route"), "path", "other")
            self.metrics.count(scope["method"], route, status, seconds)
            path = scope.get("raw_path", b"").decode("latin-1") or scope["path"]
            client = "{}:{}".format(*scope["client"]) if scope.get("client") else ""
            ACCESS.info("%s %s %d", scope["method"], path[:500], status, extra={"fields": {
                "method": scope["method"], "path": path[:500], "route": route, "status": status,
                "seconds": round(seconds, 6), "client": client}})
            request_ids.current.reset(token)
