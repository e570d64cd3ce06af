"""A bare Starlette server, the floor of an answer over HTTP: `python -m benchmarks.bare_server PORT FOLDER TABLE`.

Each file of the folder is the answer of a route of its name, which reads the body of the request and computes nothing.
An array is sent in pieces, as the service sends it. The route /least does what no answer of a point from a table can do
without: it reads JSON, interpolates by the compiled loop, and writes JSON. It checks, limits, logs and counts nothing.
"""

import sys
from pathlib import Path

import numpy as np
import orjson
import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from service import npy
from slipstick.table import Grid, Table
from slipstick.table.interpolation import _interpolate


def route(path: Path) -> Route:
    content = path.read_bytes()

    async def answer(request: Request) -> Response:
        await request.body()
        if path.suffix == ".json":
            return Response(content, media_type="application/json")
        return StreamingResponse(npy.pieces(memoryview(content)), headers={"Content-Length": str(len(content))},
                                 media_type=npy.MEDIA_TYPE)

    return Route(f"/{path.name}", answer, methods=["POST"])


def least(table: Table) -> Route:
    assert isinstance(table, Grid)
    knots, sizes = np.concatenate([axis.values for axis in table.axes]), np.array(table.times.shape[:-1])
    values = table.times.reshape(-1, table.times.shape[-1])

    async def answer(request: Request) -> Response:
        points = np.array(orjson.loads(await request.body())["points"])
        times = np.empty((len(points), values.shape[1]))
        _interpolate(knots, sizes, values, points, times)
        return Response(orjson.dumps({"shifting_time": times}, option=orjson.OPT_SERIALIZE_NUMPY),
                        media_type="application/json")

    return Route("/least", answer, methods=["POST"])


def main() -> None:
    """Serve until the process ends."""
    routes = [route(path) for path in sorted(Path(sys.argv[2]).iterdir())]
    application = Starlette(routes=[*routes, least(Table.open(sys.argv[3]))])
    uvicorn.run(application, port=int(sys.argv[1]), http="h11", log_level="warning", access_log=False)


if __name__ == "__main__":
    main()
