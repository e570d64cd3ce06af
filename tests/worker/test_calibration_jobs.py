"""Calibrations over HTTP with a real worker: benches and declared machines, nonsense, cancellation, and kill -9."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from job_processes import Bench, ended

import slipstick
from slipstick.clutch.model import Model
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import list_experiments, open_machine, write_runs
from slipstick.recordings import Recordings
from slipstick.storage.library import Library

ADDRESS = "/v1/calibrations"
MOTOR, TANKS = open_machine("dc_motor"), open_machine("two_tanks")


@pytest.fixture(scope="module")
def fourteen(few_recordings: Path) -> Recordings:
    """As few engagements as a calibration needs."""
    first = Recordings.open(few_recordings / "few.h5").take(np.arange(14))
    order = np.argsort(np.argsort(first.conditions.run_order))
    return replace(first, conditions=replace(first.conditions, run_order=order))


@pytest.fixture(scope="module")
def bench(shared_bench: Bench, fourteen: Recordings) -> Bench:
    """The shared one, with recordings of the bench and runs of the machine."""
    (shared_bench.tables / "fourteen.h5").write_bytes(fourteen.to_bytes())
    runs = simulate_runs(MOTOR, list_experiments(MOTOR), seed=1)
    (shared_bench.tables / "runs.h5").write_bytes(write_runs(runs, MOTOR))
    return shared_bench


@pytest.fixture(scope="module")
def direct(fourteen: Recordings) -> dict[str, Any]:
    """The calibration in this process, as JSON."""
    result = slipstick.calibrate("heavy", fourteen, progress=False)
    content: dict[str, Any] = json.loads(json.dumps(result.to_dict()))
    return content


def iterating(job: dict[str, Any]) -> bool:
    assert job["status"] in ("queued", "running"), job
    return job["progress"] is not None


def refused(client: httpx.Client, status: int, **body: Any) -> dict[str, Any]:
    answer = client.post(ADDRESS, json=body)
    assert answer.status_code == status, answer.text
    problem: dict[str, Any] = answer.json()
    assert problem["remedy"]
    return problem


def test_a_worker_that_lacks_the_file_of_a_machine_leaves_its_calibration_to_others(bench: Bench) -> None:
    (bench.tables / "tanks.h5").write_bytes(write_runs(simulate_runs(TANKS, list_experiments(TANKS), seed=1), TANKS))
    bench.post(ADDRESS, "lacking", {"recordings": "tanks"})
    bench.post(ADDRESS, "behind", {"recordings": "fourteen", "time_budget": 0.001})
    assert bench.follow("behind", ended, address=ADDRESS)["status"] == "done"
    waiting = bench.client.get(f"{ADDRESS}/lacking").json()
    assert (waiting["status"], waiting["ahead"]) == ("queued", 0)
    assert waiting["note"] == ("No running worker has the machine “two tanks”. The job waits until one is started with "
                               "its file: slipstick work --machine FILE")
    assert bench.client.post(f"{ADDRESS}/lacking/cancel").json()["status"] == "cancelled"
    assert bench.client.delete(f"{ADDRESS}/lacking").status_code == 204


@pytest.mark.parametrize("name", ["calibration", pytest.param("killed-calibration", marks=pytest.mark.slow)])
def test_a_calibration_gives_the_result_of_the_function_also_after_its_worker_was_killed(
        bench: Bench, direct: dict[str, Any], name: str) -> None:
    bench.post(ADDRESS, name, {"recordings": "fourteen"})
    doing = bench.follow(name, iterating, address=ADDRESS)["progress"]["doing"]
    assert "parameters, largest change" in doing
    renamed = bench.client.patch("/v1/benches/heavy", json={"name": "other"})
    assert renamed.status_code == 409
    assert f"{ADDRESS}/{name}" in renamed.json()["detail"]
    assert bench.client.get(f"{ADDRESS}/{name}/result").status_code == 409
    if name == "killed-calibration":
        bench.kill(bench.worker)
        assert bench.client.get(f"{ADDRESS}/{name}").json()["status"] == "running"
        bench.work()
    job = bench.follow(name, ended, address=ADDRESS)
    assert (job["status"], job["bench"], job["machine"], job["progress"]["done"]) == ("done", "heavy", None, 1.0)
    finished = bench.client.get(job["links"]["result"])
    result = finished.json()["result"]
    assert result["parameters"] == direct["parameters"]
    assert result["reduced_chi_square"] == direct["reduced_chi_square"]
    assert result["partial"] is None
    assert list(finished.json()["seconds"]) == ["calibrate"]
    known = {"If-None-Match": finished.headers["ETag"]}
    assert bench.client.get(job["links"]["result"], headers=known).status_code == 304

    model = bench.client.get(job["links"]["model"])
    assert Model.from_spec(model.json()).spec() == direct["model"]
    pictures = bench.client.get(job["links"]["pictures"]).json()["pictures"]
    assert [entry["name"] for entry in pictures] == ["parameters"]
    assert bench.client.get(pictures[0]["href"], params={"format": "svg"}).text.startswith("<svg")
    report = bench.client.get(job["links"]["report"]).text
    for said in (f"<dd>{name}</dd>", "friction coefficient", "90 % interval", "SHA-256", "N m/bar"):
        assert said in report
    front = bench.client.get("/").text
    assert "Calibration to “fourteen” on the bench heavy" in front
    assert "parameters of the bench &#x27;heavy&#x27; fitted" in front

    bench.post(ADDRESS, name, {"recordings": "fourteen"})  # the same request gives the same job
    entries = bench.client.get(ADDRESS).json()["calibrations"]
    assert [entry["id"] for entry in entries].count(name) == 1
    again = bench.client.post(ADDRESS, json={"recordings": "fourteen", "model": model.json()})
    assert again.json()["model_digest"] == Model.from_spec(model.json()).digest
    assert bench.client.post(f"{ADDRESS}/{again.json()['id']}/cancel").json()["status"] == "cancelled"


def test_a_cancelled_calibration_frees_the_worker(bench: Bench) -> None:
    bench.post(ADDRESS, "long", {"recordings": "measured"})
    bench.post(ADDRESS, "next", {"recordings": "fourteen", "time_budget": 0.001})
    bench.follow("long", lambda job: bool(job["status"] == "running"), address=ADDRESS)
    assert bench.client.post(f"{ADDRESS}/long/cancel").json()["status"] == "cancelled"
    assert bench.follow("next", ended, seconds=60, address=ADDRESS)["status"] == "done"
    assert bench.client.delete(f"{ADDRESS}/long").status_code == 204


def test_a_machine_is_calibrated_by_a_worker_that_has_its_file(bench: Bench) -> None:
    bench.post(ADDRESS, "calibrated-motor", {"recordings": "runs"})
    job = bench.follow("calibrated-motor", ended, address=ADDRESS)
    assert (job["status"], job["machine"], job["bench"]) == ("done", "dc motor", None), job["problem"]
    result = bench.client.get(job["links"]["result"]).json()["result"]
    fitted = slipstick.calibrate(MOTOR, bench.tables / "runs.h5", progress=False).to_dict()
    assert result == json.loads(json.dumps(fitted))
    assert bench.client.get(f"{job['links']['self']}/pictures").json()["pictures"] == []
    report = bench.client.get(job["links"]["report"]).text
    for said in ("Parameters of the machine dc motor", "dry torque", "reduced chi-square"):
        assert said in report
    assert not {"model", "pictures"} & job["links"].keys()
    refused_model = bench.client.get(f"{job['links']['self']}/model")
    assert refused_model.status_code == 422
    assert "has no model file" in refused_model.json()["detail"]
    assert "which has no bench" in refused(bench.client, 422, recordings="runs", bench="heavy")["detail"]


def test_nonsense_is_refused_with_cause_and_remedy(bench: Bench) -> None:
    assert "nothing" in refused(bench.client, 404, recordings="nothing")["detail"]
    assert "is a table" in refused(bench.client, 404, recordings="nominal")["detail"]
    assert "none" in refused(bench.client, 404, recordings="fourteen", bench="none")["detail"]
    five = Recordings.open(bench.tables / "few.h5").take(np.arange(5))
    unordered = replace(five, conditions=replace(five.conditions, run_order=None))
    (bench.tables / "five.h5").write_bytes(unordered.to_bytes())
    assert "too few for a calibration" in refused(bench.client, 422, recordings="five", bench="heavy")["detail"]
    shutil.copy(Path(__file__).parents[2] / "tables" / "compact.toml", bench.tables)
    model = Model(Library(bench.tables).bench("compact").physics).spec()
    assert "bench" in refused(bench.client, 422, recordings="fourteen", bench="heavy", model=model)["detail"]
    wrong = Library(bench.tables).table("nominal").model.spec()
    for damage in ({"parameters": {"none": 1.0}}, {"effects": {"no_such_effect": {}}}, {"laws": [{}]},
                   {"parameters": {"pressure_bias": "a"}}, {"bench": {}}):
        body = {"recordings": "fourteen", "bench": "heavy", "model": {**wrong, **damage}}
        answer = bench.client.post(ADDRESS, json=body)
        assert answer.status_code in (404, 422), answer.text
        assert answer.json()["remedy"]
    for body in ({"model": []}, {"time_budget": 0}, {"time_budget": -1}, {"settings": {}}, {"bench": 1}):
        refused(bench.client, 422, recordings="fourteen", **body)
    (bench.tables / "five.h5").unlink()


def test_a_calibration_whose_time_ends_is_partial_and_at_a_bound_without_a_model(bench: Bench) -> None:
    near = '"0.00032 N m/Pa", uncertain = true, lower = 0.5, upper = 1.'
    heavy = (bench.tables / "heavy.toml").read_text()
    (bench.tables / "tight.toml").write_text(heavy.replace(f"{near}5", f"{near}001"))
    bench.post(ADDRESS, "at-bound", {"recordings": "fourteen", "bench": "tight", "time_budget": 0.001})
    assert bench.follow("at-bound", ended, address=ADDRESS)["status"] == "done"
    result = bench.client.get(f"{ADDRESS}/at-bound/result").json()["result"]
    assert result["partial"]["budget"] == 0.001
    assert result["partial"]["missing"] == ["convergence"]
    assert "friction_coefficient" in result["at_bound"]
    answer: httpx.Response = bench.client.get(f"{ADDRESS}/at-bound/model")
    assert answer.status_code == 422
    assert "friction_coefficient" in answer.json()["detail"]
    report = bench.client.get(f"{ADDRESS}/at-bound/report").text
    assert "At a bound" in report
    assert "Partial result:" in report
    (bench.tables / "tight.toml").unlink()
