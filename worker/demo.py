"""`demo`: tables, a calibration, a fit, a study of the missing effect, and fits before and after adding it.

It runs the commands and requests that a user would type, prints each of them, and leaves service and worker running.
"""

import argparse
import fcntl
import json
import os
import shlex
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

from slipstick import interruption
from slipstick.errors import InvalidValue, SlipstickError
from slipstick.inference.fitting import say_progress

from .program import PACKAGE, command_line
from .serve import fill, require_service

RUN = Path("var/demo")
_RECORDINGS = {"heavy": "sample", "compact": "measured-compact"}
"""Bench -> recordings that are shipped with it."""
_AXES = ("--axis", "pressure_bias=0.5:1.5:50", "--axis", "initial_position=0.5:2:50")
"""Of the tables that are fitted: wide enough for the scatter of the initial position."""
_FIT: dict[str, Any] = {"parameters": ["initial_position"], "settings": {"intervals": True}}
_REMEDY = {True: "Give the name of a new folder as --folder, which is then made with the shipped files",
           False: "Leave --bench out: recordings of other benches are in the repository of Slipstick only"}
"""Whether it is the bench that is shipped with recordings -> how to get files that are missing."""
_START_SECONDS = 120.0
_END_SECONDS = 30.0

_INTRODUCTION = """\
The demo simulates tables, calibrates a bench on shipped recordings, studies what its model lacks, and fits before and
after that is added. It prints each command. It takes less than a minute on two cores, and the first time up to a minute
more to compile; the longest step is the study."""

Json = dict[str, Any]


