"""The demo: what it refuses, how it stops what it started, and once as a whole with the commands that it prints."""

import os
import re
import shlex
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from worker.__main__ import command_parser, main
from worker.demo import RUN, Demo, is_running

ROOT = Path(__file__).parents[2]


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty folder, from which `worker` is imported as from a checkout."""
    monkeypatch.chdir(tmp_path)
    for name in [name for name in os.environ if name.startswith("SLIPSTICK_")]:
        monkeypatch.delenv(name)  # as the demo does
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


@pytest.mark.parametrize(("options", "message"), [
    (["--port", "99999"], "The port is 99999. Give a number from 1 to 65535."),
    (["--bench", "compact"], "There is no file tables/measured-compact.h5. Leave --bench out: recordings of other "
                             "benches are in the repository of Slipstick only.")])
def test_what_it_cannot_do_is_refused_before_anything_runs(options: list[str], message: str,
                                                          capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", *options]) == 1
    shown = capsys.readouterr()
    assert shown.err.splitlines()[-1] == f"error: {message}"
    assert "$ python -m worker build" not in shown.out


def test_a_port_in_use_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert main(["demo", "--port", str(taken.getsockname()[1])]) == 1
    assert "with `make demo` by the environment variable SLIPSTICK_PORT" in capsys.readouterr().err


def test_a_folder_without_the_shipped_files_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine" / "tables").mkdir(parents=True)
    (tmp_path / "mine" / "tables" / "mine.toml").touch()
    assert main(["demo", "--folder", "mine"]) == 1
    assert "There is no file tables/heavy.toml. Give the name of a new folder" in capsys.readouterr().err


def test_it_stops_what_it_started(tmp_path: Path, port: int, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tables").mkdir()
    demo = Demo("heavy", port)
    demo.start()
    assert demo.is_up()
    assert is_running(RUN / "serve.pid")
    assert main(["demo", "--stop"]) == 0
    assert "Stopped the service and the worker" in capfd.readouterr().out
    assert not demo.is_up()
    assert not is_running(RUN / "serve.pid")
    assert main(["demo", "--stop"]) == 0  # nothing is left to stop
    assert "No demo is running" in capfd.readouterr().out


@pytest.mark.slow
def test_the_whole_demo_in_a_new_folder(tmp_path: Path, port: int) -> None:
    """With the settings of another service in the environment, which must not matter."""
    environment = {**os.environ, "SLIPSTICK_TABLES": str(tmp_path / "other"), "SLIPSTICK_TOKENS": "tokens.txt",
                   "SLIPSTICK_JOBS": f"sqlite:///{tmp_path}/other.sqlite"}
    ran = subprocess.run([sys.executable, "-m", "worker", "demo", "--port", str(port)], env=environment, check=False,
                         capture_output=True, text=True)
    stopped = subprocess.run([sys.executable, "-m", "worker", "demo", "--stop"], capture_output=True, text=True,
                             check=True)
    assert ran.returncode == 0, ran.stderr
    assert stopped.stdout == "Stopped the service and the worker\n"
    text = ran.stdout
    places = [text.index(words) for words in ("less than a minute", "$ cd slipstick-demo", "$ python -m worker build")]
    assert places == sorted(places)
    assert "Missing: slip-speed-dependent friction" in text
    assert re.search(r"^  together +\d+\.\d s$", text, re.MULTILINE)
    assert text.rstrip().endswith("Stop them with: python -m worker demo --stop")
    assert {path.name for path in tmp_path.iterdir()} == {"slipstick-demo"}
    written = {path.name for path in (tmp_path / "slipstick-demo" / "tables").iterdir()}
    assert written == {"heavy.toml", "compact.toml", "sample.h5", "nominal.h5", "calibrated.h5", "study-before.h5",
                       "study-after.h5"}
    typed = [shlex.split(line.removesuffix("&"))[3:] for line in re.findall(r"^\$ (python -m worker .*)", text, re.M)]
    assert [words[0] for words in typed] == ["build", "serve", "calibrate", "build", "build", "build"]
    for words in typed:
        command_parser(words[0]).parse_args(words[1:])
