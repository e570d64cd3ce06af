"""The main job, end to end: tables, a calibration, service and worker, a fit, a study of what is missing, fits with it.

`python demo.py start` leaves service and worker running; `python demo.py stop` ends them. Standard library only; what
it runs are the commands a user would type, and it prints each.
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
CALIBRATION = "var/calibration.json"
FIT = {"table": "calibrated", "recordings": "measured"}
STUDY = {"recordings": FIT["recordings"]}
REFIT = {"recordings": FIT["recordings"], "settings": {"generations": 20, "intervals": False}}


def start() -> None:
    """Run the whole job and leave service and worker running."""
    if not (PORT.isdecimal() and 0 < int(PORT) < 65536):
        sys.exit(f"SLIPSTICK_PORT is '{PORT}', no port: give a number from 1 to 65535")
    stop()
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", int(PORT))) == 0:
            sys.exit(f"Port {PORT} is taken: stop what listens there, or run `SLIPSTICK_PORT=8001 make demo`")
    seconds: dict[str, float] = {}
    step(seconds, "table at the nominal parameters", "build", "--out", "tables/nominal.h5")
    step(seconds, "calibration on the shipped recordings", "calibrate", "--out", CALIBRATION)
    step(seconds, "table at the calibrated parameters",
         "build", "--model", CALIBRATION, "--out", f"tables/{FIT['table']}.h5")

    print("\nService and worker start", flush=True)
    begun = time.monotonic()
    launch("service", "service")
    launch("worker", "worker", "serve-jobs")
    while not answers():
        if time.monotonic() > begun + 120:
            sys.exit(f"The service does not answer: see {RUN / 'service.log'}")
        time.sleep(0.1)
    seconds["start of the service"] = time.monotonic() - begun

    for name in ("service", "worker"):
        if not runs(RUN / f"{name}.pid"):
            sys.exit(f"The {name} has ended: {(RUN / f'{name}.log').read_text().strip()}")

    begun = time.monotonic()
    fit = request("/v1/fits", FIT)
    result = follow(fit["links"]["self"])
    seconds["fit"] = time.monotonic() - begun
    begun = time.monotonic()
    study = request("/v1/studies", STUDY)
    missing = follow(study["links"]["self"])
    seconds["study"] = time.monotonic() - begun
    both = refit(study["links"], seconds) if missing["result"]["answer"]["effects"] else {}

    show_fit(result["result"])
    show_study(missing["result"])
    if both:
        show_both(missing["result"]["models"], both)
    print("\nTime of each step")
    for name, value in seconds.items():
        print(f"  {name:40} {value:7.1f} s")
    chosen = "?" + "&".join(f"{which}={one['id']}" for which, one in both.items()) if both else ""
    print(f"\nOpen in a browser\n  {ADDRESS}{fit['links']['report']}    the report of the fit, with its pictures"
          f"\n  {ADDRESS}{study['links']['report']}{chosen}    the report of the study: what is missing, "
          f"gap and fits before and after\n  {ADDRESS}/docs    every operation, to try out"
          f"\n\nThe recordings are simulated test-bench data: the paper's are not public."
          f"\nService and worker go on running; stop them with: make demo-stop")


def refit(links: dict[str, str], seconds: dict[str, float]) -> dict[str, dict]:
    """Build the tables of the study's models before and after, and fit both alike; return the results."""
    found = {}
    for which in ("before", "after"):
        spec, table = RUN / f"{which}.json", f"study-{which}"
        request(f"{links['model']}?which={which}", out=spec)
        step(seconds, f"table of the study's model {which}", "build", "--model", str(spec),
             "--conditions", f"tables/{STUDY['recordings']}.h5", "--out", f"tables/{table}.h5")
        begun = time.monotonic()
        found[which] = follow(request("/v1/fits", {"table": table, **REFIT})["links"]["self"])
        seconds[f"fit on the table {which}"] = time.monotonic() - begun
    return found


def step(seconds: dict[str, float], name: str, *command: str) -> None:
    """Run one worker command, shown as it is typed, and note how long it took."""
    print(f"\n{name[0].upper()}{name[1:]}\n$ python -m worker {shlex.join(command)}", flush=True)
    begun = time.monotonic()
    status = subprocess.run([sys.executable, "-m", "worker", *command], check=False).returncode
    if status:
        sys.exit(status)
    seconds[name] = time.monotonic() - begun


def launch(name: str, *command: str) -> None:
    """Start a process that outlives this one; its output goes to var/demo."""
    RUN.mkdir(parents=True, exist_ok=True)
    with (RUN / f"{name}.log").open("w") as log, (RUN / f"{name}.pid").open("w") as note:
        # The process inherits the lock on its note: as long as it is held, the number in the note is this process.
        fcntl.flock(note, fcntl.LOCK_EX)
        environment = {**os.environ, "SLIPSTICK_PORT": PORT}
        process = subprocess.Popen([sys.executable, "-m", *command], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                   env=environment, start_new_session=True, pass_fds=[note.fileno()])
        note.write(str(process.pid))


