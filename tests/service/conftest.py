import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from dbos import DBOSClient
from distribution import end_with_group

from service.job_store import connect
from service.server import make_server
from service.settings import Settings
from slipstick.storage.library import Library
from slipstick.table import Table

Serving = Callable[[Settings], AbstractContextManager[str]]
StoredJobs = dict[str, tuple[dict[str, Any], dict[str, Any] | None]]
"""Input and output of each job by its id; the output of a running job is None."""
ServingJobs = Callable[[Path, StoredJobs], AbstractContextManager[httpx.Client]]


@cache
def _empty_job_store() -> bytes:
    """The file of a job store without jobs, whose migrations take longer than most tests of a service."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "jobs.sqlite"
        connect(f"sqlite:///{path}").destroy()
        return path.read_bytes()


@contextmanager
def _serving(settings: Settings) -> Iterator[str]:
    """Serve on a free port of the loopback interface; yield the address."""
    jobs = Path(settings.jobs.removeprefix("sqlite:///"))
    if jobs.parent.is_dir() and not jobs.exists():
        jobs.write_bytes(_empty_job_store())
    server = make_server(settings.model_copy(update={"port": 0}), log_level="warning")
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive()
        time.sleep(0.01)
    try:
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


@contextmanager
def _serving_jobs(tables: Path, stored_jobs: StoredJobs) -> Iterator[httpx.Client]:
    """Serve the folder `tables` with a job store that contains the given jobs; yield a client."""
    jobs = {id: SimpleNamespace(
        workflow_id=id, status="SUCCESS" if output else "PENDING", input={"args": [job_input]}, output=output,
        error=None, created_at=1_790_000_000_000, dequeued_at=None, completed_at=None, executor_id="worker-1")
        for id, (job_input, output) in stored_jobs.items()}

    def list_workflows(_: DBOSClient, *, workflow_ids: list[str], name: str, **_options: bool) -> list[SimpleNamespace]:
        return [jobs[id] for id in workflow_ids if id in jobs]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(DBOSClient, "list_workflows", list_workflows)
        with _serving(Settings(tables=tables, jobs=f"sqlite:///{tables}/jobs.sqlite")) as address, \
                httpx.Client(base_url=address, timeout=30) as client:
            yield client


@pytest.fixture(scope="session", autouse=True)
def read_certificates_once() -> Iterator[None]:
    """Every client reads those of the whole world, which takes longer than most requests; none is sent there."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("httpx._transports.default.create_ssl_context", cache(httpx.create_ssl_context))
        yield


@pytest.fixture(scope="session", autouse=True)
def leave_first_requests_unprepared() -> Iterator[None]:
    """Most services of tests end before, and what each prepares takes longer than their requests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("service.app._QUIET_SECONDS", 1e6)
        yield


@pytest.fixture(scope="session")
def serving() -> Serving:
    return _serving


@pytest.fixture(scope="session")
def serving_jobs() -> ServingJobs:
    return _serving_jobs


@pytest.fixture(scope="session")
def settings(shelf: Path, tmp_path_factory: pytest.TempPathFactory) -> Settings:
    folder = tmp_path_factory.mktemp("service")
    shutil.copytree(shelf, folder / "tables")
    return Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite", body_bytes=8 << 20,
                    body_seconds=1.0, answer_values=100_000, array_values=400_000)


@pytest.fixture(scope="session")
def address(settings: Settings, serving: Serving) -> Iterator[str]:
    with serving(settings) as address:
        yield address


@pytest.fixture(scope="session")
def client(address: str) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=address, timeout=30) as client:
        yield client


@pytest.fixture(scope="session")
def library(settings: Settings) -> Library:
    return Library(settings.tables)


@pytest.fixture(scope="session")
def table(library: Library) -> Table:
    return library.table("nominal")


@pytest.fixture(scope="session")
def quick_service(shelf: Path, few_recordings: Path, serving: Serving, launch: Callable[..., subprocess.Popen[bytes]],
          tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, httpx.Client]]:
    """Folder of tables and client of a separate service and worker, with so few recordings that a study is fast."""
    folder = tmp_path_factory.mktemp("quick")
    tables, jobs = folder / "tables", f"sqlite:///{folder}/jobs.sqlite"
    shutil.copytree(shelf, tables)
    shutil.copy(few_recordings / "few.h5", tables / "measured.h5")
    with serving(Settings(tables=tables, jobs=jobs)) as address, httpx.Client(base_url=address, timeout=30) as client:
        worker = launch("worker", "work", "--tables", str(tables), "--jobs", jobs, "--machine", "dc_motor")
        while not client.get("/v1/machines").json()["total"]:
            assert worker.poll() is None
            time.sleep(0.1)
        end_with_group("a service with a worker", worker.kill)
        yield tables, client
        worker.kill()


@pytest.fixture
def folder(shelf: Path, tmp_path: Path) -> Path:
    """A folder with a copy of the tables, and the job database, of one service."""
    shutil.copytree(shelf, tmp_path / "tables")
    return tmp_path


@pytest.fixture
def own_client(folder: Path, serving: Serving) -> Iterator[httpx.Client]:
    """A client of a service of its own."""
    settings = Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client
