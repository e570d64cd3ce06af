"""What is computed ahead: at the start of the service, and answers that are read ahead and shared."""

import asyncio
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from service.app import create_app
from service.recent import Recent
from service.settings import Settings
from service.warming import rehearse, warm
from slipstick.black_box import Measurements
from slipstick.errors import BadTable
from slipstick.recordings import Recordings
from slipstick.storage import versions
from slipstick.storage.library import Library
from slipstick.table import interpolation
from slipstick.uncertainty.likelihood import lattice_terms, pieces
from tests.service.conftest import Serving

SLOW = ("chaospy", "scipy.special", "scipy.stats", "scipy.signal", "scipy.optimize", "scipy.ndimage",
        "scipy.interpolate")
LOADED = f"import sys; print([name for name in {SLOW} if name in sys.modules])"


def test_what_a_likelihood_needs_is_compiled_ahead() -> None:
    warm()
    for function in (interpolation._interpolate, lattice_terms.add, pieces.sum_pieces):
        assert function.signatures


@pytest.mark.slow
def test_the_start_does_not_wait_for_libraries_that_a_propagation_needs_and_warming_imports_them() -> None:
    code = f"import service.server; {LOADED}; from service.warming import warm; warm(); {LOADED}"
    start, warmed = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True,
                                   check=True).stdout.splitlines()
    assert start == "[]"
    assert "chaospy" in warmed
    assert "scipy.stats" in warmed


def test_the_default_table_and_recordings_are_read_soon_after_the_start(
        shelf: Path, serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.app._QUIET_SECONDS", 0.2)
    tables = Path(shutil.copytree(shelf, tmp_path / "tables"))
    recordings, table = versions.open_recordings.cache_info().misses, Library(tables).table_in_memory
    assert table("nominal") is None
    with serving(Settings(tables=tables, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")):
        end = time.monotonic() + 60
        while table("nominal") is None or versions.open_recordings.cache_info().misses == recordings:
            assert time.monotonic() < end
            time.sleep(0.05)


def test_a_damaged_default_table_is_left_to_the_request_that_asks_for_it(tmp_path: Path) -> None:
    (tmp_path / "nominal.h5").write_bytes(b"no table")
    asyncio.run(rehearse(create_app(Settings(tables=tmp_path, jobs=f"sqlite:///{tmp_path}/jobs.sqlite"))))
    with pytest.raises(BadTable):
        Library(tmp_path).table("nominal")


@pytest.mark.parametrize(("has_files", "times"), [(True, 3), (False, 0)])
def test_the_example_of_the_likelihood_is_rehearsed_without_log_metrics_and_place(
        shelf: Path, tmp_path: Path, has_files: bool, times: int) -> None:
    places = list[int]()
    app = create_app(Settings(tables=shelf if has_files else tmp_path, jobs=f"sqlite:///{tmp_path}/jobs.sqlite"))

    class Counted(Library):
        def measured(self, name: str) -> Recordings | Measurements:
            places.append(app.state.computations.running)
            return super().measured(name)

    app.state.library = Counted(app.state.settings.tables)
    asyncio.run(rehearse(app))
    assert places == [0] * times  # no client waits or is refused for it
    assert b"slipstick_requests_total{" not in app.state.metrics.text()


# An answer that is read ahead: shared, never older than it may be, and an error as long as there is one.


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
