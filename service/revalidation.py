"""Responses that a client has already: an ETag from the digest of what is described, and 304 if it has not changed."""

import hashlib
from typing import Annotated, Any

from fastapi import Depends, Request
from starlette.responses import Response

from slipstick import __version__

NOT_MODIFIED: dict[int | str, dict[str, Any]] = {304: {
    "description": "The response has not changed since the one whose ETag the header If-None-Match has"}}
"""OpenAPI description of the response without body."""


class NotModified(Exception):
    """The client has the response already."""


class Revalidation:
    """The ETag of the response to one request.

    It is a weak one, because the same response may be compressed or not.
    """

    def __init__(self, request: Request) -> None:
        self.request = request

    def require_change(self, *content: str) -> None:
        """Raise `NotModified` if the client has the response that follows from `content`, digests for example.

        Parts of the ETag are also the version of the service, the address, and the format that the client accepts.
        """
        address = (self.request.url.path, self.request.url.query, self.request.headers.get("accept", ""))
        text = "\0".join((__version__, *address, *content))
        tag = f'W/"{hashlib.sha256(text.encode()).hexdigest()[:32]}"'
        self.request.state.headers = {"ETag": tag, "Cache-Control": "private, no-cache", "Vary": "Accept"}
        known = {etag.strip().removeprefix("W/") for etag in self.request.headers.get("if-none-match", "").split(",")}
        if known & {tag.removeprefix("W/"), "*"}:
            raise NotModified


async def _revalidation(request: Request) -> Revalidation:
    return Revalidation(request)


RevalidationDependency = Annotated[Revalidation, Depends(_revalidation)]


def headers_of(request: Request) -> dict[str, str]:
    """Return the headers that belong to the response, none if it has no ETag."""
    headers: dict[str, str] = getattr(request.state, "headers", {})
    return headers


def not_modified(request: Request, _: Exception) -> Response:
    """Return the response without body."""
    return Response(status_code=304, headers=headers_of(request))
