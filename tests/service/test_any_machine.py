"""docs/any_machine.md: its commands are executed as written, from the simulator to the fit."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from service.settings import Settings
from slipstick.black_box import BlackBox, Measurements
from slipstick.table import Table

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
PROGRAMS = f"{Path(sys.executable).parent}:/usr/bin:/bin"
DOCS = ROOT / "docs"
PAGE = (DOCS / "any_machine.md").read_text()
BLOCKS = [block.strip().splitlines() for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)]


def executed(line: str, folder: Path, address: str = "") -> str:
    """The output of a command of the page, with the service at `address`."""
    command = line.replace("python -m", f"{sys.executable} -m")
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=folder, capture_output=True, text=True,
                          env={"PATH": PROGRAMS, "PYTHONPATH": str(ROOT), "SLIPSTICK": address,
                               "OPENBLAS_NUM_THREADS": os.environ.get("OPENBLAS_NUM_THREADS", "1")},
                          timeout=120, check=False)
    assert done.returncode == 0 or line.startswith("while"), (line, done.stdout, done.stderr)
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the example, and the tables that its commands build."""
    folder = tmp_path_factory.mktemp("motor")
    for name in ("motor.py", "motor.toml", "motor.csv"):
        shutil.copy(DOCS / name, folder)
    (folder / "tables").mkdir()
    for line in BLOCKS[0] + BLOCKS[1]:
        executed(line, folder)
    return folder


@pytest.fixture(scope="module")
def answers(folder: Path, serving: Any, launch: Callable[..., object]) -> dict[str, Any]:
    """The responses to the requests of the page, by the end of their path."""
    settings = Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite")
    found = {}
    with serving(settings) as address:
        launch("worker", "work", "--tables", str(settings.tables), "--jobs", settings.jobs,
               "--machine", str(folder / "motor.toml"))
        for line in (line for block in BLOCKS[2:] for line in block):
            path = re.search(r"/v1/([^ \"?]+)", line)
            output = executed(line, folder, address) if path else ""
            if path and output:
                found[path[1]] = json.loads(output)
        found["table"] = httpx.get(f"{address}/v1/tables/motor").json()
        found["info"] = httpx.get(f"{address}/umbridge/Info").json()
        found["study"] = httpx.post(f"{address}/v1/studies", json={"recordings": "motor-measured"}).json()
        found["repeated"] = httpx.post(f"{address}/v1/recordings", params={"name": "motor-measured", "table": "motor"},
                                       content=(folder / "motor.csv").read_bytes(),
                                       headers={"Content-Type": "text/csv"}).status_code
    return found


def test_the_description_on_the_page_is_that_of_the_file() -> None:
    on_page, = (tomllib.loads(text) for text in re.findall(r"```toml\n(title.*?)```", PAGE, re.DOTALL))
    of_file = tomllib.loads((DOCS / "motor.toml").read_text())
    assert {key: on_page[key] for key in ("title", "simulator", "output")} == {
        key: of_file[key] for key in ("title", "simulator", "output")}
    assert on_page["inputs"]["resistance"] == of_file["inputs"]["resistance"]


def test_the_tables_reproduce_the_simulator(folder: Path) -> None:
    sys.path.insert(0, str(DOCS))
    from motor import run_up_time

    table, file = Table.open(folder / "tables" / "motor.h5"), BlackBox.open(folder / "motor.toml")
    assert table.model == file.description
    assert (table.output.name, table.output.unit) == ("run_up_time", "s")
    for tolerance, name in ((1e-12, "motor"), (0.01, "motor-surrogate")):
        times = Table.open(folder / "tables" / f"{name}.h5").interpolate(np.array([[0.7, 1.3]]))[0]
        expected = [run_up_time(1.2 * 0.7, 0.1 * 1.3, *row) for row in file.cases.values]
        np.testing.assert_allclose(times, expected, rtol=tolerance)


def test_the_service_answers_in_the_words_of_the_machine(answers: dict[str, Any]) -> None:
    table = answers["table"]
    assert (table["output"], table["unit"]) == ("run_up_time", "s")
    assert table["condition_units"] == {"voltage": "V", "inertia": "kg m^2"}
    assert table["conditions"][2] == {"number": 2, "values": {"voltage": 18.0, "inertia": 0.002}}
    uploaded = answers["recordings"]
    assert (uploaded["output"], uploaded["unit"], len(uploaded["measured_time"])) == ("run_up_time", "s", 30)
    assert 0.1 < uploaded["measured_time"][0] < 1.0  # written in ms
    assert answers["repeated"] == 200
    assert answers["evaluate"]["axes"][0] == {"name": "resistance", "nominal": 1.2, "unit": "ohm"}
    assert all(entry["reason"] is None and entry["std"] > 0.002 for entry in answers["propagate"]["conditions"])
    first, second = (entry["log10_likelihood"] for entry in answers["likelihood"]["candidates"])
    assert second > first + 1  # the second candidate has the means of the simulated measurements
    assert answers["info"]["models"] == ["motor", "motor-surrogate", "motor/motor-measured",
                                         "motor-surrogate/motor-measured"]
    assert "another machine" in answers["study"]["detail"]


def test_fits_find_the_inputs_of_the_measurements(answers: dict[str, Any], folder: Path) -> None:
    by_table, direct = answers["fits/motor-fit/result"], answers["fits/motor-direct/result"]
    assert by_table["result"]["mean"] == pytest.approx([1.05, 0.9], abs=0.06)
    assert by_table["result"]["log10_likelihood"] > by_table["result"]["before"]["log10_likelihood"] + 1
    assert by_table["physical"][0]["unit"] == "ohm"
    assert by_table["physical"][0]["mean"] == pytest.approx(1.2 * by_table["result"]["mean"][0])
    assert direct["result"]["log10_likelihood"] > direct["result"]["before"]["log10_likelihood"]
    assert "<html" in (folder / "report.html").read_text()


def test_measurements_are_stored_with_their_description(answers: dict[str, Any], folder: Path) -> None:
    stored = Measurements.read(folder / "tables" / "motor-measured.h5")
    motor = BlackBox.open(folder / "motor.toml").description
    written = Measurements.read_csv((folder / "motor.csv").read_bytes(), motor)
    assert stored.digest == written.digest == answers["recordings"]["digest"]
    assert "Simulated" in stored.description
