import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from distribution import (
    Once,
    once,
    pytest_collection,
    pytest_collection_modifyitems,
    pytest_runtest_teardown,
    pytest_xdist_auto_num_workers,
    pytest_xdist_make_scheduler,
)
from selenium import webdriver
from threadpoolctl import threadpool_limits

import slipstick
from slipstick.clutch.ensemble import shifting_times
from slipstick.interface.study import Study
from slipstick.recordings import Recordings
from slipstick.studies import examine
from slipstick.table import Axis, Grid
from tests import postgresql as postgresql_server
from tests.benches import HEAVY, NOMINAL

__all__ = ["once", "pytest_collection", "pytest_collection_modifyitems", "pytest_runtest_teardown",
           "pytest_xdist_auto_num_workers", "pytest_xdist_make_scheduler"]  # fixtures and hooks of pytest

ROOT = Path(__file__).parents[1]
BROWSER_OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                   "--disable-background-networking", "--disable-component-update", "--disable-sync",
                   "--window-size=1200,1600", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1")


@pytest.fixture(scope="session", autouse=True)
def one_blas_thread() -> Iterator[None]:
    """Products of small matrices take far longer in several threads, where other processes use the cores."""
    with threadpool_limits(1, "blas"):
        yield


@pytest.fixture(scope="session", autouse=True)
def hear_interrupts() -> None:
    """As in a terminal: what a script runs in the background ignores Ctrl-C, and so do the programs that it starts."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the shipped bench `heavy` and recordings `measured`, and a small simulated table, `nominal`."""
    folder = tmp_path_factory.mktemp("tables")
    model, conditions, grid = NOMINAL, HEAVY.conditions, np.linspace(0.5, 1.5, 9)
    axes = (Axis("pressure_bias", grid, 1.6, "bar"), Axis("initial_position", grid, 5e-4, "m"))
    times, status = shifting_times(model, conditions, [axis.name for axis in axes], np.array(list(product(grid, grid))))
    shape = (len(grid), len(grid), len(conditions))
    table = Grid(axes, times.reshape(shape), status.reshape(shape), conditions, model, "the tests")
    table.save(folder / "nominal.h5")
    for name in ("heavy.toml", "measured.h5"):
        shutil.copy(ROOT / "tables" / name, folder)
    return folder