class DemoStopped(SlipstickError):
    """A step of the demo has failed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--bench", choices=_RECORDINGS, default="heavy",
                        help="the shipped bench (default: %(default)s)")
    parser.add_argument("--folder", type=Path, metavar="DIR",
                        help="folder of the demo (default: this one if it has the folder `tables`, otherwise "
                             "slipstick-demo)")
    parser.add_argument("--port", type=int, default=os.environ.get("SLIPSTICK_PORT", "8000"), metavar="N",
                        help="port of the service (default: %(default)s; SLIPSTICK_PORT)")
    parser.add_argument("--stop", action="store_true", help="stop the service and the worker of an earlier demo")


def run(arguments: argparse.Namespace) -> int:
    """Run the demo, or stop that of the folder."""
    folder = arguments.folder or (Path() if Path("tables").is_dir() else Path("slipstick-demo"))
    if arguments.stop:
        if not stop(folder / RUN):
            print(f"No demo is running in {folder.resolve()}")
        return 0
    require_service()
    demo = Demo(arguments.bench, arguments.port)
    for name in [name for name in os.environ if name.startswith("SLIPSTICK_")]:
        del os.environ[name]  # the settings of another service: the demo has its own folder, jobs and port
    folder.mkdir(parents=True, exist_ok=True)
    print(_INTRODUCTION)
    if folder != Path():
        print(f"\n$ cd {shlex.quote(str(folder))}", flush=True)
    os.chdir(folder)
    fill(Path("tables"))
    stop(RUN)
    try:
        demo.show()
    finally:  # also after Ctrl-C, which service and worker do not hear
        if (RUN / "serve.pid").exists() and is_running(RUN / "serve.pid"):
            where = [] if arguments.folder is None else ["--folder", arguments.folder]
            print(f"\nService and worker are still running. Stop them with: {command_line('demo', '--stop', *where)}",
                  flush=True)
    return 0


class Demo:
    """The demo of a shipped bench, in the present folder, with the service on a port."""

    def __init__(self, bench: str, port: int) -> None:
        if not 0 < port < 65536:
            raise InvalidValue(f"The port is {port}", "Give a number from 1 to 65535")
        self.bench, self.port, self.recordings = f"tables/{bench}.toml", port, _RECORDINGS[bench]
        self.address = f"http://127.0.0.1:{port}"
        self.suffix = "" if bench == "heavy" else f"-{bench}"
        self.seconds: dict[str, float] = {}

    def show(self) -> None:
        """Run all steps, and print what they find and how long they took."""
        for path in (Path(self.bench), Path(f"tables/{self.recordings}.h5")):
            if not path.is_file():
                raise InvalidValue(f"There is no file {path}", _REMEDY[self.suffix == ""])
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                raise InvalidValue(f"Port {self.port} is in use", "Stop the program that uses it, or give another "
                                   "port by --port, with `make demo` by the environment variable SLIPSTICK_PORT")
        self.command("table at the nominal parameters", "build", "--bench", self.bench,
                     "--out", f"tables/nominal{self.suffix}.h5")
        self.start()
        calibration = f"var/calibration{self.suffix}.json"
        self.command("calibration on the shipped recordings", "calibrate", "--bench", self.bench,
                     "--recordings", f"tables/{self.recordings}.h5", "--out", calibration)
        study, report = self.job("study", "/v1/studies",
                                 {"recordings": self.recordings, "bench": Path(self.bench).stem})
        self.print_study(study["result"])
        fits = {"calibrated": self.fit("calibrated", calibration)}
        if study["result"]["gap"]:
            for which in ("before", "after"):
                model = RUN / f"{which}.json"
                model.write_text(json.dumps(self.request(f"{report['model']}?which={which}")))
                fits[which] = self.fit(f"study-{which}", str(model))
        self.print_fits({name: output for name, (output, _) in fits.items()})
        query = "&".join(f"{which}={fits[which][1]['self'].rsplit('/')[-1]}" for which in ("before", "after")
                         if which in fits)
        print("\nWall time of each step")
        for name, value in self.seconds.items():
            print(f"  {name:45} {value:7.1f} s")
        print(f"  {'together':45} {sum(self.seconds.values()):7.1f} s")
        page = report["report"] + (f"?{query}" if query else "")
        print(f"\nOpen in a browser\n  {self.address}    all that the service holds and does"
              f"\n  {self.address}{page}    report of the study, with the fits before and after"
              f"\n  {self.address}/docs    REST API reference, to try out"
              "\n\nThe recordings are simulated test-bench data, because those of the paper are not public.")

    def start(self) -> None:
        """Start service and worker, which outlive this process, and wait until the service responds."""
        words = ["serve", "--with-worker", "--no-compile", "--port", str(self.port)]  # the demo compiles what it runs
        print(f"\nService and worker\n$ {command_line(*words)} &", flush=True)
        begin = time.monotonic()
        RUN.mkdir(parents=True, exist_ok=True)
        with (RUN / "serve.log").open("w") as log, (RUN / "serve.pid").open("w") as pid_file:
            # The process inherits the lock on its PID file: as long as it is held, the PID is that of this process.
            fcntl.flock(pid_file, fcntl.LOCK_EX)
            process = subprocess.Popen([sys.executable, "-m", PACKAGE, *words], stdin=subprocess.DEVNULL, stdout=log,
                                       stderr=log, start_new_session=True, pass_fds=[pid_file.fileno()])
            pid_file.write(str(process.pid))
        while not self.is_up():
            if process.poll() is not None or time.monotonic() > begin + _START_SECONDS:
                said = (RUN / "serve.log").read_text().strip()[-500:].removeprefix("error: ")
                raise DemoStopped(f"The service does not respond: {said}", f"See {RUN / 'serve.log'}")
            time.sleep(0.05)
        self.seconds["start of the service"] = time.monotonic() - begin

    def is_up(self) -> bool:
        """Whether the service responds."""
        try:
            with urllib.request.urlopen(f"{self.address}/v1/health", timeout=5):
                return True
        except OSError:
            return False

    def command(self, name: str, *words: str) -> None:
        """Print and run a command, and keep its wall time under `name`."""
        print(f"\n{name[0].upper()}{name[1:]}\n$ {command_line(*words)}", flush=True)
        begin = time.monotonic()
        with interruption.unheard():
            process = subprocess.Popen([sys.executable, "-m", PACKAGE, *words])
        try:
            status = process.wait()
        except KeyboardInterrupt:
            process.kill()
            raise
        if status:
            raise DemoStopped(f"The command ended with status {status}", "Its message says why")
        self.seconds[name] = time.monotonic() - begin

    def fit(self, name: str, model: str) -> tuple[Json, dict[str, str]]:
        """The output and the addresses of the same fit on a table of the `model`, which is built."""
        table = f"{name}{self.suffix}"
        self.command(f"table “{name}”", "build", "--bench", self.bench, "--model", model,
                     *_AXES, "--out", f"tables/{table}.h5")
        return self.job(f"fit on the table “{name}”", "/v1/fits",
                        {"table": table, "recordings": self.recordings, **_FIT})

    def job(self, name: str, path: str, body: Json) -> tuple[Json, dict[str, str]]:
        """The output and the addresses of a job, whose progress is printed until it ends."""
        begin = time.monotonic()
        links: dict[str, str] = self.request(path, body)["links"]
        print(f"$ curl -sS {self.address}{links['self']}    (repeated until it has ended)", flush=True)
        printed = ""
        while True:
            job = self.request(links["self"], quiet=True)
            said = say(job["progress"]) if job["progress"] else ""
            if said and said != printed:
                printed = said
                print(f"  {said}", flush=True)
            if job["status"] == "done":
                self.seconds[name] = time.monotonic() - begin
                return self.request(links["result"], quiet=True), links
            if job["status"] in ("failed", "cancelled"):
                raise DemoStopped(f"The job has the status '{job['status']}': {job['problem']}", "Repeat the demo")
            time.sleep(0.1)

    def request(self, path: str, body: Json | None = None, quiet: bool = False) -> Json:
        """The JSON response to a request, which is printed as a command with curl."""
        words = ["curl", "-sS", f"{self.address}{path}"]
        if body is not None:
            words += ["-H", "Content-Type: application/json", "-d", json.dumps(body)]
        if not quiet:
            print(f"\n$ {shlex.join(words)}", flush=True)
        data = None if body is None else json.dumps(body).encode()
        try:
            asked = urllib.request.Request(f"{self.address}{path}", data, {"Content-Type": "application/json"})
            with urllib.request.urlopen(asked, timeout=60) as response:
                content: Json = json.load(response)
        except urllib.error.HTTPError as error:
            problem = json.load(error)
            raise DemoStopped(problem["detail"], problem.get("remedy", "See the log of the service")) from None
        return content

    def print_study(self, study: Json) -> None:
        """Print what is missing, and the held-out error before and after the model is extended."""
        print(f"\n{study['sentence']}")
        for row in (row for finding in study["findings"] for row in finding["confirmation"]["coefficients"]):
            print(f"  {row['name']:25} {row['value']:8.4g}   [{row['lower']:.4g}, {row['upper']:.4g}] {row['unit']}")
        if study["gap"]:
            error = study["gap"]["closures"]["shifting_time"]
            before, after, expected = (f"{1e3 * error[f'rms_{which}']:.1f} ms"
                                       for which in ("before", "after", "expected"))
            print(f"Held-out RMS error of the shifting time: {before} before the model is extended, {after} after, "
                  f"{expected} expected for a correct model")

    def print_fits(self, outputs: dict[str, Json]) -> None:
        """Print the same fit to shifting times only on the table of each model, side by side."""
        print("\nThe same fit to shifting times only, on the tables of three models: calibrated, and refitted by the "
              "study\nwithout (before) and with (after) what is missing")
        print(f"  {'':40} " + " ".join(f"{name:>10}" for name in outputs))
        fits = [output["result"] for output in outputs.values()]
        rows = {"log10 likelihood per ms": [fit["log10_likelihood"] for fit in fits],
                **{f"{kind} of {entry['name']} [{entry['unit']}]": [
                    output["physical"][place][kind] for output in outputs.values()]
                   for place, entry in enumerate(next(iter(outputs.values()))["physical"]) for kind in ("mean", "std")},
                "output std [ms]": [1e3 * fit["output_std"] for fit in fits]}
        for name, values in rows.items():
            print(f"  {name:40} " + " ".join(f"{value:10.4g}" for value in values))


def say(progress: Json) -> str:
    """The progress of a job in words."""
    if "doing" in progress:
        return f"step {progress['step']} of {progress['steps']}: {progress['doing']}"
    return say_progress(progress["stage"], progress)


def stop(folder: Path) -> bool:
    """Stop the service and the worker of an earlier demo, whose files are in the folder; whether there were any."""
    pid_file = folder / "serve.pid"
    if not (pid_file.exists() and is_running(pid_file)):
        return False
    os.kill(int(pid_file.read_text()), signal.SIGTERM)
    end = time.monotonic() + _END_SECONDS
    while is_running(pid_file) and time.monotonic() < end:
        time.sleep(0.05)
    print("Stopped the service and the worker", flush=True)
    return True


def is_running(pid_file: Path) -> bool:
    """Whether a process holds the lock on its PID file."""
    with pid_file.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
