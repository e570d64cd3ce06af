"""Uploaded tables: of any axes and any program, verified and written anew, or refused with the reason."""

import io
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import httpx
import numpy as np
import pytest
from test_problems import problem

from service.settings import Settings
from slipstick.black_box import BlackBoxDescription
from slipstick.storage.library import Library
from slipstick.table import Table

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "your_table.md").read_text()
PROGRAM, = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
COMMANDS, = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
HDF5 = {"Content-Type": "application/x-hdf5"}

PROGRAMS = f"{Path(sys.executable).parent}:/usr/bin:/bin"


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file that the program of the documentation writes."""
    folder = tmp_path_factory.mktemp("motor")
    subprocess.run([sys.executable, "-c", PROGRAM], cwd=folder, check=True)
    return folder / "motor.h5"


@pytest.fixture(scope="module")
def folder(shelf: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("upload") / "tables"
    folder.mkdir()
    for name in ("nominal.h5", "measured.h5", "heavy.toml"):
        os.link(shelf / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def client(folder: Path, serving) -> Iterator[httpx.Client]:
    settings = Settings(tables=folder, jobs=f"sqlite:///{folder.parent}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=60) as client:
        yield client


def upload(client: httpx.Client, name: str, content: bytes) -> httpx.Response:
    return client.post("/v1/tables", params={"name": name}, content=content, headers=HDF5)


def upload_runs(client: httpx.Client, name: str, table: str, conditions: np.ndarray,
                times: np.ndarray) -> httpx.Response:
    """Upload measurements with the headings of the documentation."""
    headings, = re.findall(r"`(speed [^`]*)`", PAGE.replace("\n", " "))
    rows = [",".join(map(repr, map(float, (*row, time)))) for row, time in zip(conditions, times, strict=True)]
    return client.post("/v1/recordings", params={"name": name, "table": table}, content="\n".join([headings, *rows]),
                       headers={"Content-Type": "text/csv"})


def test_an_uploaded_table_is_used_like_a_built_one(client: httpx.Client, folder: Path, motor: Path) -> None:
    assert upload(client, "used", motor.read_bytes()).status_code == 201
    table = Library(folder).table("used")
    times = table.interpolate(np.array([[1.05, 1.1]]))[0]
    uploaded = upload_runs(client, "used-runs", "used", table.conditions.values, times).json()
    assert (uploaded["output"], uploaded["unit"]) == ("run_up_time", "s")
    candidates = [{"mean": [mean, 1.1], "std": [0.01, 0.01], "output_std": 0.05} for mean in (1.05, 0.95)]
    body = {"table": "used", "recordings": "used-runs", "candidates": candidates, "per_condition": False}
    better, worse = (entry["log10_likelihood"]
                     for entry in client.post("/v1/likelihood", json=body).json()["candidates"])
    assert better > worse + 10
    assert {"used", "used/used-runs"} <= set(client.get("/umbridge/Info").json()["models"])
    answer = client.post("/umbridge/Evaluate", json={"name": "used", "input": [[1.05, 1.1]], "config": {}})
    assert answer.json()["output"] == [pytest.approx(times.tolist())]
    inputs = {"inputs": {"mean": [1, 1], "std": [0.05, 0.2]}, "table": "used", "conditions": [7]}
    page = client.post("/v1/propagate?format=html", json=inputs)
    assert page.status_code == 200
    assert "7: speed 150 rad/s, load inertia 1 kg m², brake torque 4 N m" in page.text
    fit = {"table": "used", "recordings": "used-runs", "parameters": ["torque_constant"]}
    assert "simulator is not known" in problem(client.post("/v1/fits", json={**fit, "simulate": True}), 422)["detail"]
    problem(client.post("/v1/fits", json={**fit, "bench": "heavy"}), 422)
    problem(client.post("/v1/fits", json={**fit, "recordings": "measured"}), 422)
    assert client.post("/v1/fits", json=fit).status_code == 202


def test_an_output_in_a_large_unit_has_noise_of_its_size(client: httpx.Client, folder: Path, motor: Path) -> None:
    memory = io.BytesIO(motor.read_bytes())
    with h5py.File(memory, "r+", libver=("v110", "v110")) as file:
        file["times"][...] = 1e8 * file["times"][...]
        file["times"].attrs["units"] = np.bytes_("Pa")
    assert upload(client, "stress", memory.getvalue()).status_code == 201
    table = Library(folder).table("stress")
    measured = table.interpolate(np.ones((1, 2)))[0]
    rows = [",".join(map(repr, map(float, (*row, value))))
            for row, value in zip(table.conditions.values, measured, strict=True)]
    heading = "speed [rad/s],load_inertia [kg m^2],brake_torque [N m],run_up_time [Pa]"
    assert client.post("/v1/recordings", params={"name": "stresses", "table": "stress"}, headers={
        "Content-Type": "text/csv"}, content="\n".join([heading, *rows])).status_code == 201
    inputs = {"mean": [1, 1], "std": [0.0, 0.0]}
    body = {"table": "stress", "recordings": "stresses", "candidates": [{**inputs, "output_std": 5e6}]}
    found, = client.post("/v1/likelihood", json=body).json()["candidates"]
    assert found["log10_likelihood"] == pytest.approx(-8 * np.log10(5e6 * np.sqrt(2 * np.pi) * 1e3), rel=1e-6)
    body["candidates"][0]["output_std"] = 1e-9
    detail = problem(client.post("/v1/likelihood", json=body), 422)["detail"]
    assert detail == "The output std is 1e-09 Pa, less than the rounding errors of the measurements"
    spread = np.ptp(measured)
    fit = client.post("/v1/fits", json={"table": "stress", "recordings": "stresses"}).json()
    assert fit["settings"]["output_std_bounds"] == pytest.approx([spread / 2000, spread / 2])
    answer = client.post("/v1/propagate", json={"table": "stress", "inputs": inputs}).json()
    assert [entry["std"] for entry in answer["conditions"]] == pytest.approx([0.0] * 8, abs=1.0)  # no noise by default


def test_the_example_of_the_documentation_works(client: httpx.Client, folder: Path, motor: Path) -> None:
    answers = []
    for line in COMMANDS.strip().splitlines():
        done = subprocess.run(["bash", "-c", line], cwd=motor.parent, capture_output=True, text=True, check=True,
                              env={"PATH": PROGRAMS, "SLIPSTICK": str(client.base_url).rstrip("/")})
        answers.append(json.loads(done.stdout))
    described, propagated = answers
    assert [(axis["name"], axis["nominal"], axis["unit"]) for axis in described["axes"]] == [
        ("torque_constant", 0.8, "N m/A"), ("rotor_inertia", 0.05, "kg m^2")]
    assert described["statuses"] == {"locked": 21 * 11 * 8, "never_locked": 0, "failed": 0}
    assert (described["model"]["machine"]["title"], described["model"]["machine"]["simulator"]) == (
        "Electric motor at 20 A", "")
    assert (described["output"], described["unit"]) == ("run_up_time", "s")
    assert described["condition_units"] == {"speed": "rad/s", "load_inertia": "kg m^2", "brake_torque": "N m"}
    # At the nominal values, condition 0 takes (0.05 + 0.5) 100 / (0.8 20) s; the mean is larger by 5 % squared.
    assert propagated["conditions"][0]["mean"] == pytest.approx(0.55 * 100 / 16 * (1 + 0.05**2), rel=1e-3)
    with h5py.File(motor) as file:
        points = [[0.8, 0.5], [1.2, 1.5]]
        answer = client.post("/v1/evaluate", json={"table": "motor", "points": points}).json()
        assert answer["shifting_time"] == [file["times"][0, 0].tolist(), file["times"][-1, -1].tolist()]
    stored = Library(folder).table("motor")
    assert (stored.digest, stored.model) == (described["digest"], BlackBoxDescription.from_spec(described["model"]))


@pytest.mark.slow
def test_a_fit_of_an_uploaded_table_recovers_an_input(client: httpx.Client, folder: Path, motor: Path,
                                                        launch: Callable[..., subprocess.Popen[bytes]]) -> None:
    assert upload(client, "fitted", motor.read_bytes()).status_code == 201
    table = Library(folder).table("fitted")
    rng = np.random.default_rng(3)
    inputs = rng.normal([1.05, 1.1], [0.02, 0.1], (40, 2))
    conditions = table.conditions.take(np.arange(40) % 8)
    times = np.array([table.interpolate(point[None])[0, row % 8] for row, point in enumerate(inputs)])
    assert upload_runs(client, "runs", "fitted", conditions.values, times + rng.normal(0, 0.005, 40)).status_code == 201
    body = {"table": "fitted", "recordings": "runs", "settings": {"population": 16, "generations": 6,
                                                                  "intervals": False}}
    problem(client.post("/v1/fits", json={**body, "simulate": True}), 422)
    problem(client.post("/v1/evaluate", json={"table": "fitted", "points": [[1, 1]], "bench": "heavy"}), 422)
    fit = client.post("/v1/fits", json=body).json()["links"]
    assert fit["self"] in problem(client.delete("/v1/tables/fitted"), 409)["detail"]
    worker = launch("worker", "work", "--tables", str(folder), "--jobs", f"sqlite:///{folder.parent}/jobs.sqlite")
    while (job := client.get(fit["self"]).json())["status"] in ("queued", "running"):
        time.sleep(0.1)
    worker.kill()
    assert job["status"] == "done", job
    found = client.get(fit["result"]).json()
    assert found["result"]["mean"][0] == pytest.approx(1.05, abs=0.03)  # the inertia of the rotor matters little
    assert found["physical"][0]["mean"] == pytest.approx(0.8 * 1.05, abs=0.03)
    assert client.get(fit["report"]).is_success
    assert "engagement" not in client.get(fit["pictures"]).text
    assert f"DELETE {fit['self']}" in problem(client.delete("/v1/tables/fitted"), 409)["remedy"]
    assert client.delete("/v1/tables/fitted?force=true").status_code == 204
    assert client.get(fit["report"]).is_success


def test_a_built_table_is_uploaded_as_it_is(client: httpx.Client, folder: Path) -> None:
    content = (folder / "nominal.h5").read_bytes()
    answer = upload(client, "copy", content)
    assert (answer.status_code, answer.headers["Location"]) == (201, "/v1/tables/copy")
    assert answer.json()["digest"] == Table.open(folder / "nominal.h5").digest == Table.open(folder / "copy.h5").digest
    assert upload(client, "copy", content).status_code == 200
    assert client.delete("/v1/tables/copy").status_code == 204


def test_names_are_those_of_files(client: httpx.Client, folder: Path, motor: Path) -> None:
    for taken in ("nominal", "measured"):
        before = (folder / f"{taken}.h5").read_bytes()
        problem(upload(client, taken, motor.read_bytes()), 409)
        assert (folder / f"{taken}.h5").read_bytes() == before
    for name in ("../x", "", ".x", "a/b", 65 * "a"):
        problem(upload(client, name, motor.read_bytes()), 422)
    problem(client.post("/v1/tables?name=x", content=motor.read_bytes()), 415)
    recordings = client.post("/v1/recordings?name=y", content=motor.read_bytes(), headers=HDF5)
    assert recordings.status_code == 422
    assert not any((folder / f"{name}.h5").exists() for name in "xy")


def test_a_damaged_upload_is_refused_and_leaves_no_file(client: httpx.Client, folder: Path, motor: Path) -> None:
    files = sorted(folder.iterdir())
    for content in (motor.read_bytes()[:5000], (folder / "measured.h5").read_bytes()):
        assert problem(upload(client, "damaged", content), 422)["title"] == "Invalid table file"
    assert sorted(folder.iterdir()) == files
