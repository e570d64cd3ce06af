"""Fits and studies through real processes: the service takes them in, the worker runs them, and both may be killed."""

import json
import logging
import signal
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from dbos import error as dbos_error
from job_processes import ENDLESS, SETTINGS, SHORT, Bench, ended, in_stage

from slipstick.errors import InvalidValue
from slipstick.inference.problems import table_problem
from slipstick.recordings import Recordings
from slipstick.storage.database import file_of, open_database
from slipstick.storage.library import Library
from slipstick.time_budget import TimeBudgetEnded
from slipstick.uncertainty import fit
from worker.__main__ import main
from worker.work import is_unexpected
from worker.worker_name import locked_name


@pytest.fixture
def bench(shared_bench: Bench) -> Bench:
    shared_bench.run_both()
    shared_bench.cancel_all()
    return shared_bench


def study_in_stage(stage: str) -> Callable[[dict[str, Any]], bool]:
    def reached(found: dict[str, Any]) -> bool:
        assert found["status"] in ("queued", "running"), found
        return found["progress"] is not None and bool(found["progress"]["stage"] == stage)

    return reached


def uninterrupted(shelf: Path, **changes: Any) -> dict[str, Any]:
    """The result of the same fit in this process, without worker, service, database or JSON."""
    library, settings = Library(shelf), fit.FitSettings(**{**SETTINGS, **changes})
    problem = table_problem(library.table("nominal"), library.recording("measured"), "clip")
    state = fit.final_state(settings, problem)
    estimate = fit.refined_estimate(settings, problem, state)
    while not fit.has_all_intervals(settings, estimate):
        estimate = fit.with_next_interval(settings, problem, estimate)
    return fit.summary(settings, problem, state, estimate)


@pytest.mark.slow
def test_killed_in_any_stage_a_fit_ends_with_the_result_of_an_uninterrupted_one(bench: Bench, shelf: Path) -> None:
    bench.submit("killed", **SETTINGS)
    bench.follow("killed", in_stage("search", 3))
    bench.kill(bench.worker, bench.service)
    bench.serve()
    cut = bench.follow("killed", lambda found: True)
    assert 3 <= cut["progress"]["generation"] < 12
    for stage in ("refine", "intervals", "conclude"):
        bench.work()
        bench.follow("killed", in_stage(stage, 12))
        bench.kill(bench.worker)
    bench.work()
    assert bench.follow("killed", ended)["status"] == "done"
    result = bench.client.get("/v1/fits/killed/result").json()
    assert result["result"] == json.loads(json.dumps(uninterrupted(shelf)))
    assert list(result["seconds"]) == ["open", "search", "refine", "intervals", "conclude"]


@pytest.mark.slow
def test_killed_in_any_stage_a_study_ends_with_the_result_of_an_uninterrupted_one(
        bench: Bench, few_study: dict[str, Any]) -> None:
    bench.post("/v1/studies", "killed-study", {"recordings": "few"})
    bench.follow("killed-study", study_in_stage("name"), address="/v1/studies")
    bench.kill(bench.worker)
    bench.work()
    bench.follow("killed-study", study_in_stage("confirm"), address="/v1/studies")
    bench.kill(bench.worker)
    stages = set()

    def ended_after(found: dict[str, Any]) -> bool:
        stages.add(found["progress"]["stage"])
        return ended(found)

    bench.work()
    assert bench.follow("killed-study", ended_after, address="/v1/studies")["status"] == "done"
    assert stages == {"confirm"}, "the blocks were asked again"
    result = bench.client.get("/v1/studies/killed-study/result").json()
    assert result["result"] == few_study["result"]
    assert list(result["seconds"]) == ["name", "confirm"]


