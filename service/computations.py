"""Places for requests: only a few compute or read at once, so that the health check always finds a thread."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, TypeVar

import numpy as np
from fastapi import Depends, Request

from slipstick.bench import Conditions
from slipstick.uncertainty.likelihood import ShiftingTimeModel

from .problem_details import Busy, TooSlow

_Endpoint = TypeVar("_Endpoint", bound=Callable[..., object])


def computes(endpoint: _Endpoint) -> _Endpoint:
    """Mark an endpoint whose requests take a place among the computations."""
    endpoint.places = "computations"  # type: ignore[attr-defined]
    return endpoint


def at_once(endpoint: _Endpoint) -> _Endpoint:
    """Mark an endpoint whose requests take no place and never wait for others: the health checks."""
    endpoint.places = None  # type: ignore[attr-defined]
    return endpoint


def reads_upload(endpoint: _Endpoint) -> _Endpoint:
    """Mark an endpoint whose requests take a place among the uploads.

    They wait for a child process that reads the file, and must not keep requests from computing meanwhile.
    """
    endpoint.places = "uploads"  # type: ignore[attr-defined]
    return endpoint


class Computations:
    """At most `most` computations at once, and at most `most_waiting` requests that wait for one to end."""

    def __init__(self, most: int, most_waiting: int, seconds: float) -> None:
        self.places, self.most_waiting, self.seconds = asyncio.Semaphore(most), most_waiting, seconds
        self.most, self.running, self.waiting = most, 0, 0

    @asynccontextmanager
    async def place(self) -> AsyncIterator[None]:
        """Wait for a place and hold it; raises `Busy` if too many wait already, or after `seconds` s."""
        if self.places.locked():
            await self._wait()
        else:
            await self.places.acquire()  # at once
        self.running += 1
        try:
            yield
        finally:
            self.running -= 1
            self.places.release()

    async def _wait(self) -> None:
        if self.waiting >= self.most_waiting:
            raise Busy(f"{self.waiting} requests are waiting for a computation to end")
        self.waiting += 1
        try:
            async with asyncio.timeout(self.seconds):
                await self.places.acquire()
        except TimeoutError:
            raise Busy(f"No computation ended within {self.seconds:g} s") from None
        finally:
            self.waiting -= 1


@dataclass(frozen=True, eq=False)
class Client:
    """The client of a request, which may close the connection before the response."""

    gone: threading.Event

    def require(self) -> None:
        """Raise `TooSlow` if the client has closed the connection: nobody would read the result."""
        if self.gone.is_set():
            raise TooSlow("The client closed the connection before the result was computed", "Send the request again")

    def watched(self, model: ShiftingTimeModel) -> ShiftingTimeModel:
        """The model, which stops the computation at its next evaluation after the client is gone."""
        def evaluate(points: np.ndarray, conditions: Conditions, /) -> np.ndarray:
            self.require()
            return model(points, conditions)

        return evaluate


async def _client(request: Request) -> Client:
    client: Client = request.state.client
    return client


ClientDependency = Annotated[Client, Depends(_client)]
