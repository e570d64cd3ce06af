"""`python -m service --help` is complete: every setting with its default, every command, and examples that work."""

import gc
import re
import socket
import sys
from pathlib import Path

import pytest

from service.command_line import main
from service.settings import Settings
from slipstick import __version__


def printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    monkeypatch.setattr(sys, "argv", ["service", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    return capsys.readouterr().out


def test_help_has_every_setting(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(monkeypatch, capsys, "--help")
    found = dict(re.findall(r"^  SLIPSTICK_(\w+)(?: = (.*))?$", text, re.MULTILINE))
    assert found == {name.upper(): "" if field.default is None else str(field.default)
                     for name, field in Settings.model_fields.items()}
    words = " ".join(text.split())
    assert all(" ".join((field.description or "-").split()) in words for field in Settings.model_fields.values())
    assert max(len(line) for line in text.splitlines()) <= 110
    for said in ("http://127.0.0.1:8000/docs", "token", "slipstick work", "docs/operations.md", "--version"):
        assert said in text


def test_help_has_the_address_of_the_settings(monkeypatch: pytest.MonkeyPatch,
                                              capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("SLIPSTICK_PORT", "9123")
    monkeypatch.setenv("SLIPSTICK_HOST", "::")
    assert "http://[::1]:9123/docs" in printed(monkeypatch, capsys, "--help")
    monkeypatch.setenv("SLIPSTICK_PORT", "eighty")
    assert "http://127.0.0.1:8000/docs" in printed(monkeypatch, capsys, "--help")


def test_the_examples_name_settings_that_exist(monkeypatch: pytest.MonkeyPatch,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    examples = printed(monkeypatch, capsys, "--help").partition("examples:")[2]
    named = set(re.findall(r"SLIPSTICK_(\w+)=", examples))
    assert named
    assert named <= {name.upper() for name in Settings.model_fields}


def test_version_and_help_of_the_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(monkeypatch, capsys, "--version") == f"Slipstick {__version__}\n"
    text = printed(monkeypatch, capsys, "token", "--help")
    assert "{read,run,admin}" in text
    assert ">> tokens.txt" in text


def test_an_invalid_setting_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["service"])
    monkeypatch.setenv("SLIPSTICK_PORT", "eighty")
    monkeypatch.setenv("SLIPSTICK_LOG", "xml")
    assert main() == 1
    error = capsys.readouterr().err
    assert [line.split()[1] for line in error.splitlines()] == ["SLIPSTICK_PORT", "SLIPSTICK_LOG"]


def test_a_port_in_use_is_an_error_in_one_line(monkeypatch: pytest.MonkeyPatch,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        monkeypatch.setenv("SLIPSTICK_PORT", port)
        monkeypatch.setattr(sys, "argv", ["service"])
        assert main() == 1
    error = capsys.readouterr().err
    assert f"port {port}: Address already in use. Set SLIPSTICK_PORT" in error
    assert len(error.splitlines()) == 1


def test_an_unknown_command_is_refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["service", "srve"])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "token" in capsys.readouterr().err


def test_the_process_is_prepared_for_many_requests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prepared: list[tuple[bool, bool]] = []
    usual = sys.getswitchinterval()

    class Server:
        def run(self) -> None:
            prepared.append((gc.get_freeze_count() > 10_000, sys.getswitchinterval() < usual))

    monkeypatch.setattr("service.server.make_server", lambda _: Server())
    monkeypatch.setattr(sys, "argv", ["service"])
    monkeypatch.setenv("SLIPSTICK_JOBS", f"sqlite:///{tmp_path}/jobs.sqlite")
    monkeypatch.setenv("SLIPSTICK_PORT", "0")  # a service may run on the usual port
    try:
        assert main() == 0
    finally:
        gc.unfreeze()
        sys.setswitchinterval(usual)
    assert prepared == [(True, True)]