@pytest.mark.slow
def test_a_fit_whose_time_budget_ends_is_partial_and_computed_anew_by_the_same_request(bench: Bench) -> None:
    budget, body = 8.0, {"settings": {**ENDLESS, "generations": 10_000, "patience": 10_000}}
    bench.submit("warm", **SHORT)  # so that the budget is not spent on imports
    bench.follow("warm", ended)
    bench.post("/v1/fits", "short-of-time", {**body, "time_budget": budget})
    bench.follow("short-of-time", in_stage("search", 1))
    bench.kill(bench.worker)
    bench.work()
    left = bench.follow("short-of-time", in_stage("search", 2))["progress"]["budget_left"]
    assert 0 <= left < budget
    assert bench.follow("short-of-time", ended, seconds=120)["status"] == "done"
    stored = bench.client.get("/v1/fits/short-of-time/result").json()
    result, partial = stored["result"], stored["result"]["partial"]
    searched = f"{result['generations']} of at most 10000 generations of the search"
    assert partial == {"budget": budget, "done": [searched],
                       "missing": ["the rest of the search", "refinement", "intervals"]}
    assert sum(stored["seconds"][stage] for stage in ("open", "search")) == pytest.approx(budget, abs=1.0)
    assert result["mean"] == result["searched"]["mean"]
    assert (result["refined"], result["intervals"]) == (False, [])
    assert "Partial result:" in bench.client.get("/v1/fits/short-of-time/report").text
    assert "Partial result: pressure bias" in bench.client.get("/").text

    bench.post("/v1/fits", "short-of-time", body)  # the same but for the budget
    bench.follow("short-of-time", in_stage("search", result["generations"] + 1))
    bench.client.post("/v1/fits/short-of-time/cancel")


def test_a_fit_without_time_says_so(bench: Bench) -> None:
    bench.post("/v1/fits", "no-time", {"settings": SHORT, "time_budget": 1e-3})
    assert bench.follow("no-time", ended)["problem"] == (
        "The time budget of 0.001 s ended before the search began. Give a larger time budget.")
    bench.post("/v1/fits", "no-time", {"settings": SHORT, "time_budget": 600})
    assert bench.follow("no-time", ended)["status"] == "done"
    assert bench.client.get("/v1/fits/no-time/result").json()["result"]["partial"] is None


@pytest.mark.parametrize(("error", "is_logged"), [
    (InvalidValue("It is wrong", "Give another one"), False), (TimeBudgetEnded("It ended", "Give more"), False),
    (dbos_error.DBOSAwaitedWorkflowCancelledError("a-job"), False), (ZeroDivisionError("a defect"), True)])
def test_the_log_has_what_a_job_does_not_tell_itself(error: Exception, is_logged: bool) -> None:
    record = logging.LogRecord("dbos", logging.ERROR, "", 0, "A job failed", (), (type(error), error, None))
    assert is_unexpected(record) == is_logged


@pytest.mark.slow
def test_a_study_whose_time_budget_ends_has_what_was_named_or_says_that_there_is_nothing(bench: Bench) -> None:
    bench.post("/v1/studies", "no-time-study", {"recordings": "few", "time_budget": 0.01})
    failed = bench.follow("no-time-study", ended, address="/v1/studies")
    assert failed["problem"] == ("The time budget of 0.01 s ended before a block of the model was examined. Give a "
                                 "larger time budget.")
    bench.post("/v1/studies", "confirming", {"recordings": "measured", "time_budget": 20.0})
    assert bench.follow("confirming", ended, address="/v1/studies")["status"] == "done"
    result = bench.client.get("/v1/studies/confirming/result").json()["result"]
    assert result["partial"]["budget"] == 20
    assert result["partial"]["done"][0] == "the block “current → pressure”"
    assert result["gap"] is None
    assert result["before"] is None
    assert result["sentence"].startswith("Partial answer, as the time budget ended. ")
    assert "Partial result:" in bench.client.get("/v1/studies/confirming/report").text
    assert bench.client.get("/v1/studies/confirming/model").status_code == 409


