"""The containers without an engine: the compose file fits its schema, and its commands run on the image's files."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import jsonschema
import pytest
import yaml
from sqlalchemy import make_url

from service.tokens import new_token
from slipstick.table import Table

ROOT = Path(__file__).parents[1]
SCHEMA = json.loads((ROOT / "tests" / "data" / "compose_spec" / "compose-spec.json").read_text())
COMPOSE = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT, SETUP = BUILD["project"], BUILD["tool"]["setuptools"]
PACKAGES = "slipstick", "slipstick_service", "slipstick_worker"
FOLDERS = {"slipstick": "slipstick", **SETUP["package-dir"]}
SMALL = ("--axis", "pressure_bias=0.5:1.5:5", "--axis", "initial_position=0.5:1.5:5")


def copied() -> list[tuple[str, str]]:
    """What the Dockerfile copies from here: (source, target)."""
    lines = [line.split()[1:] for line in (ROOT / "Dockerfile").read_text().splitlines() if line.startswith("COPY ")]
    return [(source, line[-1]) for line in lines if not line[0].startswith("--from")
            for source in line[:-1] if not source.startswith("--")]


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


def test_the_image_has_what_its_wheel_is_made_of() -> None:
    """All sources of packages, licences and package data, so that `pip install .` finds them in the image."""
    given = {Path(source) for source, target in copied() if target.startswith("./")}
    texts = [PROJECT["readme"], *(text for text in PROJECT["license-files"] if "*" not in text)]
    shipped = [f"{FOLDERS['slipstick.shipped']}/{name}" for name in SETUP["package-data"]["slipstick.shipped"]]
    for needed in ("pyproject.toml", *texts, *shipped, *(FOLDERS[name] for name in PACKAGES)):
        assert given & {Path(needed), *Path(needed).parents}, needed


def test_the_image_has_the_dependencies_of_all_commands() -> None:
    extras, = re.findall(r"for name in \(([^)]*)\)", (ROOT / "Dockerfile").read_text())
    complete, = PROJECT["optional-dependencies"]["all"]
    assert re.findall(r"\w+", extras) == re.findall(r"\w+", complete)[1:]


def interpolated(text: str, **variables: str) -> str:
    """The text with `${NAME:-default}` replaced as docker compose does."""
    return re.sub(r"\$\{(\w+):-([^}]*)\}", lambda match: variables.get(match[1]) or match[2], text)


def test_profiles_leave_the_default_as_it_is() -> None:
    services = COMPOSE["services"]
    assert {name for name, service in services.items() if "profiles" not in service} == {"table", "service", "worker"}
    environment = services["worker"]["environment"]
    assert interpolated(environment["SLIPSTICK_JOBS"]) == "sqlite:////data/jobs.sqlite"
    assert interpolated(environment["SLIPSTICK_DASK"]) == ""
    documented = (ROOT / "docs" / "operations.md").read_text()
    variables = dict(re.findall(r"^    ([A-Z_]+)=(\S+)$", documented[documented.index("## Compose profiles"):], re.M))
    assert set(variables["COMPOSE_PROFILES"].split(",")) == {
        profile for service in services.values() for profile in service.get("profiles", ())}
    jobs = make_url(interpolated(environment["SLIPSTICK_JOBS"], **variables))
    database = services["database"]["environment"]
    assert (jobs.host, jobs.username, jobs.database, jobs.password) == (
        "database", database["POSTGRES_USER"], database["POSTGRES_DB"],
        interpolated(database["POSTGRES_PASSWORD"], **variables))
    assert interpolated(environment["SLIPSTICK_DASK"], **variables) in services["dask-worker"]["command"]
    for service in services.values():  # without its profile, nobody waits for a service of another one
        for needed, how in service.get("depends_on", {}).items():
            assert set(services[needed].get("profiles", ())) <= set(service.get("profiles", ())) or not how["required"]


class Containers:
    """The services of the compose file as processes: the volume /data and the image's packages are folders."""

    def __init__(self, folder: Path) -> None:
        self.packages, self.data = folder / "packages", folder / "data"
        with socket.socket() as first, socket.socket() as second:
            for free in (first, second):
                free.bind(("127.0.0.1", 0))
            self.port, self.scheduler_port = (free.getsockname()[1] for free in (first, second))
        for source, target in copied():
            if target.startswith("/data/"):
                place = Path(self.mapped(target))
                place.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / source, place)
        # As the wheel installs them (test_wheel.py), with the machine code, which takes a minute to make again, but
        # without what another process may be writing.
        for package in PACKAGES:
            shutil.copytree(ROOT / FOLDERS[package], self.packages / package,
                            ignore=shutil.ignore_patterns("*.pyc*", "*.tmp.*"))

    def mapped(self, text: str) -> str:
        folders = interpolated(text).replace("/data/", f"{self.data}/")
        folders = folders.replace("/run/secrets/", f"{self.data.parent}/")
        return folders.replace("scheduler:", "127.0.0.1:").replace("8786", str(self.scheduler_port))

    def arguments(self, command: list[str]) -> list[str]:
        module = {"python": [], "slipstick": ["-m", PROJECT["scripts"]["slipstick"].partition(".")[0]]}[command[0]]
        return [sys.executable, *module, *map(self.mapped, command[1:])]

    def surroundings(self, service: str) -> dict[str, Any]:
        given = {name: self.mapped(value) for name, value in COMPOSE["services"][service]["environment"].items()}
        environment = {**os.environ, **given, "SLIPSTICK_HOST": "127.0.0.1", "SLIPSTICK_PORT": str(self.port),
                       "PYTHONPATH": str(self.packages)}
        return {"cwd": self.data, "env": environment}

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


@pytest.mark.slow
def test_the_commands_of_the_dask_profile_simulate_a_table(tmp_path: Path) -> None:
    containers, out = Containers(tmp_path), ("--out", str(tmp_path / "table.h5"))
    build = ["slipstick", "build", "--bench", "/data/tables/heavy.toml"]
    health = COMPOSE["services"]["scheduler"]["healthcheck"]["test"]
    with containers.running("scheduler") as scheduler:
        while containers.run("scheduler", health[1:]) != 0:
            assert scheduler.poll() is None
        with containers.running("dask-worker"):
            assert containers.run("table", [*build, "--dask", "tcp://scheduler:8786"], *SMALL, *out) == 0
    digest = Table.open(tmp_path / "table.h5").digest
    assert containers.run("table", build, *SMALL, *out) == 0
    assert Table.open(tmp_path / "table.h5").digest == digest
