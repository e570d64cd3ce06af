"""Who may send requests: under the names of this service, not from pages of other sites, and with a token if needed."""

import logging
from urllib.parse import urlsplit

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipstick.errors import SlipstickError

from . import problem_details
from .tokens import READING, BadTokens, Tokens, required_role

_LOG = logging.getLogger("uvicorn.error")
_CHALLENGES = [(b"www-authenticate", b'Bearer realm="slipstick"'), (b"www-authenticate", b'Basic realm="slipstick"')]
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
    """ASGI middleware that refuses other host names, requests from other sites, and requests without the token needed.

    A page of another site can let its own name resolve to this machine (DNS rebinding), but the header Host then has
    the name of that site. `hosts` are names without ports; `*` allows all. Without `tokens`, none is needed. The body
    of a refused request is not read. Responses get security headers.
    """

    def __init__(self, app: ASGIApp, hosts: frozenset[str], tokens: Tokens | None) -> None:
        self.app, self.hosts, self.tokens = app, hosts, tokens

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request, unless it is refused."""
        if scope["type"] != "http":
            return await self.app(scope, receive, send)

        async def send_secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), *_SECURITY_HEADERS]}
            await send(message)

        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        error = self._check_origin(scope["method"], headers) or self._check_token(scope, headers)
        if error is None:
            return await self.app(scope, receive, send_secured)
        # The body stays unread, so the connection cannot be reused.
        response = problem_details.problem_response(problem_details.problem_from(error), {"Connection": "close"})
        if isinstance(error, problem_details.TokenRequired):
            response.raw_headers.extend(_CHALLENGES)
        return await response(scope, receive, send_secured)

    def _check_origin(self, method: str, headers: dict[bytes, str]) -> SlipstickError | None:
        host = headers.get(b"host", "")
        if "*" not in self.hosts and _host_name(f"//{host}") not in self.hosts:
            return problem_details.WrongHost(f"This service does not answer under the name '{host[:100]}'",
                                             "Use a name that SLIPSTICK_HOSTS lists on the server, or add this name")
        if method in READING:
            return None
        origin, site = headers.get(b"origin"), headers.get(b"sec-fetch-site", "none")
        other = origin is not None and _authority(origin) != host.lower()
        if other or site not in ("none", "same-origin"):
            return problem_details.CrossSite("A page of another site sent the request",
                                             "Send it from a program, or from the pages of this service")
        return None

    def _check_token(self, scope: Scope, headers: dict[bytes, str]) -> SlipstickError | None:
        role = required_role(scope["method"], scope["path"])
        if self.tokens is None or role is None:
            return None
        try:
            caller = self.tokens.caller(headers.get(b"authorization", ""))
        except BadTokens as error:
            _LOG.error("%s", error)
            return problem_details.StoreUnavailable("The service cannot read its tokens",
                                                    "Ask its administrator; the log of the service has the cause")
        if caller is None:
            given = "The token is unknown" if b"authorization" in headers else "The request has no token"
            return problem_details.TokenRequired(given, "Send the header 'Authorization: Bearer TOKEN'; in a browser, "
                                                        "enter the token as the password")
        if scope.get("client"):  # so that the name is in each line of the access log of the server
            scope["client"] = (f"{caller.name}@{scope['client'][0]}", scope["client"][1])
        return None if caller.may(role) else problem_details.RoleRequired(
            f"The request needs the role {role}; the token '{caller.name}' has the role {caller.role}",
            "Ask the administrator of the service for a token with this role")


def _authority(address: str) -> str | None:
    """The host and port of an address, None where it has no valid form."""
    try:
        return urlsplit(address).netloc.lower()
    except ValueError:
        return None


def _host_name(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None
