"""An answer that is read ahead: shared, never older than it may be, and an error as long as there is one."""

import asyncio
import threading

import pytest

from service.recent import Recent


def test_requests_share_a_reading_and_do_not_wait_for_the_next_one() -> None:
    begun, go_on, answers = threading.Semaphore(0), threading.Semaphore(0), iter(range(10))

    def read() -> int:
        begun.release()
        assert go_on.acquire(timeout=20)
        return next(answers)

    async def ask() -> None:
        recent, clock = Recent(read, 1.0), asyncio.get_running_loop()
        first = [asyncio.create_task(recent.value()) for _ in range(3)]
        await asyncio.sleep(0)
        first.pop().cancel()  # the others get their answer
        go_on.release()
        assert await asyncio.gather(*first) == [0, 0]
        assert await recent.value() == 0
        recent._begun = clock.time() - 0.6
        assert [await recent.value() for _ in range(3)] == [0, 0, 0]
        assert recent._reading is not None
        go_on.release()
        await recent._reading
        assert await recent.value() == 1
        recent._begun = clock.time() - 1.1
        go_on.release()
        assert await recent.value() == 2

    asyncio.run(ask())
    assert [begun.acquire(blocking=False) for _ in range(4)] == [True, True, True, False]


def test_an_error_is_an_answer_as_well() -> None:
    outcomes = iter([OSError("gone"), 5])

    def read() -> int:
        outcome = next(outcomes)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    async def ask() -> None:
        recent = Recent(read, 1.0)
        for _ in range(2):
            with pytest.raises(OSError, match="gone"):
                await recent.value()
        recent._begun -= 2
        assert await recent.value() == 5

    asyncio.run(ask())
