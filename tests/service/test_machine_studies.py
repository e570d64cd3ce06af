"""Runs of declared machines over REST: uploads, pages, orders of studies, and their results."""

import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.settings import Settings
from slipstick.engine.simulation import simulate_runs
from slipstick.errors import InvalidValue
from slipstick.machine import Runs, list_experiments, open_machine, write_runs
from slipstick.machine_studies import MachineFigures, MachineStudyResult
from slipstick.machine_studies.result import MachineBlock, MachineFinding, MachineGap, MachineParameter
from slipstick.storage.library import Library
from slipstick.storage.shipped import FOLDER
from slipstick.studies.finding import Coefficient, Law
from tests.service.conftest import Serving, ServingJobs

MOTOR = open_machine("dc_motor")
H5 = {"Content-Type": "application/x-hdf5"}
LAW = Law([-1.0, 0.0, 1.0], "rad/s", [-0.1, 0.0, 0.1], [-0.2, -0.1, 0.0], [0.0, 0.1, 0.2], "N m", False, "nothing",
          False, None)
FINDING = MachineFinding("Viscous bearing: friction torque that depends on the speed", "friction torque", "speed",
                         "viscous bearing", "proportional", "change of the friction torque = (0.1 N m/(rad/s)) * speed",
                         [Coefficient("slope", "N m/(rad/s)", 0.1, 0.05, 0.15, False)], ["shaft"], 200.0, 9.0, [], LAW,
                         None)
RESULT = MachineStudyResult(
    "dc motor", "effect", "Missing: friction torque that depends on the speed (proportional)", [FINDING],
    [MachineBlock("shaft", "current, load torque → speed", 1.0, 2.0, False)],
    [MachineParameter("dry torque", "N m", 0.015, 0.014, 0.016, 0.001, True, False)], None, [3], 9, {"speed": 0.3},
    {"speed": "rad/s"}, "digest of runs", "digest of settings")
ORDER = {"recordings": "runs", "recordings_digest": "digest of runs", "machine": "dc motor", "bench": None,
         "bench_digest": None, "sensing_digest": None, "settings": {}, "time_budget": 60.0}
OUTPUT = {"result": asdict(RESULT), "figure_data": asdict(MachineFigures()), "seconds": {"study": 1.0},
          "processor_seconds": {"study": 1.0}}


@pytest.fixture(scope="module")
def runs() -> Runs:
    return simulate_runs(MOTOR, list_experiments(MOTOR), seed=1)


def upload(client: httpx.Client, name: str, runs: Runs) -> httpx.Response:
    return client.post("/v1/recordings", params={"name": name}, content=write_runs(runs, MOTOR), headers=H5)


