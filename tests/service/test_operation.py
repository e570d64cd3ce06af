"""What an administrator watches: liveness, readiness with causes, metrics, request ids, and the log."""

import json
import logging
import os
import re
import socket
import sys
import time
from pathlib import Path
from typing import Any

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families
from test_problems import problem

from service import request_ids
from service.logs import JsonLines, LogFormat, Text
from service.server import make_server
from service.settings import Settings
from service.tokens import new_token


@pytest.fixture
def client(own_client: httpx.Client) -> httpx.Client:
    return own_client


def samples(client: httpx.Client) -> dict[tuple[str, ...], float]:
    """The values of the metrics by name and labels."""
    answer = client.get("/metrics")
    assert answer.headers["Content-Type"].startswith("text/plain; version=0.0.4")
    return {(sample.name, *sample.labels.values()): sample.value
            for family in text_string_to_metric_families(answer.text) for sample in family.samples}


def test_a_service_without_its_folder_lives_but_is_not_ready(client: httpx.Client, folder: Path) -> None:
    assert client.get("/v1/live").json()["status"] == "live"
    assert client.get("/v1/ready").json() == {"status": "ready", "workers": 0}
    assert sorted(path.name for path in (folder / "tables").iterdir()) == ["heavy.toml", "measured.h5", "nominal.h5"]
    (folder / "tables").rename(folder / "moved")
    for path in ("/v1/ready", "/v1/tables", "/v1/benches/heavy", "/v1/recordings/measured", "/", "/find"):
        assert "does not exist" in problem(client.get(path), 503)["detail"], path
    (folder / "tables").write_text("a file")
    problem(client.get("/v1/ready"), 503)
    assert client.get("/v1/live").is_success


def test_a_service_without_its_jobs_is_not_ready_and_names_all_causes(client: httpx.Client, folder: Path) -> None:
    (folder / "jobs.sqlite").write_bytes(b"no database" * 1000)
    for name in ("-wal", "-shm"):
        (folder / f"jobs.sqlite{name}").unlink(missing_ok=True)
    assert "job database does not respond" in problem(client.get("/v1/ready"), 503)["detail"]
    (folder / "tables").rename(folder / "moved")
    found = problem(client.get("/v1/ready"), 503)["detail"]
    assert "job database does not respond" in found
    assert "does not exist" in found
    assert client.get("/v1/live").is_success
    assert samples(client)[("slipstick_jobs_up",)] == 0


def test_workers_are_required_only_if_asked_for(client: httpx.Client) -> None:
    assert "0 of 1 workers" in problem(client.get("/v1/ready?workers=1"), 503)["detail"]
    assert client.get("/v1/ready?workers=0").is_success


