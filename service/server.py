"""The HTTP server of the service: uvicorn with the connections of protocol.py, and an end that clients cannot delay."""

import functools
import os
import signal
import threading
from types import FrameType

import uvicorn

from slipstick import interruption

from .app import create_app
from .logs import log_config, log_format
from .protocol import Connection
from .settings import Settings

_GRACE_SECONDS, _LAST_SECONDS = 3, 4.0


class Server(uvicorn.Server):
    """A server that ends within 4 s of SIGTERM or SIGINT, whatever its clients and computations do."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Finish requests for 3 s; then abandon the rest. Files and jobs are written atomically."""
        status = interruption.STATUS if sig == signal.SIGINT else 0
        # A thread that computes would delay the end of the process.
        timer = threading.Timer(_LAST_SECONDS, os._exit, (status,))
        timer.daemon = True
        timer.start()
        super().handle_exit(sig, frame)


def make_server(settings: Settings, log_level: str = "info") -> Server:
    """Return a server of the application at the address in the settings; port 0 takes any free port."""
    connection = functools.partial(Connection, seconds=settings.body_seconds)
    # Without WebSockets, a request to upgrade to one is answered like any other.
    app = create_app(settings)
    server = Server(uvicorn.Config(app, host=settings.host, port=settings.port, ws="none",
                                   http=connection,  # type: ignore[arg-type]
                                   log_config=log_config(settings.log or log_format()), log_level=log_level,
                                   access_log=False,
                                   timeout_graceful_shutdown=_GRACE_SECONDS))
    app.state.following.ending = lambda: server.should_exit
    return server
