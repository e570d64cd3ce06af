"""A service and a worker as programs of their own, and how their jobs are followed."""

import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

SETTINGS = {"population": 24, "generations": 12, "patience": 12, "order": 4, "seed": 5}
ENDLESS = {**SETTINGS, "generations": 3000, "patience": 3000}
SHORT = {"population": 4, "generations": 1, "refine": False, "intervals": False}


class Bench:
    """A service and a worker on one folder, with the shipped recordings, `measured`, and a ninth of them, `few`."""

    def __init__(self, shelf: Path, few: Path, folder: Path, launch: Callable[..., subprocess.Popen[bytes]],
                 jobs: str | None = None, options: tuple[str, ...] = ()) -> None:
        self.tables, self.launch, self.options = folder / "tables", launch, options
        shutil.copytree(shelf, self.tables)
        shutil.copy(few, self.tables)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.environment = {"SLIPSTICK_TABLES": str(self.tables), "SLIPSTICK_PORT": str(port),
                            "SLIPSTICK_JOBS": jobs or f"sqlite:///{folder}/jobs.sqlite"}
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=30)
        self.serve()
        self.work()

    def serve(self) -> None:
        self.service = self.launch("service", **self.environment)
        while True:
            try:
                self.client.get("/v1/health").raise_for_status()
                return
            except httpx.TransportError:
                assert self.service.poll() is None
                time.sleep(0.05)

    def work(self, name: str = "worker-1") -> None:
        self.worker = self.launch("worker", "work", "--name", name, *self.options, **self.environment)

    def run_both(self) -> None:
        """Start what an earlier test has killed and not started again."""
        if self.service.poll() is not None:
            self.serve()
        if self.worker.poll() is not None:
            self.work()

    def cancel_all(self) -> None:
        for kind in ("fits", "studies"):
            for job in self.client.get(f"/v1/{kind}").json()[kind]:
                if not ended(job):
                    self.client.post(f"/v1/{kind}/{job['id']}/cancel")

    def kill(self, *processes: subprocess.Popen[bytes]) -> None:
        for process in processes:
            process.send_signal(signal.SIGKILL)
        for process in processes:
            process.wait()

    def end(self) -> None:
        """End the service and the worker."""
        self.kill(self.service, self.worker)
        self.client.close()

    def submit(self, name: str, **settings: Any) -> None:
        self.post("/v1/fits", name, {"settings": settings})

    def post(self, address: str, name: str, body: dict[str, Any]) -> None:
        answer = self.client.post(address, json=body, headers={"Idempotency-Key": name})
        assert answer.status_code == 202, answer.text

    def follow(self, name: str, until: Callable[[dict[str, Any]], bool], seconds: float = 300,
               address: str = "/v1/fits") -> dict[str, Any]:
        deadline = time.monotonic() + seconds
        while True:
            found: dict[str, Any] = self.client.get(f"{address}/{name}").json()
            if until(found):
                return found
            assert time.monotonic() < deadline, found
            time.sleep(0.2 if until is ended else 0.02)  # a stage may last a tenth of a second only


def in_stage(stage: str, generation: int) -> Callable[[dict[str, Any]], bool]:
    def reached(found: dict[str, Any]) -> bool:
        assert found["status"] in ("queued", "running"), found
        progress = found["progress"]
        return progress is not None and progress["stage"] == stage and progress["generation"] >= generation

    return reached


def ended(found: dict[str, Any]) -> bool:
    return found["status"] not in ("queued", "running")
