"""End-to-end demo: calibration, tables, a fit, a study of the missing effect, and fits before and after adding it.

`python demo.py start` leaves service and worker running; `python demo.py stop` stops them. The environment variable
BENCH selects another bench file. The demo needs only the standard library. It runs the commands that a user would type,
and prints each of them.
"""

import fcntl
import json
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

PORT = os.environ.get("SLIPSTICK_PORT", "8000")
ADDRESS = f"http://127.0.0.1:{PORT}"
RUN = Path("var/demo")
BENCH = Path(os.environ.get("BENCH", "tables/heavy.toml"))
SUFFIX = "" if BENCH.stem == "heavy" else f"-{BENCH.stem}"
"""Of the files of a bench that is not the default, whose recordings are tables/measured-NAME.h5."""
CALIBRATION = f"var/calibration{SUFFIX}.json"
FIT = {"table": f"calibrated{SUFFIX}", "recordings": f"measured{SUFFIX}", "parameters": ["initial_position"]}
AXES = ("--axis", "pressure_bias=0.5:1.5:50", "--axis", "initial_position=0.5:2:50")
"""Of the table that is fitted: wide enough for the scatter of the initial position."""
STUDY = {"recordings": FIT["recordings"]}
STAGES = {"refine": "refining the best candidate", "intervals": "computing the intervals",
          "conclude": "computing the result"}
"""Stage of a fit -> its description."""
REFIT = {"recordings": FIT["recordings"], "settings": {"generations": 20, "intervals": False}}


def start() -> None:
    """Run the demo and leave service and worker running."""
    if not (PORT.isdecimal() and 0 < int(PORT) < 65536):
        sys.exit(f"SLIPSTICK_PORT is '{PORT}', which is not a port. Give a number from 1 to 65535.")
    if not (BENCH.is_file() and Path(f"tables/{FIT['recordings']}.h5").is_file()):
        sys.exit(f"The demo needs {BENCH} and the recordings tables/{FIT['recordings']}.h5 that go with it. "
                 "Give the bench with `make demo BENCH=tables/compact.toml`.")
    stop()
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", int(PORT))) == 0:
            sys.exit(f"Port {PORT} is in use. Stop the program that uses it, or run `SLIPSTICK_PORT=8001 make demo`.")
    seconds: dict[str, float] = {}
    step(seconds, "table at the nominal parameters",
         "build", "--bench", str(BENCH), "--out", f"tables/nominal{SUFFIX}.h5")

    print("\nStarting service and worker, which compiles meanwhile what jobs run", flush=True)
    begin = time.monotonic()
    launch("service", "service")
    launch("worker", "worker", "serve-jobs")
    while not is_service_up():
        if time.monotonic() > begin + 120:
            sys.exit(f"The service does not respond. See {RUN / 'service.log'}.")
        time.sleep(0.1)
    seconds["start of the service"] = time.monotonic() - begin

    for name in ("service", "worker"):
        if not is_running(RUN / f"{name}.pid"):
            sys.exit(f"The {name} has stopped. Its log: {(RUN / f'{name}.log').read_text().strip()}")

    step(seconds, "calibration on the shipped recordings", "calibrate", "--bench", str(BENCH),
         "--recordings", f"tables/{FIT['recordings']}.h5", "--out", CALIBRATION)
    step(seconds, "table at the calibrated parameters",
         "build", "--bench", str(BENCH), "--model", CALIBRATION, *AXES, "--out", f"tables/{FIT['table']}.h5")

    begin = time.monotonic()
    fit = request("/v1/fits", FIT)
    fit_output = follow(fit["links"]["self"])
    seconds["fit"] = time.monotonic() - begin
    begin = time.monotonic()
    study = request("/v1/studies", STUDY)
    study_output = follow(study["links"]["self"])
    seconds["study"] = time.monotonic() - begin
    refits = refit(study["links"], seconds) if study_output["result"]["gap"] else {}

    print_fit(fit_output["result"], fit_output["physical"])
    print_study(study_output["result"])
    if refits:
        print_refits(study_output["result"], refits)
    print("\nWall time of each step")
    for name, value in seconds.items():
        print(f"  {name:40} {value:7.1f} s")
    query = "?" + "&".join(f"{which}={output['id']}" for which, output in refits.items()) if refits else ""
    print(f"\nOpen in a browser\n  {ADDRESS}    all that the service holds and does"
          f"\n  {ADDRESS}{fit['links']['report']}    report of the fit"
          f"\n  {ADDRESS}{study['links']['report']}{query}    report of the study, "
          f"with the fits before and after\n  {ADDRESS}/docs    REST API reference, to try out"
          f"\n\nThe recordings are simulated test-bench data, because those of the paper are not public."
          f"\nService and worker are still running. Stop them with: make demo-stop")


