"""Tokens: which request needs which role, who is refused and how, and that no token reaches the file or the log.

The service that shows this as a process has clients that would delay its end.
"""

import asyncio
import hashlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from test_problems import POSTS, problem

from service import tokens as tokens_module
from service.app import create_app
from service.command_line import main
from service.settings import Settings
from service.tokens import ROLES, BadTokens, Tokens, new_token, required_role, tokens_of

EVALUATE = POSTS["/v1/evaluate"]


class Secured:
    """A service with a token of each role."""

    def __init__(self, address: str, file: Path, tokens: dict[str, str]) -> None:
        self.address, self.file, self.tokens = address, file, tokens

    def request(self, method: str, path: str, role: str | None, **options: Any) -> httpx.Response:
        headers = {"Authorization": f"Bearer {self.tokens[role]}"} if role else {}
        return httpx.request(method, f"{self.address}{path}", headers=headers, timeout=30, **options)


@pytest.fixture(scope="module")
def secured(shelf: Path, tmp_path_factory: pytest.TempPathFactory, serving) -> Iterator[Secured]:
    tmp_path = tmp_path_factory.mktemp("secured")
    made = {role: new_token(f"my-{role}", role) for role in ROLES}
    file = tmp_path / "tokens.txt"
    file.write_text("# those of the tests\n\n" + "".join(f"{line}\n" for _, line in made.values()))
    with serving(Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite", tokens=file)) as address:
        yield Secured(address, file, {role: token for role, (token, _) in made.items()})


@pytest.mark.parametrize(("method", "path", "body", "needed"), [
    ("GET", "/v1/health", None, None), ("GET", "/docs", None, None), ("GET", "/openapi.json", None, None),
    ("GET", "/static/swagger/swagger-ui.css", None, None), ("GET", "/v1", None, "read"),
    ("GET", "/v1/tables", None, "read"), ("HEAD", "/v1/tables", None, "read"), ("OPTIONS", "/v1/fits", None, "read"),
    ("GET", "/v1/nowhere", None, "read"), ("GET", "/docs/../v1/tables", None, "read"),
    ("POST", "/v1/evaluate", EVALUATE, "run"), ("POST", "/v1/health", {}, "run"),
    ("POST", "/v1/fits/none/cancel", None, "run"), ("DELETE", "/v1/fits/none", None, "run"),
    ("DELETE", "/v1/tables/none", None, "admin"), ("DELETE", "/v1/recordings/none", None, "admin"),
    *(("PATCH", f"/v1/{kind}/none", {"name": "new"}, "admin") for kind in ("tables", "recordings", "benches"))])
def test_every_role_may_do_what_it_includes(secured: Secured, method: str, path: str, body: object,
                                            needed: str | None) -> None:
    for number, role in enumerate((None, *ROLES)):
        response = secured.request(method, path, role, json=body)
        assert (response.status_code == 401) == (role is None and needed is not None), (role, response.text)
        refused = role is not None and needed is not None and ROLES.index(needed) > number - 1
        assert (response.status_code == 403) == refused, (role, response.text)
        if refused:
            assert f"needs the role {needed}; the token 'my-{role}' has the role {role}" in response.text


def test_every_operation_states_its_role_and_enforces_it(secured: Secured) -> None:
    document = httpx.get(f"{secured.address}/openapi.json").json()
    assert set(document["components"]["securitySchemes"]) == {"bearer", "basic"}
    seen = set()
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            role = required_role(method.upper(), path)
            assert operation["security"] == ([{"bearer": [role]}, {"basic": [role]}] if role else [])
            assert ("401" in operation["responses"]) == (role is not None)
            assert role is None or operation["description"].endswith(f"Role: `{role}`.")
            answer = secured.request(method.upper(), path, None)
            # Without body, an operation of UM-Bridge finds no model.
            open_statuses = (200, 400) if path.startswith("/umbridge/") else (200,)
            assert answer.status_code in ((401,) if role else open_statuses), (method, path)
            lower = {"run": "read", "admin": "run"}.get(role or "")
            assert lower is None or secured.request(method.upper(), path, lower).status_code == 403
            seen.add(role)
    assert seen == {None, *ROLES}


@pytest.mark.parametrize("header", ["", "Bearer", "Bearer x", "Bearer \xff", "Basic", "Basic !", "Basic eA==",
                                    "Basic /zo=", "Digest x", "TOKEN", "bearer TOKEN TOKEN", "Bearer  DIGEST"])
def test_what_is_no_token_is_refused(secured: Secured, header: str) -> None:
    token = secured.tokens["admin"]
    header = header.replace("TOKEN", token).replace("DIGEST", hashlib.sha256(token.encode()).hexdigest())
    answer = httpx.get(f"{secured.address}/v1", headers=[(b"Authorization", header.encode("latin-1"))])
    assert "Bearer TOKEN" in problem(answer, 401)["remedy"]
    assert [value for name, value in answer.headers.multi_items() if name == "www-authenticate"] == [
        'Bearer realm="slipstick"', 'Basic realm="slipstick"']
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_um_bridge_needs_no_token_on_this_machine(secured: Secured) -> None:
    body = {"name": "nominal", "input": [[1.0, 1.0]], "config": {"conditions": [0]}}
    for role in (None, "read"):
        assert len(secured.request("POST", "/umbridge/Evaluate", role, json=body).json()["output"][0]) == 1
    for path, status in (("/umbridge", 401), ("/umbridgeInfo", 401), ("/umbridge/%2e%2e/v1/tables", 404)):
        assert secured.request("GET", path, None).status_code == status, path


def test_um_bridge_answers_no_other_machine_whatever_its_token(secured: Secured, shelf: Path, tmp_path: Path) -> None:
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite", tokens=secured.file)

    async def answers(path: str) -> list[tuple[int, str]]:
        application, found = create_app(settings), []
        headers = {"Authorization": f"Bearer {secured.tokens['admin']}"}
        for host in ("127.0.0.1", "192.0.2.7"):
            transport = httpx.ASGITransport(application, client=(host, 4321))
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1", headers=headers) as client:
                answer = await client.get(path)
                found.append((answer.status_code, answer.json().get("error", {}).get("type", "")))
        return found

    assert asyncio.run(answers("/umbridge/Info")) == [(200, ""), (403, "NotLocal")]
    assert asyncio.run(answers("/v1/tables")) == [(200, ""), (200, "")]


def test_the_password_of_a_browser_is_a_token(secured: Secured) -> None:
    for user in ("", "anybody"):
        assert httpx.get(f"{secured.address}/v1/fits", auth=(user, secured.tokens["read"])).is_success
    assert httpx.get(f"{secured.address}/v1/fits", auth=(secured.tokens["read"], "")).status_code == 401


def test_a_body_without_token_is_not_read(secured: Secured) -> None:
    host, port = secured.address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=10) as connection:
        connection.sendall(b"POST /v1/evaluate HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 60000000\r\n\r\n{")
        assert connection.recv(1000).startswith(b"HTTP/1.1 401")


