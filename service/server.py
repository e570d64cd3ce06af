"""The HTTP server of the service: uvicorn with the connections of protocol.py."""

import uvicorn

from service.app import create_app
from service.protocol import Connection
from service.settings import Settings


def make_server(settings: Settings, log_level: str = "info") -> uvicorn.Server:
    """Return a server of the application at the address in the settings; port 0 takes any free port."""
    # Without WebSockets, a request to upgrade to one is answered like any other.
    return uvicorn.Server(uvicorn.Config(create_app(settings), host=settings.host, port=settings.port, http=Connection,
                                         ws="none", log_level=log_level))
