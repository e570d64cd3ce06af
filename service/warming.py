"""What is imported, loaded, compiled or read on first use, before the first request needs it."""

import asyncio
import gc
from contextlib import suppress
from types import SimpleNamespace

import numpy as np
import orjson
from fastapi import FastAPI
from fastapi.middleware.asyncexitstack import AsyncExitStackMiddleware
from starlette.types import Message, Scope

from slipstick.errors import SlipstickError
from slipstick.table.axis import Axis
from slipstick.table.interpolation import interpolate
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings, Output, expand, make_basis
from slipstick.uncertainty.likelihood import SAMPLES, Candidate, InferenceProblem, converged

from .computations import Computations
from .routes.likelihood import EXAMPLE

_REHEARSALS = 3


def warm() -> None:
    """Compute small likelihoods, on a lattice and along lines, and a small propagation."""
    axes = tuple(Axis(name, np.linspace(0.5, 1.5, 3), 1.0, "1") for name in ("a", "b"))
    times = np.linspace(0.4, 0.6, 18).reshape(3, 3, 2)

    def model(points: np.ndarray, conditions: object) -> np.ndarray:
        return interpolate(axes, times, points, "clip")

    problem = InferenceProblem(model, None, np.full(2, 0.5), np.full(2, 0.5), np.full(2, 1.5), ("a", "b"),
                               tuple(axis.values for axis in axes))
    inputs = Inputs(np.ones(2), np.full(2, 0.1))
    for lattices in (True, False):
        converged(problem, Candidate(inputs, 0.05), lattices=lattices)
    basis = make_basis(inputs.germs, ExpansionSettings())
    Output(expand(basis, model(inputs.at_germs(basis.nodes), None)), 0.05, 64, 1).density(times[:, 0])
    standard_normals(2, SAMPLES, 1)
    gc.freeze()  # the libraries stay as well, like what was imported at the start


async def rehearse(app: FastAPI) -> None:
    """Answer the example of the likelihood some times, as for a client, but without log and metrics.

    It reads the default table and recordings, if there are any. What lies between the server and the computation takes
    several times as long in the first requests. No client waits or is refused for it: its place is one of its own.
    """
    apart = SimpleNamespace(state=SimpleNamespace(library=app.state.library, settings=app.state.settings,
                                                  computations=Computations(1, 0, 0)))

    async def send(message: Message) -> None:
        """Nobody waits for the response."""

    for _ in range(_REHEARSALS):
        given: list[Message] = [{"type": "http.request", "body": orjson.dumps(EXAMPLE), "more_body": False}]

        async def receive(left: list[Message] = given) -> Message:
            return left.pop() if left else await asyncio.Event().wait()  # type: ignore[return-value]

        scope: Scope = {"type": "http", "method": "POST", "path": "/v1/likelihood", "root_path": "", "scheme": "http",
                        "query_string": b"", "headers": [(b"content-type", b"application/json")], "app": apart}
        with suppress(SlipstickError, OSError):  # a request reports it
            await AsyncExitStackMiddleware(app.router)(scope, receive, send)