def test_a_deleted_line_ends_its_token_and_a_damaged_file_ends_all(secured: Secured) -> None:
    text = secured.file.read_text()
    secured.file.write_text("\n".join(line for line in text.splitlines() if not line.startswith("my-run")))
    assert secured.request("GET", "/v1", "run").status_code == 401
    assert secured.request("GET", "/v1", "read").is_success
    secured.file.write_text("alice run secret\n")
    answer = secured.request("GET", "/v1", "read")
    assert "cannot read its tokens" in problem(answer, 503)["detail"]
    assert "secret" not in answer.text
    secured.file.unlink()
    problem(secured.request("GET", "/v1", "read"), 503)
    secured.file.write_text(text)
    assert secured.request("GET", "/v1", "run").is_success


def test_digests_are_compared_in_constant_time_with_every_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = [new_token(f"n{number}", "read") for number in range(3)]
    (tmp_path / "tokens").write_text("\n".join(line for _, line in made))
    compared: list[bytes] = []
    compare = tokens_module.hmac.compare_digest
    monkeypatch.setattr(tokens_module.hmac, "compare_digest", lambda *pair: compared.append(pair[0]) or compare(*pair))
    caller = Tokens(tmp_path / "tokens").caller(f"Bearer {made[0][0]}")
    assert caller is not None
    assert (caller.name, len(compared)) == ("n0", 3)


