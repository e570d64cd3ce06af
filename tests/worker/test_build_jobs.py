"""Builds of tables over HTTP with a real worker: benches and machines, nonsense, cancellation, and kill -9."""

import shutil
import signal
import time
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from job_processes import Bench, ended

import slipstick
from slipstick.clutch.model import Model
from slipstick.storage.library import Library
from slipstick.table import Grid
from tests.benches import HEAVY

ADDRESS = "/v1/builds"
SMALL = {"bench": "heavy", "axes": {"pressure_bias": [0.8, 1.2, 3], "initial_position": [0.8, 1.2, 2]}}
LARGE = {"bench": "heavy", "axes": {"pressure_bias": [0.8, 1.2, 40], "initial_position": [0.8, 1.2, 40],
                                    "current_gain": [0.9, 1.1, 2]}}
"""Some 35 chunks of runs: enough to be killed, cancelled and ended between two of them."""
MOTOR = {"machine": "dc motor", "output": "run_up_time", "axes": {"resistance_value": [0.8, 1.2, 3]}}


@pytest.fixture(scope="module")
def bench(shared_bench: Bench) -> Bench:
    return shared_bench


def refused(client: httpx.Client, status: int, **body: Any) -> dict[str, Any]:
    answer = client.post(ADDRESS, json={"name": "refused", **body})
    assert answer.status_code == status, answer.text
    problem: dict[str, Any] = answer.json()
    assert problem["remedy"]
    return problem


def kept(bench: Bench, name: str) -> list[Path]:
    return list(bench.tables.glob(f".*build-{name}.h5*"))


def is_under_way(job: dict[str, Any]) -> bool:
    assert job["status"] in ("queued", "running"), job
    return job["progress"] is not None and job["progress"]["done"] > 0.02


def test_a_worker_that_lacks_the_file_of_a_machine_leaves_its_table_to_others(bench: Bench) -> None:
    bench.post(ADDRESS, "without", {"name": "tanks", "machine": "two tanks"})
    time.sleep(1.0)  # in which a worker takes what it can do
    waiting = bench.client.get(f"{ADDRESS}/without").json()
    assert waiting["status"] == "queued"
    assert waiting["note"].startswith("No running worker has the machine “two tanks”")
    assert bench.client.post(f"{ADDRESS}/without/cancel").json()["status"] == "cancelled"
    assert bench.client.delete(f"{ADDRESS}/without").status_code == 204


def test_a_build_goes_on_after_its_worker_was_killed(bench: Bench, tmp_path: Path) -> None:
    bench.post(ADDRESS, "killed-build", {"name": "large", **LARGE})
    assert "of 691,200 engagements" in bench.follow("killed-build", is_under_way, address=ADDRESS)["progress"]["doing"]
    assert bench.client.get("/v1/tables/large").status_code == 404
    taken = refused(bench.client, 409, name="large", bench="heavy")
    assert "is being built by /v1/builds/killed-build" in taken["detail"]
    renamed = bench.client.patch("/v1/benches/heavy", json={"name": "other"})
    assert renamed.status_code == 409
    assert f"{ADDRESS}/killed-build" in renamed.json()["detail"]
    bench.kill(bench.worker)
    assert kept(bench, "large")
    bench.work()
    doing = set()

    def is_over(job: dict[str, Any]) -> bool:
        doing.add(job["progress"]["doing"])
        return ended(job)

    job = bench.follow("killed-build", is_over, address=ADDRESS)
    assert (job["status"], job["progress"]["done"]) == ("done", 1.0), job["problem"]
    assert any("from an earlier run" in words for words in doing)
    finished = bench.client.get(job["links"]["result"])
    direct = slipstick.build("heavy", LARGE["axes"], progress=False)  # type: ignore[arg-type]
    assert finished.json()["result"] == {
        "digest": direct.digest, "shape": [40, 40, 2, 216],
        "statuses": {"locked": int((direct.status == 0).sum()), "never_locked": int((direct.status == 1).sum()),
                     "failed": 0}}
    assert bench.client.get("/v1/tables/large").json()["digest"] == direct.digest
    assert not kept(bench, "large")
    assert bench.client.get(job["links"]["result"],
                            headers={"If-None-Match": finished.headers["ETag"]}).status_code == 304
    front = bench.client.get("/").text
    assert "Build of the table large of the bench heavy" in front
    assert 'href="/tables/large"' in front

    bench.post(ADDRESS, "killed-build", {"name": "large", **LARGE})  # the same request gives the same job
    assert bench.client.get(ADDRESS).json()["total"] == 1
    assert "already exists" in refused(bench.client, 409, name="large", bench="heavy")["detail"]


def test_a_model_of_a_calibration_becomes_a_table_under_the_conditions_of_recordings(bench: Bench) -> None:
    spec = Model(HEAVY.physics).with_parameters({"pressure_bias": 1.7}).spec()
    bench.post(ADDRESS, "of-model", {"name": "of-model", "model": spec, "recordings": "few", "axes": SMALL["axes"]})
    job = bench.follow("of-model", ended, address=ADDRESS)
    assert (job["status"], job["bench"], job["recordings"]) == ("done", "heavy", "few"), job["problem"]
    table = Library(bench.tables).table("of-model")
    assert isinstance(table, Grid)
    assert table.model.spec() == spec
    assert table.times.shape == (3, 2, 24)


