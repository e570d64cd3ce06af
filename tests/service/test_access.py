"""What an attacker tries: other host names, other sites, and slow connections."""

import asyncio
import socket
import time

import httpx
import pytest
from test_problems import POSTS, problem
from uvicorn.protocols.http.flow_control import FlowControl

from service.protocol import Connection
from service.settings import Settings


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "[::1", ""])
def test_other_host_names_are_refused(client: httpx.Client, host: str) -> None:
    problem(client.get("/v1", headers={"Host": host}), 421)
    problem(client.post("/v1/evaluate", json=POSTS["/v1/evaluate"], headers={"Host": host}), 421)


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:8000", "127.0.0.1:1", "[::1]:8000"])
def test_the_host_names_of_the_service_are_accepted(client: httpx.Client, host: str) -> None:
    assert client.get("/v1", headers={"Host": host}).is_success


def test_host_names_are_a_setting(settings: Settings, serving) -> None:
    for hosts, status in (("bench.example, other", 200), ("*", 200), ("other", 421)):
        with serving(settings.model_copy(update={"hosts": hosts})) as address:
            assert httpx.get(f"{address}/v1", headers={"Host": "bench.example"}).status_code == status


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Origin": "null"},
                                     {"Sec-Fetch-Site": "cross-site"}, {"Sec-Fetch-Site": "same-site"}])
def test_requests_from_other_sites_are_refused(client: httpx.Client, headers: dict[str, str]) -> None:
    for path in ("/v1/evaluate", "/v1/fits/none/cancel"):
        problem(client.post(path, json=POSTS["/v1/evaluate"], headers=headers), 403)
    problem(client.delete("/v1/tables/nominal", headers=headers), 403)
    assert client.get("/v1/tables/nominal", headers=headers).is_success  # such as a link


def test_requests_of_the_own_pages_are_accepted(client: httpx.Client, address: str) -> None:
    for headers in ({"Origin": address, "Sec-Fetch-Site": "same-origin"}, {"Sec-Fetch-Site": "none"}):
        assert client.post("/v1/evaluate", json=POSTS["/v1/evaluate"], headers=headers).is_success


@pytest.mark.parametrize("path", ["/v1", "/docs", "/v1/nothing", "/static/swagger/swagger-ui.css"])
def test_every_response_has_security_headers(client: httpx.Client, path: str) -> None:
    headers = client.get(path).headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "Access-Control-Allow-Origin" not in headers


def connect(address: str) -> socket.socket:
    host, port = address.removeprefix("http://").split(":")
    return socket.create_connection((host, int(port)), timeout=10)


def ended(connection: socket.socket) -> bool:
    """Whether the service closes the connection within 8 s after what it has still to send."""
    connection.settimeout(8)
    try:
        while connection.recv(1 << 16):
            pass
        return True
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


def test_slow_clients_are_disconnected(address: str) -> None:  # after the one second of the settings
    with connect(address) as silent, connect(address) as slow, connect(address) as second:
        slow.sendall(b"GET /v1 HTTP/1.1\r\nHo")
        second.sendall(b"GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert second.recv(1 << 16).startswith(b"HTTP/1.1 200")
        second.sendall(b"GET /v1 HTTP/1.1\r\nHo")
        assert all(ended(connection) for connection in (silent, slow, second))


def test_a_client_that_does_not_read_is_disconnected() -> None:
    class Transport(asyncio.Transport):
        aborted = False

        def abort(self) -> None:
            self.aborted = True

    async def write(resumed: bool) -> bool:
        connection = Connection.__new__(Connection)
        connection.seconds, connection.deadline, connection.loop = 0.02, None, asyncio.get_running_loop()
        connection.transport = transport = Transport()
        connection.flow = FlowControl(transport)
        connection.pause_writing()
        if resumed:
            connection.resume_writing()
        await asyncio.sleep(0.1)
        return transport.aborted

    assert asyncio.run(write(resumed=False))
    assert not asyncio.run(write(resumed=True))


def test_a_patient_client_is_served(client: httpx.Client, address: str) -> None:
    with connect(address) as connection:
        for part in (b"GET /v1 HTTP/1.1\r\n", b"Host: 127.0.0.1\r\n", b"\r\n"):
            connection.sendall(part)
            time.sleep(0.1)
        assert connection.recv(1000).startswith(b"HTTP/1.1 200")
