"""Tables of any machine: failing runs, timeouts, interruptions, and an UM-Bridge server of the umbridge package."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest

from slipstick.black_box import BlackBox, Workers
from slipstick.black_box.bridge import Bridge
from slipstick.black_box.cases import Cases, Quantity
from slipstick.black_box.function import NoResult
from slipstick.building import black_box_runs, chunks
from slipstick.errors import InvalidValue
from slipstick.table import Table
from worker import simulators
from worker.__main__ import main
from worker.computing import Computer, Report, forking_of
from worker.simulators import Simulators

DOCS = Path(__file__).parents[2] / "docs"
TROUBLE = '''
import time

def output(a, b):
    if a > 1.45:
        raise ValueError(f"a is {a:g}")
    if a < 0.55:
        time.sleep(60)
    return None if b > 2.5 else a * b
'''
MACHINE = '''
title = "A function in trouble"
simulator = { callable = "NAME:output", timeout = "0.2 s" }
output = { name = "c", unit = "m" }
inputs.a = { nominal = 1, range = [0.5, 1.5], points = 5 }
conditions.b = [1, 2, 3]
'''
SERVER = '''
import sys
import umbridge

sys.path.insert(0, sys.argv[2])
from motor import run_up_time

class Motor(umbridge.Model):
    def __init__(self, name, split):
        super().__init__(name)
        self.split = split

    def get_input_sizes(self, config):
        return [2, 2] if self.split else [4]

    def get_output_sizes(self, config):
        return [1]

    def __call__(self, parameters, config):
        resistance, friction, voltage, inertia = sum(parameters, [])
        return [[run_up_time(resistance, friction, voltage, inertia) * config.get("factor", 1)]]

    def supports_evaluate(self):
        return True

umbridge.serve_models([Motor("motor", False), Motor("split", True)], int(sys.argv[1]))
'''


@pytest.fixture
def trouble(tmp_path: Path) -> Path:
    name = f"trouble_{tmp_path.name.replace('-', '_')}"  # each test has its own module
    (tmp_path / f"{name}.py").write_text(TROUBLE)
    (tmp_path / "machine.toml").write_text(MACHINE.replace("NAME", name))
    return tmp_path


def build(folder: Path, *options: str) -> int:
    return main(["build", "--machine", str(folder / "machine.toml"), "--out", str(folder / "table.h5"),
                 "--threads", "1", *options])


def require_ended(child: int) -> None:
    """Wait until a process has ended; fail if it does not."""
    for _ in range(100):
        status = Path(f"/proc/{child}/stat")
        if not status.exists() or status.read_text().split()[2] == "Z":
            return
        time.sleep(0.1)
    os.kill(child, signal.SIGKILL)
    pytest.fail("the process of the simulator is still alive")


def test_runs_without_output_have_a_status_and_a_reason(trouble: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert build(trouble) == 0
    table, told = Table.open(trouble / "table.h5"), capsys.readouterr()
    assert table.status.tolist() == [[2, 2, 2], [0, 0, 1], [0, 0, 1], [0, 0, 1], [2, 2, 2]]
    np.testing.assert_allclose(table.times[1:4, :2], [[0.75, 1.5], [1, 2], [1.25, 2.5]])
    assert table.output.unit == "m"
    assert "9 of 15 runs have no output: 3 returned none, 6 failed" in told.err
    assert "a 0.5, b 1: TimeoutError: no result within 0.2 s" in told.err
    assert "6 with an output, 3 without an output, 6 failed" in told.out
    assert main(["surrogate", "--machine", str(trouble / "machine.toml"), "--out", str(trouble / "s.h5"),
                 "--axis", "a=0.7:1.3", "--runs", "100", "--steps", "10"]) == 1
    assert re.search(r"120 of 360 runs in the box have no output, in 1 condition\(s\) .*indices: 2",
                     capsys.readouterr().err)


def test_a_simulator_that_fails_at_the_nominal_values_is_not_started(trouble: Path,
                                                                     capsys: pytest.CaptureFixture[str]) -> None:
    text = (trouble / "machine.toml").read_text()
    (trouble / "machine.toml").write_text(text.replace("nominal = 1,", "nominal = 1.5,"))
    assert build(trouble) == 1
    assert "fails at the nominal values for b 1: ValueError: a is 1.5" in capsys.readouterr().err
    (trouble / "machine.toml").write_text(text)
    for options, message in ((("--axis", "a=0.1:1:3"), "exceeds the range of the input"),
                             (("--axis", "d=1:2:3"), "There is no input 'd'"),
                             (("--axis", "a=1:2"), "not a valid axis"),
                             (("--conditions", "x.csv"), "--conditions and --machine exclude each other"),
                             (("--accuracy", "tight"), "--accuracy and --machine exclude each other")):
        assert build(trouble, *options) == 1
        assert message in capsys.readouterr().err
    assert not (trouble / "table.h5").exists()


def test_an_interrupted_build_resumes(trouble: Path, monkeypatch: pytest.MonkeyPatch,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(black_box_runs, "CHUNK", 3)  # one point
    written = []

    def stopping(path: Path, *arrays: np.ndarray) -> None:
        if len(written) == 3:
            raise KeyboardInterrupt
        written.append(path)
        kept(path, *arrays)

    kept = chunks._write_chunk
    with monkeypatch.context() as patch:
        patch.setattr(chunks, "_write_chunk", stopping)
        assert build(trouble, "--axis", "a=0.7:1.3:6") == 130
    capsys.readouterr()
    assert build(trouble, "--axis", "a=0.7:1.3:6") == 0
    assert "9 from an earlier run" in capsys.readouterr().err
    resumed = Table.open(trouble / "table.h5")
    assert build(trouble, "--axis", "a=0.7:1.3:6") == 0
    assert Table.open(trouble / "table.h5").digest == resumed.digest
    module = next(trouble.glob("*.py"))
    module.write_text(module.read_text() + "\n# another version")
    assert build(trouble, "--axis", "a=0.7:1.3:6") == 0
    assert Table.open(trouble / "table.h5").digest != resumed.digest


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The motor of the documentation behind a server of the umbridge package; its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    script = tmp_path_factory.mktemp("server") / "server.py"
    script.write_text(SERVER)
    process = subprocess.Popen([sys.executable, str(script), str(port), str(DOCS)], stdout=subprocess.DEVNULL)
    while True:
        assert process.poll() is None
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            break
        except OSError:
            time.sleep(0.1)
    yield f"http://127.0.0.1:{port}"
    process.kill()
    process.wait()


def motor(folder: Path, *lines: str) -> None:
    text = (DOCS / "motor.toml").read_text().replace("points = 17", "points = 3").replace("points = 13", "points = 3")
    (folder / "machine.toml").write_text(text.replace('callable = "motor:run_up_time"', "\n".join(lines)))


def test_an_um_bridge_server_gives_the_same_table(server: str, tmp_path: Path,
                                                  capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(DOCS / "motor.py", tmp_path)
    motor(tmp_path, 'callable = "motor:run_up_time"')
    assert build(tmp_path) == 0
    expected = Table.open(tmp_path / "table.h5").times
    assert expected.shape == (3, 3, 6)
    url = f'url = "{server}"'
    for lines in ((url, 'model = "motor"'),
                  (url, 'model = "split"', 'arguments = [["resistance", "friction"], ["voltage", "inertia"]]')):
        motor(tmp_path, *lines)
        assert build(tmp_path) == 0
        assert np.array_equal(Table.open(tmp_path / "table.h5").times, expected)
    motor(tmp_path, url, 'model = "motor"', "config = { factor = 2 }")
    assert build(tmp_path) == 0
    assert np.array_equal(Table.open(tmp_path / "table.h5").times, 2 * expected)
    capsys.readouterr()
    for lines, message in (((url, 'model = "moter"'), "ModelNotFound: Model moter not found"),
                           ((url, 'model = "split"'), "InvalidInput: Number of input parameters does not match"),
                           ((url, 'model = "motor"', 'arguments = [["resistance", "friction"]]'), "InvalidInput")):
        motor(tmp_path, *lines)
        assert build(tmp_path) == 1
        assert message in capsys.readouterr().err


class Answering(BaseHTTPRequestHandler):
    """Answers every request with the status and the body of its server."""

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        status, body = self.server.answer  # type: ignore[attr-defined]
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body.encode())

    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def answering() -> Iterator[HTTPServer]:
    """A server whose `answer`, status and body, tests set."""
    with HTTPServer(("127.0.0.1", 0), Answering) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def evaluate(server: HTTPServer) -> float | NoResult:
    cases = Cases((Quantity("load", "1"),), np.array([[2.0]]))
    bridge = Bridge(f"http://127.0.0.1:{server.server_port}", "motor", (("load",),), {}, 5.0)
    return bridge.run({}, cases)[0]


@pytest.mark.parametrize(("status", "body", "says"), [
    (500, "solver diverged", "status 500: solver diverged"),
    (500, "500 Internal Server Error\n\nServer got itself in trouble", "status 500: Internal Server Error Server got"),
    (500, "Traceback\n" + "  File x\n" * 200 + "ValueError: no root", "status 500: Traceback .*ValueError: no root"),
    (500, "", "status 500: Internal Server Error"),
    (200, "", r"no output of UM-Bridge, .*status 200: OK \(empty body\)"),
    (404, "<html><head><title>x</title></head><h1>Not&nbsp;here</h1></html>", "status 404: Not here"),
    (500, '{"error": {"type": "InvalidOutput", "message": "2 numbers"}}', "status 500: InvalidOutput: 2 numbers"),
    (500, '{"error": "diverged"}', 'status 500: {"error": "diverged"}'),
    (200, '{"output": [1.5]}', r'no output of UM-Bridge, .*status 200: {"output": \[1.5\]}'),
    (200, '["nan"]', "no output of UM-Bridge, .*status 200"),
    (200, '{"output": [[1.5, 2.5]]}', "the model 'motor' returned 2 numbers where 1 are needed: name the columns"),
    (200, '{"output": [[]]}', "the model 'motor' returned 0 numbers"),
])
def test_an_answer_that_is_no_output_is_said_with_its_status(answering: HTTPServer, status: int, body: str,
                                                             says: str) -> None:
    answering.answer = status, body  # type: ignore[attr-defined]
    result = evaluate(answering)
    assert isinstance(result, NoResult)
    assert re.match(says, str(result))
    assert "\n" not in str(result)
    assert len(str(result)) < 400


@pytest.mark.parametrize("number", ["nan", "NaN", "null", "-nan", "inf", "-Infinity"])
def test_a_number_that_is_none_is_no_output_of_a_server(answering: HTTPServer, number: str) -> None:
    answering.answer = 200, f'{{"output": [[{number}]]}}'  # type: ignore[attr-defined]
    result = evaluate(answering)
    assert isinstance(result, float)
    assert not np.isfinite(result)


def test_a_server_that_stays_busy_stops_the_build_with_its_text(answering: HTTPServer,
                                                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.black_box.bridge._PAUSES", (0.01,))
    answering.answer = 503, "all licences taken"  # type: ignore[attr-defined]
    with pytest.raises(InvalidValue, match="cannot be reached: status 503: all licences taken"):
        evaluate(answering)


def test_a_server_that_speaks_no_http_stops_the_build(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.black_box.bridge._PAUSES", ())
    with socket.create_server(("127.0.0.1", 0)) as listener:
        def hang_up() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.recv(1000)
                connection.sendall(b"SSH-2.0\r\n")

        thread = threading.Thread(target=hang_up)
        thread.start()
        bridge = Bridge(f"http://127.0.0.1:{listener.getsockname()[1]}", "motor", (("load",),), {}, 5.0)
        with pytest.raises(InvalidValue, match="cannot be reached: SSH"):
            bridge.run({"load": 1.0}, Cases((), np.empty((1, 0))))
        thread.join()


def test_a_worker_runs_no_simulator_that_it_was_not_given(trouble: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = BlackBox.open(trouble / "machine.toml")
    workers = Workers(file, 1)
    monkeypatch.setitem(simulators._workers, file.description.digest, workers)
    with workers:
        model = Simulators({file.description.digest: file}).of_machine(file.description, ["a"])
        np.testing.assert_allclose(model(np.array([[0.7], [1.2]]), file.cases)[:, :2], [[0.7, 1.4], [1.2, 2.4]])
    with pytest.raises(InvalidValue, match="work --machine"):
        Simulators().of_machine(file.description, ["a"])


def simulating(library: object, report: Report, folder: Path) -> None:
    """A step that reports the output of a simulator and its processes, and then does not end."""
    workers = Workers(BlackBox.open(folder / "machine.toml"), 1)
    outputs, _ = workers.simulate(("a",), np.array([[0.7]]), workers.file.cases)
    assert isinstance(workers.executor, ProcessPoolExecutor)
    report({"output": float(outputs[0, 0]), "pids": [*workers.executor._processes]})
    time.sleep(60)


def test_a_job_runs_a_simulator_which_ends_with_it(trouble: Path) -> None:
    computer, reports = Computer(trouble, forking_of(())), []

    def require_wanted() -> None:
        if reports:
            raise InvalidValue("The job is cancelled", "")

    with pytest.raises(InvalidValue, match="cancelled"):
        computer.run(simulating, trouble, report=reports.append, require_wanted=require_wanted)
    computer.stop()
    assert reports[0]["output"] == 0.7
    require_ended(*reports[0]["pids"])


def test_a_server_that_is_away_stops_the_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("slipstick.black_box.bridge._PAUSES", (0.01,))
    motor(tmp_path, 'url = "http://127.0.0.1:9"', 'model = "motor"')
    assert build(tmp_path) == 1
    assert re.search("http://127.0.0.1:9 cannot be reached: .*refused.*it resumes", capsys.readouterr().err)


@pytest.mark.slow
def test_processes_of_a_simulator_end_with_a_killed_parent(trouble: Path) -> None:
    script = trouble / "parent.py"
    script.write_text(f'''
import time
from pathlib import Path
import numpy as np
from slipstick.black_box import BlackBox, Workers
from slipstick.black_box.bridge import Bridge
from slipstick.black_box.cases import Cases, Quantity
from slipstick.black_box.function import NoResult

if __name__ == "__main__":
    workers = Workers(BlackBox.open(Path({str(trouble / "machine.toml")!r})), 1)
    workers.simulate(("a",), np.array([[1.0]]), workers.file.cases)
    print(*workers.executor._processes, flush=True)
    time.sleep(60)
''')
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True,
                              env={**os.environ, "PYTHONPATH": str(DOCS.parent)})
    assert parent.stdout
    child = int(parent.stdout.readline())
    os.kill(child, 0)  # it is alive
    parent.kill()
    parent.wait()
    require_ended(child)
