"""The progress of a study over REST and on the front page; a worker of an earlier version reported less."""

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.front import jobs
from service.job_store import JobStore
from service.study_schemas import StudyWithProgress
from slipstick.naming.asked import Asked
from slipstick.study import StudySettings
from slipstick.study.progress import StudyProgress, StudySteps
from tests.benches import HEAVY

Running = Callable[[dict[str, Any] | None], httpx.Response]
JOB_INPUT = {"recordings": "few", "recordings_digest": "c3d4", "bench": "heavy", "bench_digest": HEAVY.digest,
             "sensing_digest": HEAVY.sensing_digest, "settings": json.loads(json.dumps(asdict(StudySettings())))}


@pytest.fixture
def running(serving_jobs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A function that returns the status of a running study whose worker has reported this progress."""
    with serving_jobs(tmp_path, {"mine": (JOB_INPUT, None)}) as client:
        def status(progress: dict[str, Any] | None) -> httpx.Response:
            monkeypatch.setattr(JobStore, "progress", lambda *_: progress)
            return client.get("/v1/studies/mine")

        yield status


def test_a_running_study_states_its_step_its_share_and_what_it_tries(running: Running) -> None:
    reported: list[StudyProgress] = []
    tries = Asked("contact", ("contact",), ("friction coefficient", "slip"))
    StudySteps(("pressure", "output_torque", "output_speed", "input_speed"), reported.append).asked(tries)
    found = running(asdict(reported[0])).json()
    assert found["progress"] == {"stage": "name", "step": 7, "steps": 12, "done": 0.5, "doing": reported[0].doing}
    shown = jobs._doing(StudyWithProgress(**found))
    assert '<progress value="0.500" aria-label="Steps of mine">50 %</progress>' in shown
    assert "Step 7 of 12. Block “pressure, slip → torque in full contact”: trying “friction" in shown


def test_progress_of_an_earlier_version_is_left_out(running: Running) -> None:
    for reported in ({"stage": "name", "doing": "asking the blocks"}, None):
        answer = running(reported)
        assert (answer.status_code, answer.json()["progress"]) == (200, None)
        assert "Starting" in jobs._doing(StudyWithProgress(**answer.json()))


def test_a_study_that_is_done_has_done_all_of_its_steps(
        serving_jobs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    last = {"stage": "confirm", "step": 12, "steps": 12, "done": 11 / 12, "doing": "Predicting held-out conditions"}
    monkeypatch.setattr(JobStore, "progress", lambda *_: last)
    with serving_jobs(tmp_path, {"mine": (JOB_INPUT, {"result": {}})}) as client:
        found = client.get("/v1/studies/mine").json()
    assert found["status"] == "done"
    assert found["progress"] == {**last, "done": 1.0}