def test_runs_are_uploaded_described_listed_and_studied(serving: Serving, tmp_path: Path, runs: Runs) -> None:
    with serving(Settings(tables=tmp_path, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")) as address, \
            httpx.Client(base_url=address, timeout=60) as client:
        described = upload(client, "runs", runs)
        assert described.status_code == 201
        assert {name: described.json()[name] for name in ("machine", "runs", "signals", "commands")} == {
            "machine": "dc motor", "runs": 9, "signals": ["current", "speed"], "commands": ["voltage"]}
        assert described.json()["units"]["speed"] == "rad/s"
        assert upload(client, "runs", runs).status_code == 200
        assert upload(client, "runs", replace(runs, order=None)).status_code == 409
        named = replace(runs, names=tuple(f"motor.mf4, run {number}" for number in range(9)), order=None)
        assert upload(client, "named", named).json()["names"][3] == "motor.mf4, run 3"
        assert "Run 3: motor.mf4, run 3</h2>" in client.get("/recordings/named?run=3").text
        assert client.delete("/v1/recordings/named").status_code == 204
        entry, = client.get("/v1/recordings").json()["recordings"]
        assert (entry["engagements"], entry["problem"]) == (9, None)
        page = client.get("/recordings/runs").text
        for text in ("dc motor", "load torque [N m]", "501 samples", "9 runs of the machine"):
            assert text in page
        study = client.post("/v1/studies", json={"recordings": "runs", "engine": {"nats": 20.0}}).json()
        assert (study["machine"], study["bench"], study["settings"]["nats"]) == ("dc motor", None, 20.0)
        assert "of the machine “dc motor”" in client.get("/").text
        wrong = client.post("/v1/studies", json={"recordings": "runs", "engine": {"level": 0.9}})
        assert wrong.status_code == 422
        refused = client.post("/v1/studies", json={"recordings": "runs", "settings": {"nats": 20.0}})
        assert refused.status_code == 422
        assert refused.json()["errors"][0]["what"] == (
            "The key is unknown here, but known as engine.nats and settings.naming.nats; "
            "Known: catalogue, level, naming, seed")


def test_settings_and_benches_that_have_no_meaning_are_refused(serving: Serving, tmp_path: Path, runs: Runs,
                                                               few_recordings: Path) -> None:
    (tmp_path / "runs.h5").write_bytes(write_runs(runs, MOTOR))
    shutil.copy(few_recordings / "few.h5", tmp_path)
    shutil.copy(FOLDER / "heavy.toml", tmp_path)
    with serving(Settings(tables=tmp_path, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")) as address, \
            httpx.Client(base_url=address, timeout=60) as client:
        for order, remedy in (({"recordings": "runs", "settings": {"level": 0.99}}, "Omit `bench` and `settings`"),
                              ({"recordings": "runs", "bench": "heavy"}, "Omit `bench` and `settings`"),
                              ({"recordings": "few", "engine": {"nats": 20.0}}, "Omit `engine`")):
            refused = client.post("/v1/studies", json=order)
            assert (refused.status_code, remedy in refused.text) == (422, True), refused.text
        assert client.get("/v1/studies").json()["total"] == 0


def test_a_study_of_two_runs_is_refused(serving: Serving, tmp_path: Path, runs: Runs) -> None:
    (tmp_path / "runs.h5").write_bytes(write_runs(runs.take(slice(2)), MOTOR))
    with serving(Settings(tables=tmp_path, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")) as address, \
            httpx.Client(base_url=address, timeout=60) as client:
        refused = client.post("/v1/studies", json={"recordings": "runs"})
        assert refused.status_code == 422
        assert refused.json()["detail"] == "A study needs at least 3 runs that can agree, and the recordings have 2"
        assert client.get("/v1/studies").json()["total"] == 0


@pytest.mark.parametrize("damage", [b"", b"\x89HDF\r\n\x1a\n", None])
def test_a_damaged_file_is_refused(serving: Serving, tmp_path: Path, runs: Runs, damage: bytes | None) -> None:
    content = write_runs(runs, MOTOR)
    with serving(Settings(tables=tmp_path)) as address, httpx.Client(base_url=address, timeout=60) as client:
        sent = content[:len(content) // 2] if damage is None else damage
        answer = client.post("/v1/recordings", params={"name": "bad"}, content=sent, headers=H5)
        assert answer.status_code == 422
        assert not list(tmp_path.glob("*.h5"))


def test_runs_are_no_measured_outputs_and_are_deleted_like_other_recordings(serving: Serving, tmp_path: Path,
                                                                            runs: Runs) -> None:
    (tmp_path / "runs.h5").write_bytes(write_runs(runs, MOTOR))
    for read in (Library(tmp_path).measured, Library(tmp_path).recording):
        with pytest.raises(InvalidValue, match="holds runs of the machine 'dc motor'"):
            read("runs")
    with serving(Settings(tables=tmp_path)) as address, httpx.Client(base_url=address, timeout=60) as client:
        assert client.delete("/v1/recordings/runs").status_code == 204
    assert not (tmp_path / "runs.h5").exists()


def test_a_result_has_its_laws_pictures_and_report(serving_jobs: ServingJobs, tmp_path: Path) -> None:
    with serving_jobs(tmp_path, {"motor": (ORDER, OUTPUT)}) as client:
        def get(path: str) -> Any:
            answer = client.get(f"/v1/studies/motor/{path}")
            assert answer.status_code == 200, answer.text
            return answer

        assert get("result").json()["result"] == asdict(RESULT)
        law, = get("laws").json()["laws"]
        assert (law["effect"], law["equation"]) == ("viscous bearing", FINDING.equation)
        assert "friction_torque_over_speed_change" in get("laws/0?format=h").text
        assert [entry["name"] for entry in get("pictures").json()["pictures"]] == ["law"]
        assert get("pictures/law?format=svg").text.startswith("<svg")
        report = get("report").text
        for text in ("Set aside: run 3,", "dry torque", "0.1 N m/(rad/s)"):
            assert text in report
        refused = client.get("/v1/studies/motor/model")
        assert refused.status_code == 422
        assert "declared machine" in refused.json()["detail"]


def test_each_link_of_a_job_of_a_machine_answers(serving_jobs: ServingJobs, tmp_path: Path) -> None:
    order = {**ORDER, "model_digest": None}
    fitted = {"machine": "dc motor", "parameters": OUTPUT["result"]["parameters"], "chi_square": {"shaft": 1.0},
              "set_aside": []}
    outputs = {"studies": OUTPUT, "calibrations": {**OUTPUT, "result": fitted, "figure_data": {}}}
    with serving_jobs(tmp_path, {kind: (order, output) for kind, output in outputs.items()}) as client:
        for kind in outputs:
            links = client.get(f"/v1/{kind}/{kind}").json()["links"]
            assert "model" not in links
            assert {"report", "result"} < links.keys()
            assert ("pictures" in links) == (kind == "studies")  # a calibration of a machine has none
            for name, link in links.items():
                if name != "cancel":  # by POST
                    assert client.get(link).status_code == 200, link
            assert f'<a href="/#{kind}">{kind.capitalize()}</a>' in client.get(f"/{kind}/{kind}").text


def test_the_squares_of_two_studies_have_a_unit(serving_jobs: ServingJobs, tmp_path: Path) -> None:
    gap = MachineGap(786182.0, 459.0, 0.999, "Offset of the speed sensor", 0.1, 5000.0, 80.0, converged=True)
    lost = replace(gap, closed=None, converged=False)
    first, second = ({**OUTPUT, "result": asdict(replace(RESULT, gap=each))} for each in (gap, lost))
    with serving_jobs(tmp_path, {"first": (ORDER, first), "second": (ORDER, second)}) as client:
        page = client.get("/compare", params={"kind": "study", "first": "first", "second": "second"}).text
        assert client.get("/v1/studies/second/result").json()["result"]["gap"]["closed"] is None
    assert "786182 to 459 squared residuals beyond noise" in page
    assert "a fit did not converge" in page