@pytest.fixture(scope="session")
def few_recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with every ninth engagement of the shipped recordings, `few`, whose study takes seconds."""
    folder = tmp_path_factory.mktemp("recordings")
    with h5py.File(ROOT / "tables" / "measured.h5") as shipped, h5py.File(folder / "few.h5", "w") as few:
        shipped.copy("current_profiles", few)
        few["signals/time"] = shipped["signals/time"][:]
        few["signals/time"].attrs["units"] = "s"
        for name in (*(f"conditions/{name}" for name in shipped["conditions"]), "shifting_time",
                     *(f"signals/{name}" for name in shipped["signals"] if name != "time")):
            few[name] = shipped[name][::9]
            few[name].attrs["units"] = shipped[name].attrs["units"]
        few["conditions/run_order"][:] = np.argsort(np.argsort(few["conditions/run_order"]))
    return folder


@pytest.fixture(scope="session")
def watched_study_of_few(few_recordings: Path, once: Once) -> tuple[Study, list[dict[str, Any]]]:
    """The study of `few` with default settings, and what it keeps on the way; all processes of the tests share it."""
    def compute() -> tuple[Study, list[dict[str, Any]]]:
        kept = list[dict[str, Any]]()

        def watch(*arguments: Any) -> dict[str, Any]:
            *others, keep = arguments
            kept.append(examine(*others, lambda named: keep(named) or kept.append(named)))
            return kept[-1]

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("slipstick.interface.study.examine", watch)
            recordings = Recordings.open(few_recordings / "few.h5")
            return slipstick.study(HEAVY, recordings, progress=False, name="few"), kept

    watched: tuple[Study, list[dict[str, Any]]] = once("study_of_few", compute)
    return watched


@pytest.fixture(scope="session")
def study_of_few(watched_study_of_few: tuple[Study, list[dict[str, Any]]]) -> Study:
    """The study of `few` with default settings."""
    return watched_study_of_few[0]


@pytest.fixture(scope="session")
def few_study(study_of_few: Study) -> dict[str, Any]:
    """The same as the output of its job, as JSON."""
    times = {"seconds": {"name": 2.0, "confirm": 7.0}, "processor_seconds": {"name": 1.0, "confirm": 6.0}}
    output = {"result": asdict(study_of_few.result), "figure_data": asdict(study_of_few.figures), **times}
    content: dict[str, Any] = json.loads(json.dumps(output, allow_nan=False))
    return content


@pytest.fixture(scope="session")
def made() -> Callable[..., dict[str, Any]]:
    """A function that makes up the output of a fit job, with a ridge in the likelihood and an open interval."""
    def make(axes: tuple[str, ...] = ("pressure_bias", "initial_position"), n: int = 216) -> dict[str, Any]:
        rng, d, conditions = np.random.default_rng(1), len(axes), HEAVY.conditions.take(np.arange(n))
        measured = rng.uniform(0.4, 1.2, n)
        predicted, std = measured + 0.01 * rng.normal(size=n), 0.01
        grid, time = np.linspace(0.8, 1.2, 21), np.linspace(0, 1.5, 151)
        steps = np.linspace(-0.04, 0.04, 17)
        curve = [[1 + step, 0.3 * step**2 / std**2] for step in np.linspace(-2 * std, 2 * std, 9)]
        candidate = {"mean": [1.0] * d, "std": [0.05] * d, "output_std": std}
        unknowns = [f"{kind} of {axis}" for kind in ("mean", "std") for axis in axes] + ["output std"]
        drop = 1e4 * (grid[:, None] + grid - 2) ** 2 + (grid[:, None] - grid) ** 2
        signals = {"pressure": 10 * time, "input_speed": 160 - 20 * time, "output_speed": 40 * time,
                   "output_torque": 300 + 0 * time}
        result = {
            "axes": list(axes), "families": ["normal"] * d, "correlation": None, "method": "genetic", "refined": True,
            **candidate, "log10_likelihood": -269.0, "log10_likelihood_per_condition": [-269.0 / n] * n,
            "before": {**candidate, "log10_likelihood": -300.0}, "searched": {**candidate, "log10_likelihood": -269.5},
            "generations": 3, "history": [-300.0, -280.0, -269.4], "mass_outside": 0.01, "remarks": [],
            "intervals": [{"unknown": name, "estimate": 1.0, "lower": 0.99, "upper": 1.01, "unsettled": [],
                           "level": 0.9, "curve": curve} for name in unknowns],
            "combinations": [{"weights": {f"mean of {axis}": 1.0 for axis in axes}, "std_error": 0.01,
                              "identified": True, "interval": None}]}
        result["intervals"][0] |= {"lower": None}
        figure_data = {
            "conditions": {name: getattr(conditions, name).tolist() for name in (
                "current_profile", "motor_speed", "load_inertia", "brake_torque")},
            "search": {"unknowns": unknowns, "estimate": [1.0] * len(unknowns),
                       "path": [[start] * len(unknowns) for start in (1.3, 1.05, 1.0)],
                       "traces": [[[point] * len(unknowns) for point, _ in curve]] * len(unknowns)},
            "surface": None if d < 2 else {"axes": list(axes[:2]), "first": grid.tolist(), "second": grid.tolist(),
                                           "log10_likelihood": (-269 - drop).tolist()},
            "prediction": {
                "condition": list(range(n)), "measured": measured.tolist(), "before": (measured + 0.05).tolist(),
                "mean": predicted.tolist(), "std": [std] * n,
                "density_time": (predicted[:, None] + steps).tolist(),
                "density": [(np.exp(-(steps / std) ** 2 / 2) / std / np.sqrt(2 * np.pi) / 1e3).tolist()] * n},
            "engagement": {
                "condition": 0, "time": time.tolist(), "touch": 0.1, "lock": float(measured[0]) + 0.02,
                "current": (0.3 + 0 * time).tolist(), "gear_ratio": 3.2,
                "measured": {name: values.tolist() for name, values in signals.items()},
                "simulated": {name: values.tolist() for name, values in (
                    *signals.items(), ("piston_position", np.minimum(0.02 * time, 2e-3)))}},
            "output": None}
        physical = [{"name": axis, "unit": "bar", "nominal": 1.6, "mean": 1.6, "std": 0.08} for axis in axes]
        return {"result": result, "physical": physical, "figure_data": figure_data,
                "seconds": {"open": 0.2, "search": 18.0, "refine": 6.0, "intervals": 14.0},
                "processor_seconds": {"open": 0.1, "search": 9.0, "refine": 3.0, "intervals": 7.0}}

    return make


@pytest.fixture(scope="session")
def launch() -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """A function that starts `python -m ...` as a process; processes still running at the end are killed."""
    started: list[subprocess.Popen[bytes]] = []

    def start(*arguments: str, **environment: str) -> subprocess.Popen[bytes]:
        quiet = ["--no-compile"] if "work" in arguments else []  # it takes time that tests need
        command = [sys.executable, "-m", *arguments, *quiet]
        started.append(subprocess.Popen(command, cwd=ROOT, env={**os.environ, **environment}))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.fixture(scope="session")
def postgresql() -> Iterator[postgresql_server.Server]:
    """A PostgreSQL server."""
    if not postgresql_server.program("initdb"):
        reason = postgresql_server.MISSING
        pytest.fail(reason) if os.environ.get("CI") == "true" else pytest.skip(reason)
    server = postgresql_server.Server()
    yield server
    server.remove()


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[webdriver.Chrome]:
    """A real browser that can connect to this machine only."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and driver):
        reason = "Chromium is missing: apt-get update && apt-get install -y chromium chromium-driver"
        pytest.fail(reason) if os.environ.get("CI") == "true" else pytest.skip(reason)
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for option in (*BROWSER_OPTIONS, f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    browser = webdriver.Chrome(options, webdriver.ChromeService(driver))
    yield browser
    browser.quit()


@pytest.fixture(scope="session")
def requested(browser: webdriver.Chrome) -> Callable[[], list[str]]:
    """A function that returns the network addresses the browser has requested since its last call."""
    def urls() -> list[str]:
        messages = (json.loads(entry["message"])["message"] for entry in browser.get_log("performance"))
        sent = [message["params"]["request"]["url"] for message in messages
                if message["method"] == "Network.requestWillBeSent"]
        return [url for url in sent if url.startswith(("http:", "https:", "ws:", "wss:"))]

    return urls
