"""Clients that wait for something to change: they hold no thread, and the database is read once for all of them."""

import asyncio
import hashlib
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

from fastapi import Header, Query
from fastapi.sse import format_sse_event
from starlette.concurrency import run_in_threadpool
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from slipstick.errors import SlipstickError

from .held import held
from .problem_details import Busy, problem_from

_T = TypeVar("_T")
_INTERVAL = 0.5
"""Time between two looks in s."""
_QUIET_SECONDS = 15.0
"""Time after which a comment tells proxies that the stream is alive."""
_RETRY = 2000
"""Time in ms after which a browser opens a stream again that ended or broke."""
MOST_SECONDS = 300

Wait = Annotated[int, Query(
    ge=0, le=MOST_SECONDS, description="Time in s to wait until the job has ended; the response comes as soon as it "
    "has, or after this time. 0 for no wait. The limit SLIPSTICK_FOLLOW_SECONDS may be shorter.")]
LastEventId = Annotated[str | None, Header(
    alias="Last-Event-ID", description="Id of the last event received, which browsers send by themselves when they "
    "connect again. The state that it stands for is not sent once more; if it was the last one, the response is 204, "
    "after which browsers do not connect again.")]


@dataclass(frozen=True)
class State:
    """What an event stream sends: a text, whether it is the last one, and its id, which follows from the text."""

    text: str
    ended: bool

    @property
    def id(self) -> str:
        """Equal texts have equal ids, also after a restart of the service: a stream resumes without any memory."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:16]


@dataclass(eq=False)
class Following:
    """At most `most` clients that wait at the same time, each for at most `seconds` s."""

    most: int
    seconds: float
    ending: Callable[[], bool] = field(default=lambda: False)
    """Whether the server is about to stop, which ends all waiting."""
    count: int = 0
    _reads: dict[str, tuple[float, asyncio.Task[Any]]] = field(default_factory=dict)

    @contextmanager
    def place(self) -> Iterator[None]:
        """Hold one of the places; raises `Busy` if none is free."""
        if self.count >= self.most:
            raise Busy(f"{self.count} clients are waiting for jobs already")
        self.count += 1
        try:
            yield
        finally:
            self.count -= 1

    async def states(self, key: str, read: Callable[[], _T], seconds: float) -> AsyncIterator[_T]:
        """Yield the state that `read` returns, every half second; clients with the same `key` share what it returns."""
        now = asyncio.get_running_loop().time
        end = now() + min(seconds, self.seconds)
        while True:
            yield await self._read_latest(key, read)
            if self.ending() or now() >= end:
                return
            await asyncio.sleep(max(0.0, min(_INTERVAL, end - now())))

    async def _read_latest(self, key: str, read: Callable[[], _T]) -> _T:
        now = asyncio.get_running_loop().time()
        self._reads = {name: entry for name, entry in self._reads.items() if now - entry[0] < _INTERVAL / 2}
        if key not in self._reads:
            self._reads[key] = now, asyncio.ensure_future(run_in_threadpool(read))
        # Shielded: a client that leaves must not cancel what others wait for.
        latest: _T = await asyncio.shield(self._reads[key][1])
        return latest


FollowingDependency = Annotated[Following, held("following")]


class EventStream(StreamingResponse):
    """Server-sent events: each new state, until the last one or until the time of the stream is over.

    An event `state` is followed by others; `end` is the last one. Raises `Busy` before the response begins.
    """

    media_type = "text/event-stream"

    def __init__(self, following: Following, key: str, read: Callable[[], State], seen: str | None) -> None:
        super().__init__(_events(following, key, read, seen), headers={
            "Cache-Control": "no-store", "X-Accel-Buffering": "no"})  # or a proxy collects events before it sends them
        self.following = following

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the stream at a place of its own; HEAD gets the headers only."""
        if scope.get("slipstick.head"):
            self.body_iterator = _no_events()
        with self.following.place():
            await super().__call__(scope, receive, send)


async def _no_events() -> AsyncIterator[str]:
    return
    yield


async def _events(following: Following, key: str, read: Callable[[], State], seen: str | None) -> AsyncIterator[bytes]:
    yield format_sse_event(retry=_RETRY)
    quiet = 0.0
    try:
        async for state in following.states(key, read, following.seconds):
            quiet += _INTERVAL
            if state.id != seen:
                seen, quiet = state.id, 0.0
                yield format_sse_event(event="end" if state.ended else "state", id=seen, data_str=state.text)
            elif quiet >= _QUIET_SECONDS:
                quiet = 0.0
                yield format_sse_event(comment="")
            if state.ended:
                return
    except SlipstickError as error:  # the response has begun: the job was deleted, for example
        yield format_sse_event(event="problem", data_str=problem_from(error).model_dump_json(exclude_defaults=True))