def stop() -> None:
    """End what an earlier run has left running."""
    for name in ("service", "worker"):
        note = RUN / f"{name}.pid"
        if note.exists() and runs(note):
            os.kill(int(note.read_text()), signal.SIGTERM)
            while runs(note):
                time.sleep(0.05)
            print(f"Stopped the {name}", flush=True)


def runs(note: Path) -> bool:
    """Whether the process that holds the lock on `note` is alive."""
    with note.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def answers() -> bool:
    """Whether the service is up."""
    try:
        with urllib.request.urlopen(f"{ADDRESS}/v1/health", timeout=5):
            return True
    except OSError:
        return False


def request(path: str, body: dict | None = None, quiet: bool = False, out: Path | None = None) -> dict:
    """Ask the service with curl, shown as it is typed; without curl on the machine, in Python."""
    command = ["curl", "--silent", "--show-error", f"{ADDRESS}{path}"]
    if body:  # what `--json` stands for, which needs curl 7.82
        command += ["--header", "Content-Type: application/json", "--data", json.dumps(body)]
    if not quiet:
        print(f"\n$ {shlex.join(command)}{f' > {out}' if out else ''}", flush=True)
    if shutil.which("curl"):
        answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    else:
        data = json.dumps(body).encode() if body else None
        asked = urllib.request.Request(f"{ADDRESS}{path}", data, {"Content-Type": "application/json"})
        with urllib.request.urlopen(asked, timeout=60) as got:
            answer = got.read().decode()
    content: dict = json.loads(answer)
    if "remedy" in content:
        sys.exit(f"{content['detail']}. {content['remedy']}")
    if out:
        out.write_text(answer)
    return content


def follow(path: str) -> dict:
    """Print the progress of a fit or a study until it has ended; return its result."""
    said = None
    print(f"\n$ curl --silent {ADDRESS}{path}    (again and again)", flush=True)
    while True:
        job = request(path, quiet=True)
        words = progress(job["progress"]) if job["progress"] else None
        if words and words != said:
            said = words
            print(f"  {words}", flush=True)
        if job["status"] == "done":
            return request(job["links"]["result"])
        if job["status"] in ("failed", "cancelled"):
            sys.exit(f"The job {job['status']}: {job['problem']}")
        time.sleep(0.3)


def progress(at: dict) -> str | None:
    """What a job is doing, in words; None before there is anything to say."""
    if "added" in at:
        doing = f"{at['stage']} {at['candidate'] or ''}".strip()
        return f"{doing} (added so far: {', '.join(at['added']) or 'nothing'})"
    if at["log10_likelihood"] is None:
        return None
    return at["stage"] if at["stage"] != "search" else (
        f"search: generation {at['generation']} of at most {at['generations']}, best log10 likelihood "
        f"{at['log10_likelihood']:.3f}")


def show_fit(fitted: dict) -> None:
    """Print what was fitted."""
    print("\nFitted inputs (multiples of the calibrated values; the output std in s), and 90 % intervals")
    for one in fitted["intervals"]:
        low, high = (f"{one[side]:.4g}" if one[side] is not None else "not found" if side in one["unsettled"]
                     else "open" for side in ("lower", "upper"))
        print(f"  {one['unknown']:25} {one['estimate']:8.4g}   [{low}, {high}]")
    before = fitted["before"]
    print(f"log10 likelihood per ms: {before['log10_likelihood']:.2f} before (the calibrated model with nothing but "
          f"output noise, {1e3 * before['output_std']:.1f} ms), {fitted['log10_likelihood']:.2f} after")
    for remark in fitted["remarks"]:
        print(f"  note: {remark['cause']}. {remark['remedy']}.")


def show_study(found: dict) -> None:
    """Print what is missing, and how much of the gap it closes."""
    print(f"\n{found['answer']['sentence']}")
    for one in found["answer"]["coefficients"]:
        print(f"  {one['coefficient']:25} {one['value']:8.4g}   [{one['lower']:.4g}, {one['upper']:.4g}] {one['unit']}")
    if found["gap"]:
        print("Held-out RMS error of the shifting time: before, after it is added, and what a right model would leave")
        closed = found["gap"]["closures"]["shifting_time"]
        print("  " + ", ".join(f"{1e3 * closed[name]:.1f} ms" for name in ("rms_before", "rms_after", "rms_expected")))


def show_both(models: dict, both: dict[str, dict]) -> None:
    """Print the same fit on the tables before and after, side by side."""
    fits = {which: one["result"] for which, one in both.items()}
    rows = {"log10 likelihood per ms": [one["log10_likelihood"] for one in fits.values()]}
    for place, axis in enumerate(fits["before"]["axes"]):
        rows[f"std of {axis} [{models['before']['units'][axis]}]"] = [
            one["std"][place] * models[which]["parameters"][axis] for which, one in fits.items()]
    rows["output noise [ms]"] = [1e3 * one["output_std"] for one in fits.values()]
    print("\nThe same fit, to shifting times alone, on the table of each model: before, and after it is added")
    for name, values in rows.items():
        print(f"  {name:25} " + " ".join(f"{value:10.4g}" for value in values))


if __name__ == "__main__":
    {"start": start, "stop": stop}[sys.argv[1] if len(sys.argv) > 1 else "start"]()
