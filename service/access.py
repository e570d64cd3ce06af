"""Who may send requests: only under the names of this service, and not from pages of other sites in a browser."""

from urllib.parse import urlsplit

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import problem_details
from slipstick.errors import SlipstickError

_READING = ("GET", "HEAD", "OPTIONS")
_SECURITY_HEADERS = [
    # The page /docs holds a script of its own; no page needs anything from elsewhere.
    (b"content-security-policy", b"default-src 'self' 'unsafe-inline' data: blob:; base-uri 'none'; "
                                 b"frame-ancestors 'none'"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
]


class Access:
    """ASGI middleware that refuses other host names and requests from other sites, and adds security headers.

    A page of another site can let its own name resolve to this machine (DNS rebinding), but the header Host then has
    the name of that site. `hosts` are names without ports; `*` allows all.
    """

    def __init__(self, app: ASGIApp, hosts: frozenset[str]) -> None:
        self.app, self.hosts = app, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request, unless it is refused."""
        if scope["type"] != "http":
            return await self.app(scope, receive, send)

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), *_SECURITY_HEADERS]}
            await send(message)

        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        error = self._refusal(scope["method"], headers)
        if error is None:
            return await self.app(scope, receive, sending)
        # The body stays unread, so the connection cannot be reused.
        response = problem_details.problem_response(problem_details.problem_from(error), {"Connection": "close"})
        return await response(scope, receive, sending)

    def _refusal(self, method: str, headers: dict[bytes, str]) -> SlipstickError | None:
        host = headers.get(b"host", "")
        if "*" not in self.hosts and _name(f"//{host}") not in self.hosts:
            return problem_details.WrongHost(f"This service does not answer under the name '{host[:100]}'",
                                             "Use a name that SLIPSTICK_HOSTS lists on the server, or add this name")
        if method in _READING:
            return None
        origin, site = headers.get(b"origin"), headers.get(b"sec-fetch-site", "none")
        other = origin is not None and urlsplit(origin).netloc.lower() != host.lower()
        if other or site not in ("none", "same-origin"):
            return problem_details.CrossSite("A page of another site sent the request",
                                             "Send it from a program, or from the pages of this service")
        return None


def _name(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None
