"""How `pytest --dist loadfile` spreads the files over its processes, and what these compute once for all of them."""

import fcntl
import gc
import os
import pickle
from collections.abc import Callable, Generator
from typing import Any, TypeVar

import pytest

T = TypeVar("T")
Once = Callable[[str, Callable[[], Any]], Any]

FIRST = ("service/test_openapi.py", "worker/test_serve_jobs.py", "service/test_study_routes.py",
         "slipstick/report/test_page_in_browser.py", "slipstick/machine_studies/test_machine_study.py",
         "slipstick/calibration/test_calibrate.py")
"""The slowest files: started last, one of them would run alone at the end."""
TOGETHER = {
    **dict.fromkeys(("service/test_openapi.py", "service/test_rest_page.py", "service/test_front_page.py",
                     "service/test_acting_pages.py"), "a service with a worker"),
    **dict.fromkeys(("slipstick/studies/test_study_record.py", "slipstick/pictures/test_study_pictures.py",
                     "slipstick/report/test_study_page.py", "slipstick/report/test_page_in_browser.py"), "studies"),
    **dict.fromkeys(("worker/test_build_jobs.py", "worker/test_calibration_jobs.py", "worker/test_serve_jobs.py"),
                    "a bench with a worker")}
"""File -> what it shares with others by a session fixture that takes seconds: these run in one process."""


_ENDS: dict[str, Callable[[], None]] = {}


def group_of(nodeid: str) -> str:
    """The group of the file, or the file."""
    file = nodeid.split("::")[0].removeprefix("tests/")
    return TOGETHER.get(file, file)


def end_with_group(group: str, end: Callable[[], None]) -> None:
    """Have `end` called after the last test of the group: programs that wait for requests and jobs take time, too."""
    _ENDS[group] = end


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    group = group_of(item.nodeid)
    if group in _ENDS and (nextitem is None or group_of(nextitem.nodeid) != group):
        _ENDS.pop(group)()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """All that is imported stays, and would be searched for garbage again and again; tests make little of it."""
    gc.disable()
    result = yield
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()
    return result


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    ranks = {group_of(name): rank for rank, name in reversed([*enumerate(FIRST)])}
    items.sort(key=lambda item: ranks.get(group_of(item.nodeid), len(FIRST)))  # all files of a group together


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One process more than cores: some tests wait for services and workers that they have started."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    from xdist.scheduler import LoadFileScheduling  # absent where the tests run in one process

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return group_of(nodeid)

    config.option.loadscopereorder = False  # the order of collection, not the files of most tests first
    return Scheduling(config, log) if config.getoption("dist") == "loadfile" else None


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    """Compute a value by its name in one process of the run; the others wait for it and read it."""
    own = tmp_path_factory.getbasetemp()
    folder = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def value(name: str, compute: Callable[[], T]) -> T:
        path = folder / f"{name}.pickle"
        with path.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not path.exists():
                content = pickle.dumps(compute())
                path.with_suffix(".part").write_bytes(content)
                path.with_suffix(".part").rename(path)
        found: T = pickle.loads(path.read_bytes())
        return found

    return value