def test_what_ends_a_build_early_keeps_its_runs_for_the_same_request(bench: Bench) -> None:
    bench.post(ADDRESS, "cancelled", {"name": "early", **LARGE})
    bench.follow("cancelled", is_under_way, address=ADDRESS)
    assert bench.client.post(f"{ADDRESS}/cancelled/cancel").json()["status"] == "cancelled"
    bench.post(ADDRESS, "short", {"name": "early", **LARGE, "time_budget": 0.5})
    job = bench.follow("short", ended, address=ADDRESS)
    assert job["problem"] == ("The time budget of 0.5 s ended before the table was complete. Give a larger time "
                              "budget.")
    bench.post(ADDRESS, "short", {"name": "early", **LARGE, "time_budget": 600})
    doing = bench.follow("short", is_under_way, address=ADDRESS)["progress"]["doing"]
    assert "from an earlier run" in doing
    bench.client.post(f"{ADDRESS}/short/cancel")
    bench.client.post(f"{ADDRESS}/cancelled/cancel")
    bench.follow("short", ended, address=ADDRESS)
    until = time.monotonic() + 10
    while bench.client.delete(f"{ADDRESS}/short").status_code != 204:
        assert time.monotonic() < until
    time.sleep(1.0)  # the process of the cancelled build ends within a second
    bench.client.delete(f"{ADDRESS}/cancelled")
    assert not kept(bench, "early")
    assert bench.client.get("/v1/tables/early").status_code == 404


def test_a_name_that_is_taken_meanwhile_fails_the_build_and_replaces_nothing(bench: Bench) -> None:
    bench.worker.send_signal(signal.SIGSTOP)
    bench.post(ADDRESS, "late", {"name": "late", **SMALL})
    shutil.copy(bench.tables / "nominal.h5", bench.tables / "late.h5")
    bench.worker.send_signal(signal.SIGCONT)
    job = bench.follow("late", ended, address=ADDRESS)
    assert job["problem"] == ("Another file was named 'late' while the table was built. Submit the build again under "
                              "another name.")
    assert (bench.tables / "late.h5").read_bytes() == (bench.tables / "nominal.h5").read_bytes()


def test_a_machine_is_tabulated_by_a_worker_that_has_its_file(bench: Bench) -> None:
    bench.post(ADDRESS, "motor", {"name": "motor", **MOTOR})
    job = bench.follow("motor", ended, address=ADDRESS)
    assert (job["status"], job["machine"], job["bench"]) == ("done", "dc motor", None), job["problem"]
    table = bench.client.get("/v1/tables/motor").json()
    assert (table["output"], [axis["name"] for axis in table["axes"]]) == ("run_up_time", ["resistance_value"])
    assert np.isfinite(Library(bench.tables).table("motor").interpolate(np.ones((1, 1)), "error")).all()
    for change, cause in (({"output": "speed"}, "There is no output 'speed'"),
                          ({"axes": {"speed": [0.8, 1.2, 3]}}, "There is no input 'speed'"),
                          ({"axes": {"resistance_value": [0.1, 1.2, 3]}}, "exceeds the range of the input")):
        refusal = bench.client.post(ADDRESS, json={"name": "wrong", **MOTOR, **change})
        assert refusal.is_client_error  # the worker has told which inputs and outputs there are
        assert cause in refusal.json()["detail"]
    many = {"axes": {"resistance_value": [0.8, 1.2, 1_000_000], "inductance": [0.8, 1.2, 90]}}
    job = bench.client.post(ADDRESS, json={"name": "wrong", **MOTOR, **many}).json()
    assert "The table has 810,000,000 runs; the limit is 100,000,000" in bench.follow(
        job["id"], ended, address=ADDRESS)["problem"]


def test_nonsense_is_refused_with_cause_and_remedy(bench: Bench) -> None:
    client = bench.client
    assert "Give `bench` or `machine`" in refused(client, 422)["remedy"]
    assert "exclude each other" in refused(client, 422, bench="heavy", machine="dc motor")["detail"]
    assert "`accuracy` and `machine`" in refused(client, 422, machine="dc motor", accuracy="tight")["detail"]
    assert "without `machine`" in refused(client, 422, bench="heavy", output="speed")["detail"]
    refused(client, 404, bench="none")
    refused(client, 404, bench="heavy", recordings="none")
    refused(client, 404, bench="heavy", axes={"pressure": [0.8, 1.2, 3]})
    assert "already exists" in refused(client, 409, bench="heavy", name="measured")["detail"]
    assert "not a valid file name" in refused(client, 422, bench="heavy", name="../x")["detail"]
    for count in (100_000_000, 1_000_000):
        large = refused(client, 422 if count > 1_000_000 else 413, bench="heavy",
                        axes={"pressure_bias": [0.8, 1.2, count]})
    assert "SLIPSTICK_BUILD_RUNS" in large["remedy"]
    many = {name: [0.8, 1.2, 1_000_000] for name in ("pressure_bias", "initial_position", "current_gain")}
    assert "the limit is 100,000,000" in refused(client, 413, bench="heavy", axes=many)["detail"]
    refused(client, 413, machine="dc motor", axes=many)
    for axes in ({}, {"pressure_bias": [0.8, 1.2]}, {"pressure_bias": [1.2, 0.8, 3]}, {"pressure_bias": [0.8, 1.2, 1]},
                 {"pressure_bias": [0.8, 1.2, 2.5]}, {"pressure_bias": "0.8:1.2:3"}, [], {"pressure_bias": None}):
        refused(client, 422, bench="heavy", axes=axes)
    for body in ({"accuracy": "best"}, {"time_budget": 0}, {"model": {}}, {"threads": 4}):
        refused(client, 422, bench="heavy", **body)