def test_a_folder_that_cannot_be_written_is_not_ready(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("service.routes.operation.tempfile.TemporaryFile", full)
    assert "No space left" in problem(client.get("/v1/ready"), 503)["detail"]


def test_metrics_count_requests_by_route_and_status(client: httpx.Client) -> None:
    for path in ("/v1/tables/nominal", "/v1/tables/none", "/v1/nowhere/a", "/v1/nowhere/b", "/wp-login.php"):
        client.get(path)
    client.head("/v1/tables/nominal")
    client.request("BREW", "/v1")
    found = samples(client)
    counted = {key[1:]: value for key, value in found.items() if key[0] == "slipstick_requests_total"}
    assert counted == {("GET", "/v1/tables/{name}", "200"): 1, ("GET", "/v1/tables/{name}", "404"): 1,
                       ("HEAD", "/v1/tables/{name}", "200"): 1, ("GET", "other", "404"): 3, ("other", "/v1", "405"): 1}
    assert found[("slipstick_request_seconds_count", "/v1/tables/{name}")] == 3
    assert found[("slipstick_request_seconds_bucket", "+Inf", "/v1/tables/{name}")] == 3


def test_metrics_count_jobs_workers_and_places(client: httpx.Client) -> None:
    for address in ("/v1/fits", "/v1/studies", "/v1/studies"):
        job = client.post(address, json={}).json()["links"]["self"]
    client.post(f"{job}/cancel")
    client.get("/v1/fits/none/events")
    with client.stream("GET", "/events") as stream:
        lines = stream.iter_lines()
        next(lines)
        found = samples(client)
    expected = {("slipstick_jobs", "fit", "queued"): 1, ("slipstick_jobs", "study", "queued"): 1,
                ("slipstick_jobs", "study", "cancelled"): 1, ("slipstick_jobs", "study", "done"): 0,
                ("slipstick_queue_jobs", "short"): 1, ("slipstick_queue_jobs", "long"): 1,
                ("slipstick_queue_jobs", "machine"): 0, ("slipstick_workers",): 0,
                ("slipstick_followers",): 1, ("slipstick_computations_running",): 0,
                ("slipstick_computations_limit",): 2, ("slipstick_jobs_up",): 1}
    assert {key: found[key] for key in expected} == expected


def test_metrics_and_the_front_page_need_the_role_read(shelf: Path, tmp_path: Path, serving: Any) -> None:
    token, line = new_token("prometheus", "read")
    (tmp_path / "tokens").write_text(line)
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite", tokens=tmp_path / "tokens")
    with serving(settings) as address:
        for path in ("/metrics", "/"):
            refused = httpx.get(address + path)
            assert "Basic" in refused.headers.get_list("WWW-Authenticate")[1]  # so that a browser asks for the token
            problem(refused, 401)
            assert httpx.get(address + path, auth=("anybody", token)).is_success
        for path in ("/v1/live", "/v1/ready"):
            assert httpx.get(address + path).is_success


@pytest.mark.parametrize(("given", "kept"), [
    ("abc-1.2_3", True), ("a" * 64, True), ("a" * 65, False), ("a b", False), ('"x"', False), ("", False),
    (None, False)])
def test_every_response_and_problem_has_the_id_of_its_request(client: httpx.Client, given: str | None,
                                                              kept: bool) -> None:
    headers = {} if given is None else {"X-Request-ID": given}
    for path, status in (("/v1", 200), ("/v1/tables/none", 404), ("/nowhere", 404), ("/docs", 200)):
        answer = client.get(path, headers=headers)
        id = answer.headers["X-Request-ID"]
        assert (id == given) == kept
        assert kept or re.fullmatch("[0-9a-f]{32}", id)
        assert answer.headers.get_list("X-Request-ID") == [id]
        assert answer.status_code == status
        assert status == 200 or answer.json()["request_id"] == id
    refused = client.get("/v1", headers={**headers, "Host": "evil.example"})
    assert refused.json()["request_id"] == refused.headers["X-Request-ID"]


def test_bytes_that_are_no_request_have_an_id(client: httpx.Client) -> None:
    with socket.create_connection((client.base_url.host, client.base_url.port), timeout=10) as connection:
        connection.sendall(b"nonsense\r\n\r\n")
        with connection.makefile("rb") as answer:
            head, _, body = answer.read().partition(b"\r\n\r\n")
    assert f"x-request-id: {json.loads(body)['request_id']}" in head.decode().lower()


def test_the_log_has_an_entry_for_each_request(client: httpx.Client, caplog: pytest.LogCaptureFixture,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logging.getLogger("slipstick"), "propagate", True)
    lines: list[str] = []

    class Collected(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.extend(form.format(record) for form in (JsonLines(), Text()))

    handler = Collected()
    logging.getLogger("slipstick").addHandler(handler)
    monkeypatch.setattr(logging.getLogger("slipstick.access"), "level", logging.INFO)
    try:
        client.get("/v1/tables/a%0ab?secret=1", headers={"X-Request-ID": "mine"})
        deadline = time.monotonic() + 20
        while len(lines) < 2 and time.monotonic() < deadline:  # the entry comes after the response
            time.sleep(0.01)
    finally:
        logging.getLogger("slipstick").removeHandler(handler)
    entry, text = json.loads(lines[0]), lines[1]
    assert {name: entry[name] for name in ("level", "logger", "request_id", "method", "path", "status")} == {
        "level": "info", "logger": "slipstick.access", "request_id": "mine", "method": "GET",
        "path": "/v1/tables/a%0ab", "status": 422}
    assert entry["client"].startswith("127.0.0.1:")
    assert entry["seconds"] > 0
    assert re.search(r" INFO    127\.0\.0\.1:\d+ GET /v1/tables/a%0ab \d+ \d+ ms \[mine\]$", text)
    assert "secret" not in "".join(lines)


def test_an_error_in_the_log_has_its_traceback_and_id() -> None:
    request_ids.current.set("mine")
    try:
        raise ZeroDivisionError("never")
    except ZeroDivisionError as error:
        record = logging.LogRecord("uvicorn.error", logging.ERROR, "", 0, "Unexpected\nerror", (),
                                   (type(error), error, error.__traceback__))
    entry = json.loads(JsonLines().format(record))
    assert (entry["message"], entry["request_id"]) == ("Unexpected\nerror", "mine")
    assert "ZeroDivisionError: never" in entry["traceback"]
    text = Text().format(record)
    assert "Unexpected\\nerror [mine]\nTraceback" in text
    request_ids.current.set(None)


@pytest.mark.parametrize(("terminal", "stated", "form"), [
    (True, None, Text), (False, None, JsonLines), (True, "json", JsonLines), (False, "text", Text),
])
def test_the_log_is_text_on_a_terminal_unless_a_setting_says_otherwise(
        terminal: bool, stated: LogFormat | None, form: type, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = os.openpty()
    with os.fdopen(ours), os.fdopen(theirs, "w") as screen, (tmp_path / "log").open("w") as file:
        monkeypatch.setattr(sys, "stderr", screen if terminal else file)
        make_server(Settings(tables=tmp_path, jobs=f"sqlite:///{tmp_path}/jobs.sqlite", log=stated))
        handler, = logging.getLogger("slipstick").handlers
        assert isinstance(handler.formatter, form)
