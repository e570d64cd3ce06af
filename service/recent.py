"""An answer that many ask for and that takes a thread: read ahead of the next request, and shared by all."""

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

from starlette.concurrency import run_in_threadpool

_T = TypeVar("_T")


class Recent(Generic[_T]):
    """What `read` returned or raised, begun at most `seconds` s ago.

    A request that finds an answer of more than half this age has the next one read, but does not wait for it.
    """

    def __init__(self, read: Callable[[], _T], seconds: float) -> None:
        self._read, self._seconds = read, seconds
        self._answered: asyncio.Task[_T] | None = None
        self._reading: asyncio.Task[_T] | None = None
        self._begun = 0.0
        """Time at which the reading of the answer began."""

    async def value(self) -> _T:
        """Return the answer, or raise the error that there is instead of it."""
        now = asyncio.get_running_loop().time()
        answered, age = self._answered, now - self._begun
        if answered is not None and age <= self._seconds:
            if age > self._seconds / 2:
                self._start(now)
            return answered.result()
        reading = self._start(now)
        await asyncio.wait([reading])  # a request that is cancelled meanwhile leaves the task to the others
        return reading.result()

    def _start(self, now: float) -> asyncio.Task[_T]:
        if self._reading is None:
            self._reading = asyncio.create_task(run_in_threadpool(self._read))
            self._reading.add_done_callback(lambda task: self._take(task, now))
        return self._reading

    def _take(self, task: asyncio.Task[_T], begun: float) -> None:
        self._answered, self._reading, self._begun = task, None, begun
