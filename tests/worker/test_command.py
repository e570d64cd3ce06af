"""The command: help, version, commands that do not exist, extras that are missing, and the service that it starts."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from slipstick import __version__
from worker.__main__ import COMMANDS, GROUPS, command_parser, main

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_help(name: str) -> None:
    text = command_parser(name).format_help()
    assert text.startswith(f"usage: python -m worker {name}")
    assert "".join(COMMANDS[name].split()) in "".join(text.split())


def test_the_help_has_every_command_in_its_group_and_loads_nothing_that_takes_time() -> None:
    code = "import sys; from worker.__main__ import main\ntry: main(['--help'])\nfinally: print(sorted(sys.modules))"
    text = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for group, commands in GROUPS.items():
        assert f"\n{group}:\n" in text
        for name, description in commands.items():
            assert re.search(rf"^  {name} +{re.escape(description)}$", text, re.MULTILINE)
    for library in ("numpy", "numba", "scipy", "h5py", "dbos"):
        assert f"'{library}'" not in text


def test_version_and_unknown_commands(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"Slipstick {__version__}\n"
    with pytest.raises(SystemExit, match="2"):
        main(["stdy"])
    refused = capsys.readouterr().err
    assert "There is no command 'stdy'. Did you mean 'study'? Known: bench, build, " in refused
    assert "serve-jobs" not in refused  # the former name of `work`, which goes on working


def test_without_a_command_it_shows_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "first steps:" in capsys.readouterr().out


@pytest.mark.parametrize(("text", "seconds"), [("90", 90.0), ("1e3", 1000.0), ("2 min", 120.0)])
def test_a_time_budget_is_seconds_or_has_a_unit(text: str, seconds: float) -> None:
    for name in ("study", "calibrate"):
        words = [*(["sample"] if name == "study" else []), "--time-budget", text]
        assert command_parser(name).parse_args(words).time_budget == seconds


@pytest.mark.parametrize(("text", "remedy"), [
    ("soon", "Give seconds, or a text such as"), ("nan", "Give seconds, or a text such as"),
    ("2 m", "Give seconds, or a text such as"), ("-1", "Give 0 s or more")])
def test_a_time_budget_that_is_no_time_is_refused(text: str, remedy: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["study", "sample", f"--time-budget={text}"])
    assert remedy in capsys.readouterr().err


@pytest.mark.parametrize(("library", "command", "extra"), [
    ("dbos", "work", "service"), ("vl_convert", "study sample --report OUT/study.html", "reports")])
def test_a_missing_extra_is_named_with_its_remedy(library: str, command: str, extra: str, tmp_path: Path) -> None:
    code = f"""if True:
        import importlib.util, sys
        class Blocker:
            def find_spec(self, name, path=None, target=None):
                if name == {library!r}:
                    raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
        sys.meta_path.insert(0, Blocker())
        found = importlib.util.find_spec
        importlib.util.find_spec = lambda name, *rest: None if name == {library!r} else found(name, *rest)
        from worker.__main__ import main
        sys.exit(main({command.replace("OUT", str(tmp_path)).split()!r}))
    """
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert re.fullmatch(rf"error: .*pip install 'slipstick\[{extra}\]'.*\n", done.stderr), done.stderr


def test_help_and_completion_need_no_extra() -> None:
    extras = ("asammdf", "dbos", "distributed", "fastapi", "orjson", "pyarrow", "pydantic", "sqlalchemy", "vl_convert")
    code = f"""if True:
        import sys
        sys.modules.update(dict.fromkeys({extras!r}))  # importing them raises ImportError
        from worker.__main__ import COMMANDS, command_parser, main
        main(["completion", "bash"])
        for name in COMMANDS:
            command_parser(name).print_help()
    """
    text = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in COMMANDS:
        assert f"usage: python -m worker {name}" in text


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


WORDS = ("serve", "--jobs", "sqlite:///jobs.sqlite", "--tables", "new/tables", "--no-compile")
IDLE = """if True:
    import sys
    from worker import serve
    from worker.__main__ import command
    serve.SERVICE, serve.PACKAGE = "idle_service", "idle_worker"
    command()