@pytest.mark.slow
def test_a_fit_does_not_wait_behind_a_study_but_a_study_does_until_it_is_cancelled(bench: Bench) -> None:
    for name in ("long-study", "next-study"):
        bench.post("/v1/studies", name, {"recordings": "measured"})
    bench.submit("beside-study", **SHORT)
    bench.follow("long-study", study_in_stage("name"), address="/v1/studies")
    assert bench.follow("beside-study", ended)["status"] == "done"
    assert bench.client.get("/v1/studies/long-study").json()["status"] == "running"
    waiting = bench.client.get("/v1/studies/next-study").json()
    assert (waiting["status"], waiting["ahead"]) == ("queued", 0)
    assert bench.client.post("/v1/studies/long-study/cancel").json()["status"] == "cancelled"
    bench.follow("next-study", study_in_stage("name"), address="/v1/studies")
    assert bench.client.get("/v1/studies/long-study").json()["status"] == "cancelled"


@pytest.mark.slow
@pytest.mark.parametrize(("stage", "settings"), [("search", ENDLESS), ("refine", {**SETTINGS, "generations": 1})])
def test_a_cancelled_fit_frees_the_worker(bench: Bench, stage: str, settings: dict[str, Any]) -> None:
    long, after = f"long-{stage}", f"after-{stage}"
    bench.submit(long, **settings)
    bench.submit(after, **SHORT)
    bench.follow(long, in_stage(stage, 1))
    assert bench.client.get(f"/v1/fits/{after}").json()["status"] == "queued"
    assert bench.client.post(f"/v1/fits/{long}/cancel").json()["status"] == "cancelled"
    assert bench.follow(after, ended, seconds=30)["status"] == "done"
    assert bench.client.get(f"/v1/fits/{long}").json()["status"] == "cancelled"
    assert bench.client.get(f"/v1/fits/{long}/result").status_code == 409


@pytest.mark.parametrize(("options", "message"), [
    (["--tables", "no/such/folder"], "There is no folder 'no/such/folder'"),
    (["--tables", ".", "--name", "a b/../c"], "'a b/../c' is no name of a worker")])
def test_a_worker_that_could_run_no_job_does_not_start(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str) -> None:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert main(["work", "--jobs", f"sqlite:///{tmp_path}/jobs.sqlite", *options]) == 1
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    assert message in capsys.readouterr().err


def test_a_fit_of_a_table_that_changed_meanwhile_fails_and_says_why(bench: Bench) -> None:
    table = Library(bench.tables).table("nominal")
    table.save(bench.tables / "changing.h5")
    bench.submit("ahead", **ENDLESS)
    bench.post("/v1/fits", "stale", {"table": "changing", "settings": SETTINGS})
    type(table)(table.axes, table.times + (table.times > 0) * 1e-3, table.status, table.conditions, table.model
                ).save(bench.tables / "changing.h5")
    bench.client.post("/v1/fits/ahead/cancel")
    found = bench.follow("stale", ended)
    assert found["status"] == "failed"
    assert found["problem"] == "The table 'changing' changed after the fit was submitted. Submit the fit again."
    failed, = bench.client.get("/v1/fits?status=failed").json()["fits"]
    assert failed["problem"] == found["problem"]


def test_jobs_with_recordings_that_cannot_be_of_their_bench_fail_in_their_first_step_and_say_why(bench: Bench) -> None:
    few = Recordings.open(bench.tables / "few.h5")
    assert few.signals is not None
    reverse = replace(few, signals=replace(few.signals, output_torque=-few.signals["output_torque"]))
    (bench.tables / "reverse.h5").write_bytes(reverse.to_bytes())
    bench.post("/v1/studies", "study", {"recordings": "reverse"})
    bench.post("/v1/fits", "fit", {"recordings": "reverse", "simulate": True, "settings": ENDLESS})
    for found in (bench.follow("study", ended, address="/v1/studies"), bench.follow("fit", ended)):
        assert found["status"] == "failed"
        assert found["problem"].startswith("The output torque of the recordings has the opposite sign of that of the "
                                           "simulation, in 24 of 24 engagements. If its sensor counts the other way")
        assert found["progress"] is None or found["progress"].get("stage", "start") == "start"


