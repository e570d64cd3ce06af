"""A bare Starlette server, the floor of an answer over HTTP: `python -m benchmarks.bare_server PORT FOLDER`.

Each file of the folder is the answer of a route of its name, which reads the body of the request and computes nothing.
"""

import sys
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route


def route(path: Path) -> Route:
    content = path.read_bytes()
    media_type = "application/json" if path.suffix == ".json" else "application/x-npy"

    async def answer(request: Request) -> Response:
        await request.body()
        return Response(content, media_type=media_type)

    return Route(f"/{path.name}", answer, methods=["POST"])


def main() -> None:
    """Serve until the process ends."""
    application = Starlette(routes=[route(path) for path in sorted(Path(sys.argv[2]).iterdir())])
    uvicorn.run(application, port=int(sys.argv[1]), http="h11", log_level="warning", access_log=False)


if __name__ == "__main__":
    main()