@pytest.mark.parametrize(("host", "tokens", "starts"), [
    ("127.0.0.1", None, True), ("127.9.9.9", None, True), ("::1", None, True), ("localhost", None, True),
    ("0.0.0.0", None, False), ("::", None, False), ("192.168.0.7", None, False), ("bench.example", None, False),
    ("", None, False), ("0.0.0.0", "off", True), ("0.0.0.0", "valid", True), ("127.0.0.1", "missing", False),
    ("127.0.0.1", "invalid", False)])
def test_without_tokens_only_the_loopback_address_is_served(tmp_path: Path, host: str, tokens: str | None,
                                                            starts: bool) -> None:
    (tmp_path / "valid").write_text(new_token("alice", "read")[1])
    (tmp_path / "invalid").write_text("alice owner " + 64 * "0")
    given = tokens if tokens in (None, "off") else tmp_path / tokens
    if starts:
        assert (tokens_of(Settings(host=host, tokens=given)) is None) == (tokens in (None, "off"))
    else:
        with pytest.raises(BadTokens):
            tokens_of(Settings(host=host, tokens=given))


def test_a_service_with_a_token_of_the_command_logs_its_name_only_and_ends_whatever_clients_do(
        shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["service", "token", "alice", "run"])
    assert main() == 0
    made = capsys.readouterr()
    token = made.err.split()[-1]
    assert token not in made.out
    (tmp_path / "tokens").write_text(made.out)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    environment = {**os.environ, "SLIPSTICK_TABLES": str(shelf), "SLIPSTICK_JOBS": f"sqlite:///{tmp_path}/jobs.sqlite",
                   "SLIPSTICK_PORT": str(port), "SLIPSTICK_HOST": "0.0.0.0", "SLIPSTICK_TOKENS": f"{tmp_path}/tokens"}
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen([sys.executable, "-m", "service"], env=environment, stdout=log, stderr=log)
        try:
            address = f"http://127.0.0.1:{port}/v1"
            while True:
                try:
                    httpx.get(f"{address}/health").raise_for_status()
                    break
                except httpx.TransportError:
                    assert process.poll() is None
                    time.sleep(0.05)
            assert httpx.get(address, headers={"Authorization": f"Bearer {token}"}).is_success
            assert httpx.get(address, headers={"Authorization": f"Bearer {token}x"}).status_code == 401
            here = "127.0.0.1", port
            with socket.create_connection(here), socket.create_connection(here) as sending:
                sending.sendall("POST /v1/evaluate HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n"
                                f"Authorization: Bearer {token}\r\n\r\n{{".encode())
                time.sleep(0.2)
                process.terminate()
                assert process.wait(timeout=5) in (0, -signal.SIGTERM)
        finally:
            process.kill()
    written = (tmp_path / "log").read_text()
    assert 'alice@127.0.0.1:' in written
    assert token not in written


def test_the_command_does_not_serve_without_its_token_file(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["service"])
    monkeypatch.setenv("SLIPSTICK_TOKENS", f"{tmp_path}/nowhere")
    monkeypatch.setenv("SLIPSTICK_PORT", "0")  # a service may run on the usual port
    assert main() == 1
    error = capsys.readouterr().err
    assert error.startswith(f"error: The token file '{tmp_path}/nowhere' cannot be read")
    assert error.count("\n") == 1


def test_a_name_with_other_characters_is_refused() -> None:
    for name in ("", "a b", "-x", "a\nb", 65 * "a"):
        with pytest.raises(BadTokens):
            new_token(name, "read")