"""


def start(tmp_path: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(words, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdin=subprocess.DEVNULL,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def serving(tmp_path: Path, port: int) -> subprocess.Popen[str]:
    process = start(tmp_path, sys.executable, "-m", "worker", *WORDS, "--with-worker", "--port", str(port))
    for _ in range(300):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/v1/health", timeout=5) as response:
                if b'"workers":1' in response.read():
                    return process
        except OSError:
            assert process.poll() is None, process.stderr and process.stderr.read()
        time.sleep(0.1)
    raise TimeoutError


def idling(tmp_path: Path, *options: str, before: tuple[str, ...] = (), service: str = "time.sleep(60)"
           ) -> subprocess.Popen[str]:
    """The same with two programs that do nothing, instead of service and worker, which take seconds to start."""
    for name, code in (("service", service), ("worker", "time.sleep(60)")):
        (tmp_path / f"idle_{name}.py").write_text(
            f"import os, pathlib, time\npathlib.Path('{name}').write_text(str(os.getpid()))\n{code}\n")
    process = start(tmp_path, *before, sys.executable, "-c", IDLE, *WORDS, *options)
    for name in ("service", *(["worker"] if "--with-worker" in options else [])):
        number_of(tmp_path, name)
    return process


def number_of(tmp_path: Path, name: str) -> int:
    """The number of the process of an idle program, when it runs."""
    for _ in range(3000):
        if (path := tmp_path / name).exists() and (number := path.read_text()):
            return int(number)
        time.sleep(0.01)
    raise TimeoutError


def children(process: subprocess.Popen[str]) -> list[int]:
    return children_of(process.pid)


def children_of(number: int) -> list[int]:
    listed = [path.read_text().split() for path in Path(f"/proc/{number}/task").glob("*/children")]
    return sorted(int(child) for entries in listed for child in entries)


def descendants(number: int) -> list[int]:
    return [entry for child in children_of(number) for entry in (child, *descendants(child))]


def is_running(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return "\nState:\tZ" not in Path(f"/proc/{number}/status").read_text()


def test_service_and_worker_start_in_a_new_folder_and_end_together(tmp_path: Path, port: int) -> None:
    process = serving(tmp_path, port)
    programs = children(process)
    assert len(programs) == 2
    helpers = [helper for program in programs for helper in descendants(program)]
    assert helpers  # of the worker
    assert sorted(path.name for path in (tmp_path / "new" / "tables").iterdir()) == [
        "compact.toml", "heavy.toml", "sample.h5"]
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert said.startswith("Put heavy.toml, compact.toml, sample.h5 into the folder new/tables\n")
    assert not any(is_running(program) for program in programs)
    end = time.monotonic() + 10
    while any(map(is_running, helpers)):
        assert time.monotonic() < end
        time.sleep(0.05)


def test_both_go_on_without_their_terminal_until_they_are_ended(tmp_path: Path) -> None:
    process = idling(tmp_path, "--with-worker", before=("nohup",))
    programs = children(process)
    assert programs == sorted((number_of(tmp_path, "service"), number_of(tmp_path, "worker")))
    process.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(timeout=1)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=30)
    assert process.returncode == 0
    assert not any(is_running(program) for program in programs)


def test_when_one_of_both_ends_the_other_does_too(tmp_path: Path) -> None:
    process = idling(tmp_path, "--with-worker")
    os.kill(number_of(tmp_path, "service"), signal.SIGKILL)
    _, said = process.communicate(timeout=30)
    assert "The service was ended by SIGKILL, and the other program ends with it" in said
    assert process.returncode == 128 + signal.SIGKILL
    assert not is_running(number_of(tmp_path, "worker"))


def test_a_service_that_cannot_start_leaves_no_worker(tmp_path: Path) -> None:
    refused = "while not pathlib.Path('worker').exists():\n    time.sleep(0.01)\nraise SystemExit(1)"
    process = idling(tmp_path, "--with-worker", service=refused)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "Traceback" not in said
    assert not is_running(number_of(tmp_path, "worker"))


def test_the_service_alone_is_the_process_of_the_command(tmp_path: Path) -> None:
    process = idling(tmp_path, "--port", "1")
    assert process.pid == number_of(tmp_path, "service")
    assert b"idle_service" in Path(f"/proc/{process.pid}/cmdline").read_bytes().split(b"\0")
    assert b"SLIPSTICK_PORT=1" in Path(f"/proc/{process.pid}/environ").read_bytes().split(b"\0")
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=30)
    assert process.returncode == -signal.SIGTERM