@pytest.mark.slow
def test_a_dead_workers_job_is_taken_over_within_ten_seconds(bench: Bench) -> None:
    def workers() -> int:
        return int(bench.client.get("/v1/health").json()["workers"])

    bench.submit("taken-over", **ENDLESS)
    bench.follow("taken-over", in_stage("search", 1))
    assert workers() == 1
    second = bench.launch("worker", "work", "--name", "worker-2", **bench.environment)
    deadline = time.monotonic() + 60
    while workers() < 2:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert "'worker-1'" in bench.client.get("/v1/fits/taken-over").json()["note"]
    bench.kill(bench.worker)
    killed = time.monotonic()
    before = bench.follow("taken-over", lambda found: True)["progress"]["generation"]
    bench.follow("taken-over", lambda found: found["status"] == "running" and "'worker-2'" in found["note"]
                 and found["progress"]["generation"] > before, seconds=20)
    assert time.monotonic() < killed + 10
    assert workers() == 1
    bench.client.post("/v1/fits/taken-over/cancel")
    bench.kill(second)
    while workers():
        assert time.monotonic() < killed + 30
        time.sleep(0.1)


@pytest.mark.slow
def test_a_worker_that_stood_still_leaves_its_job_to_the_other(bench: Bench) -> None:
    bench.submit("stood-still", **ENDLESS)
    bench.follow("stood-still", in_stage("search", 1))
    second = bench.launch("worker", "work", "--name", "worker-2", **bench.environment)
    bench.follow("stood-still", lambda _: bench.client.get("/v1/health").json()["workers"] == 2)
    stop_outside_a_transaction(bench)
    bench.follow("stood-still", lambda found: found["status"] == "running" and "'worker-2'" in found["note"])
    bench.worker.send_signal(signal.SIGCONT)
    bench.submit("after-standing", **SHORT)  # which only the first worker is free to run
    assert bench.follow("after-standing", ended, seconds=60)["status"] == "done"
    assert "'worker-2'" in bench.follow("stood-still", in_stage("search", 1))["note"]
    bench.client.post("/v1/fits/stood-still/cancel")
    bench.kill(second)


def stop_outside_a_transaction(bench: Bench) -> None:
    """Stop the worker, but not while it holds the lock of the database, without which nobody can write."""
    while True:
        bench.worker.send_signal(signal.SIGSTOP)
        database = sqlite3.connect(bench.environment["SLIPSTICK_JOBS"].removeprefix("sqlite:///"), timeout=1)
        with closing(database), suppress(sqlite3.OperationalError):
            database.execute("BEGIN IMMEDIATE")
            database.rollback()
            return
        bench.worker.send_signal(signal.SIGCONT)


def test_a_name_is_one_worker_until_it_is_stopped(bench: Bench) -> None:
    engine, file = open_database(bench.environment["SLIPSTICK_JOBS"]), file_of(bench.environment["SLIPSTICK_JOBS"])
    bench.submit("endless", **ENDLESS)
    bench.follow("endless", in_stage("search", 1))
    with pytest.raises(InvalidValue, match="A worker named 'worker-1' is already running"), \
            locked_name("worker-1", engine, file):
        pass
    bench.worker.terminate()
    assert bench.worker.wait(timeout=10) == 0
    with locked_name("worker-1", engine, file):
        assert bench.client.get("/v1/fits/endless").json()["status"] == "running"  # it waits for the name


@pytest.mark.slow
def test_a_job_goes_on_after_its_worker_was_stopped_and_no_second_one_of_its_name_starts(bench: Bench) -> None:
    bench.submit("stopped", **ENDLESS)
    before = bench.follow("stopped", in_stage("search", 1))
    assert bench.launch("worker", "work", **bench.environment).wait(timeout=60) == 1
    bench.worker.terminate()
    assert bench.worker.wait(timeout=10) == 0
    bench.work()
    bench.follow("stopped", in_stage("search", before["progress"]["generation"] + 5))
