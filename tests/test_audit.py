"""The audit of dependencies: it fails for a known vulnerability, and says so where no database can be asked."""

import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
KNOWN = {"id": "GHSA-0000-test", "modified": "2026-01-01T00:00:00Z", "details": "Anything goes.", "affected": [
    {"package": {"name": "clutchlib", "ecosystem": "PyPI"},
     "ranges": [{"type": "ECOSYSTEM", "events": [{"introduced": "0"}, {"fixed": "1.5"}]}]}]}


class Database(BaseHTTPRequestHandler):
    """A database of the OSV protocol that knows one vulnerability."""

    def do_POST(self) -> None:
        asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        is_known = asked["package"]["name"] == "clutchlib" and asked["version"] == "1.4"
        self.send_response(200)
        self.end_headers()
        self.wfile.write(json.dumps({"vulns": [KNOWN]} if is_known else {}).encode())

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture
def database() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), Database)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/v1/query"
    server.shutdown()
    server.server_close()


def audited(folder: Path, requirement: str, database: str) -> subprocess.CompletedProcess[str]:
    (folder / "requirements.txt").write_text(f"{requirement}\n")
    options = ("--requirement", "requirements.txt", "--no-deps", "--disable-pip", "-s", "osv", "--osv-url", database)
    return subprocess.run([sys.executable, str(ROOT / ".ci" / "audit.py"), *options], cwd=folder, text=True,
                          capture_output=True, check=False)


def test_a_known_vulnerability_fails_and_its_remedy_is_named(tmp_path: Path, database: str) -> None:
    ran = audited(tmp_path, "clutchlib==1.4", database)
    assert "clutchlib 1.4: GHSA-0000-test, fixed in 1.5" in ran.stdout, ran
    assert ran.returncode == 1
    fixed = audited(tmp_path, "clutchlib==1.5", database)
    assert (fixed.returncode, fixed.stdout) == (0, "1 packages audited, 0 with known vulnerabilities\n"), fixed


def test_without_a_database_nothing_fails_but_it_is_said(tmp_path: Path) -> None:
    ran = audited(tmp_path, "clutchlib==1.4", "http://127.0.0.1:9/v1/query")
    assert ran.returncode == 0, ran
    assert "NOT AUDITED" in ran.stdout
    assert "--osv-url" in ran.stdout  # which database was tried


def test_continuous_integration_audits() -> None:
    assert "make audit" in (ROOT / ".ci" / "run").read_text()
    assert "audit.py" in (ROOT / "Makefile").read_text()
