"""The containers without an engine: the compose file fits its schema, and its commands run on the image's files."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import jsonschema
import pytest
import yaml

from service.tokens import new_token

ROOT = Path(__file__).parents[1]
SCHEMA = json.loads((ROOT / "tests" / "data" / "compose_spec" / "compose-spec.json").read_text())
COMPOSE = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
SMALL = ("--axis", "pressure_bias=0.5:1.5:5", "--axis", "initial_position=0.5:1.5:5")


def copied() -> list[tuple[str, str]]:
    """What the Dockerfile copies from here: (source, target)."""
    lines = [line.split()[1:] for line in (ROOT / "Dockerfile").read_text().splitlines() if line.startswith("COPY ")]
    return [(line[-2], line[-1]) for line in lines if not line[0].startswith("--from")]


def test_the_compose_file_fits_its_schema() -> None:
    jsonschema.validate(COMPOSE, SCHEMA, cls=jsonschema.Draft7Validator)
    for broken in ({"restrat": "always"}, {"depends_on": {"table": {"condition": "done"}}}):
        services = {**COMPOSE["services"], "service": {**COMPOSE["services"]["service"], **broken}}
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**COMPOSE, "services": services}, SCHEMA, cls=jsonschema.Draft7Validator)


def test_the_image_is_given_what_it_copies() -> None:
    let_in = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    assert let_in == {source for source, _ in copied()}
    assert all((ROOT / source).exists() for source in let_in)


class Containers:
    """The services of the compose file as processes: the image's /app and the volume /data are folders."""

    def __init__(self, folder: Path) -> None:
        self.app, self.data = folder / "app", folder / "data"
        for source, target in copied():
            place = Path(self.mapped(target)) if target.startswith("/data/") else self.app
            if (ROOT / source).is_dir():
                # With what is compiled, which takes a minute to make again; less what another process may be writing.
                shutil.copytree(ROOT / source, place / source, ignore=shutil.ignore_patterns("*.pyc*", "*.tmp.*"))
            else:
                place.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / source, place)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]

    def mapped(self, text: str) -> str:
        return text.replace("/data/", f"{self.data}/").replace("/run/secrets/", f"{self.app.parent}/")

    def arguments(self, command: list[str]) -> list[str]:
        assert command[0] == "python"
        return [sys.executable, *map(self.mapped, command[1:])]

    def surroundings(self, service: str) -> dict[str, Any]:
        given = {name: self.mapped(value) for name, value in COMPOSE["services"][service]["environment"].items()}
        environment = {**os.environ, **given, "SLIPSTICK_HOST": "127.0.0.1", "SLIPSTICK_PORT": str(self.port)}
        return {"cwd": self.app, "env": environment}

    def run(self, service: str, command: list[str], *more: str) -> int:
        return subprocess.run([*self.arguments(command), *more], **self.surroundings(service), check=False).returncode

    @contextmanager
    def running(self, service: str) -> Iterator[subprocess.Popen[bytes]]:
        """Start the service's command; at the end stop it as an engine does, which it must take well."""
        process = subprocess.Popen(self.arguments(COMPOSE["services"][service]["command"]),
                                   **self.surroundings(service))
        try:
            yield process
            process.terminate()
            assert process.wait(timeout=10) in (0, -signal.SIGTERM)
        finally:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_the_same_commands_run_a_fit_on_one_volume(tmp_path: Path) -> None:
    services, containers = COMPOSE["services"], Containers(tmp_path)
    token, line = new_token("alice", "run")
    assert services["service"]["secrets"] == list(COMPOSE["secrets"]) == ["tokens"]
    (tmp_path / "tokens").write_text(line)
    health = services["service"]["healthcheck"]["test"]
    assert health[0] == "CMD"
    assert containers.run("table", services["table"]["command"], *SMALL) == 0
    assert containers.run("service", health[1:]) != 0
    with (containers.running("service") as service,
          httpx.Client(base_url=f"http://127.0.0.1:{containers.port}", timeout=30, auth=("", token)) as client):
        while containers.run("service", health[1:]) != 0:
            assert service.poll() is None
        with containers.running("worker"):
            settings = {"population": 4, "generations": 2, "refine": False, "intervals": False}
            fit = client.post("/v1/fits", json={"settings": settings}).raise_for_status().headers["Location"]
            deadline = time.monotonic() + 60
            while (found := client.get(fit).json())["status"] in ("queued", "running"):
                assert time.monotonic() < deadline, found
                time.sleep(0.1)
            result = client.get(f"{fit}/result").raise_for_status().json()
            assert len(result["result"]["mean"]) == 2
        assert httpx.get(client.base_url.join(fit)).status_code == 401
        page = client.get("/docs").raise_for_status().text
        assert "swagger-ui-bundle.js" in page
        assert client.get("/static/swagger/swagger-ui-bundle.js").is_success