def refit(links: dict[str, str], seconds: dict[str, float]) -> dict[str, dict]:
    """Fit the study's models before and after with the same settings, each on its own table; return both results."""
    outputs = {}
    for which in ("before", "after"):
        spec, table = RUN / f"{which}.json", f"study-{which}{SUFFIX}"
        request(f"{links['model']}?which={which}", out=spec)
        step(seconds, f"table of the model {which} the extension", "build", "--bench", str(BENCH), "--model", str(spec),
             "--conditions", f"tables/{STUDY['recordings']}.h5", "--out", f"tables/{table}.h5")
        begin = time.monotonic()
        outputs[which] = follow(request("/v1/fits", {"table": table, **REFIT})["links"]["self"])
        seconds[f"fit of the model {which} the extension"] = time.monotonic() - begin
    return outputs


def step(seconds: dict[str, float], name: str, *command: str) -> None:
    """Print and run one worker command, and store its wall time under `name`."""
    print(f"\n{name[0].upper()}{name[1:]}\n$ python -m worker {shlex.join(command)}", flush=True)
    begin = time.monotonic()
    status = subprocess.run([sys.executable, "-m", "worker", *command], check=False).returncode
    if status:
        sys.exit(status)
    seconds[name] = time.monotonic() - begin


def launch(name: str, *command: str) -> None:
    """Start a process that outlives this one, with its output in var/demo."""
    RUN.mkdir(parents=True, exist_ok=True)
    with (RUN / f"{name}.log").open("w") as log, (RUN / f"{name}.pid").open("w") as pid_file:
        # The process inherits the lock on its PID file: as long as the lock is held, the PID is that of this process.
        fcntl.flock(pid_file, fcntl.LOCK_EX)
        environment = {**os.environ, "SLIPSTICK_PORT": PORT}
        process = subprocess.Popen([sys.executable, "-m", *command], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                   env=environment, start_new_session=True, pass_fds=[pid_file.fileno()])
        pid_file.write(str(process.pid))


def stop() -> None:
    """Stop the service and the worker of an earlier run."""
    for name in ("service", "worker"):
        pid_file = RUN / f"{name}.pid"
        if pid_file.exists() and is_running(pid_file):
            os.kill(int(pid_file.read_text()), signal.SIGTERM)
            while is_running(pid_file):
                time.sleep(0.05)
            print(f"Stopped the {name}", flush=True)


def is_running(pid_file: Path) -> bool:
    """Whether a process holds the lock on `pid_file`."""
    with pid_file.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def is_service_up() -> bool:
    """Whether the service responds."""
    try:
        with urllib.request.urlopen(f"{ADDRESS}/v1/health", timeout=5):
            return True
    except OSError:
        return False


def request(path: str, body: dict | None = None, quiet: bool = False, out: Path | None = None) -> dict:
    """Print and send a request with curl, or in Python if curl is missing; return the JSON response."""
    command = ["curl", "--silent", "--show-error", f"{ADDRESS}{path}"]
    if body:  # instead of `--json`, which needs curl 7.82
        command += ["--header", "Content-Type: application/json", "--data", json.dumps(body)]
    if not quiet:
        print(f"\n$ {shlex.join(command)}{f' > {out}' if out else ''}", flush=True)
    if shutil.which("curl"):
        response = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    else:
        data = json.dumps(body).encode() if body else None
        http_request = urllib.request.Request(f"{ADDRESS}{path}", data, {"Content-Type": "application/json"})
        with urllib.request.urlopen(http_request, timeout=60) as http_response:
            response = http_response.read().decode()
    content: dict = json.loads(response)
    if "remedy" in content:
        sys.exit(f"{content['detail']}. {content['remedy']}")
    if out:
        out.write_text(response)
    return content


