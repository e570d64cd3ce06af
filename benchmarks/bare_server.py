"""A bare Starlette server, the floor of an answer over HTTP: `python -m benchmarks.bare_server PORT FOLDER`.

Each file of the folder is the answer of a route of its name, which reads the body of the request and computes nothing.
An array is sent in pieces, as the service sends it.
"""

import sys
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from service import npy


def route(path: Path) -> Route:
    content = path.read_bytes()

    async def answer(request: Request) -> Response:
        await request.body()
        if path.suffix == ".json":
            return Response(content, media_type="application/json")
        return StreamingResponse(npy.pieces(memoryview(content)), headers={"Content-Length": str(len(content))},
                                 media_type=npy.MEDIA_TYPE)

    return Route(f"/{path.name}", answer, methods=["POST"])


def main() -> None:
    """Serve until the process ends."""
    application = Starlette(routes=[route(path) for path in sorted(Path(sys.argv[2]).iterdir())])
    uvicorn.run(application, port=int(sys.argv[1]), http="h11", log_level="warning", access_log=False)


if __name__ == "__main__":
    main()