def follow(path: str) -> dict:
    """Print the progress of a fit or a study until it ends; return its result."""
    printed = None
    print(f"\n$ curl --silent {ADDRESS}{path}    (repeated until the job has ended)", flush=True)
    while True:
        job = request(path, quiet=True)
        line = progress_line(job["progress"]) if job["progress"] else None
        if line and line != printed:
            printed = line
            print(f"  {line}", flush=True)
        if job["status"] == "done":
            return request(job["links"]["result"])
        if job["status"] in ("failed", "cancelled"):
            sys.exit(f"The job has the status '{job['status']}': {job['problem']}")
        time.sleep(0.3)


def progress_line(progress: dict) -> str | None:
    """The progress of a job as text; None while a fit has no candidate yet."""
    if "doing" in progress:
        return f"step {progress['step']} of {progress['steps']}: {progress['doing']}"
    if progress["log10_likelihood"] is None:
        return None
    return STAGES.get(progress["stage"], progress["stage"]) if progress["stage"] != "search" else (
        f"search: generation {progress['generation']} of at most {progress['generations']}, best log10 likelihood "
        f"{progress['log10_likelihood']:.3f}")


def print_fit(fit: dict, physical: list[dict]) -> None:
    """Print the estimates of a fit, in multiples and in the units of its inputs, and its likelihood."""
    print("\nFitted inputs (multiples of the calibrated values; output std in s) with 90 % intervals")
    for interval in fit["intervals"]:
        lower, upper = (f"{interval[side]:.4g}" if interval[side] is not None else
                        "not found" if side in interval["unsettled"] else "open" for side in ("lower", "upper"))
        print(f"  {interval['unknown']:25} {interval['estimate']:8.4g}   [{lower}, {upper}]")
    for row in physical:
        print(f"  {row['name']:25} {row['mean']:8.4g} {row['unit']}, std {row['std']:.4g} {row['unit']}")
    before = fit["before"]
    print(f"log10 likelihood per ms: {before['log10_likelihood']:.2f} before the fit (calibrated model with output "
          f"noise of {1e3 * before['output_std']:.1f} ms only), {fit['log10_likelihood']:.2f} after")
    for remark in fit["remarks"]:
        print(f"  note: {remark['cause']}. {remark['remedy']}.")


def print_study(study: dict) -> None:
    """Print what is missing, and the held-out error before and after the model is extended."""
    print(f"\n{study['sentence']}")
    for row in (row for finding in study["findings"] for row in finding["confirmation"]["coefficients"]):
        print(f"  {row['name']:25} {row['value']:8.4g}   [{row['lower']:.4g}, {row['upper']:.4g}] {row['unit']}")
    if study["gap"]:
        error = study["gap"]["closures"]["shifting_time"]
        before, after, expected = (f"{1e3 * error[f'rms_{which}']:.1f} ms" for which in ("before", "after", "expected"))
        print(f"Held-out RMS error of the shifting time: {before} before the model is extended, {after} after, "
              f"{expected} expected for a correct model")


def print_refits(study: dict, outputs: dict[str, dict]) -> None:
    """Print the fits on the tables of the models before and after, side by side."""
    models = {which: study[which]["model"] for which in outputs}
    fits = {which: output["result"] for which, output in outputs.items()}
    rows = {"log10 likelihood per ms": [fit["log10_likelihood"] for fit in fits.values()]}
    for index, axis in enumerate(fits["before"]["axes"]):
        rows[f"std of {axis} [{models['before']['units'][axis]}]"] = [
            fit["std"][index] * models[which]["parameters"][axis] for which, fit in fits.items()]
    rows["output std [ms]"] = [1e3 * fit["output_std"] for fit in fits.values()]
    print("\nThe same fit to shifting times only, on the table of the model before and after the extension")
    for name, values in rows.items():
        print(f"  {name:25} " + " ".join(f"{value:10.4g}" for value in values))


if __name__ == "__main__":
    {"start": start, "stop": stop}[sys.argv[1] if len(sys.argv) > 1 else "start"]()
