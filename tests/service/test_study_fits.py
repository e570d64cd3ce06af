"""Which fits the report of a study takes, and what is said of others."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest

from service.job_store import JobStore
from service.settings import Settings
from slipstick.clutch.conditions import paper_conditions
from slipstick.clutch.model import Model
from slipstick.errors import UnknownName
from slipstick.table import Axis, Grid

BEFORE, AFTER = Model(), Model().with_effect("stribeck_friction", {"strength": 0.2})


def table(model: Model) -> Grid:
    axis = Axis("pressure_bias", np.array([0.9, 1.1]), 1.6, "bar")
    return Grid((axis,), np.ones((2, 1)), np.zeros((2, 1), np.uint8), paper_conditions().take([0]), model, "the tests")


def job(name: str, output: dict[str, Any] | None, **order: Any) -> SimpleNamespace:
    order = {"recordings": "mine", "recordings_digest": "c3d4", "simulate": False, "parameters": ["pressure_bias"],
             "outside": "clip", "settings": {"seed": 1}} | order
    return SimpleNamespace(workflow_id=name, status="SUCCESS" if output else "PENDING", input={"args": [order]},
                           output=output, error=None, created_at=0, completed_at=None, executor_id="worker-1")


@pytest.fixture(scope="module")
def kept(serving, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A service with tables of both models, and a store that holds studies and fits as if a worker had run them."""
    folder = tmp_path_factory.mktemp("tables")
    tables = {"before": table(BEFORE), "after": table(AFTER)}
    for name, one in tables.items():
        one.write(folder / f"{name}.h5")
    of = {name: {"table": name, "table_digest": one.digest} for name, one in tables.items()}
    found = {"models": {"before": BEFORE.spec(), "after": AFTER.spec()}}
    left, fitted = ({"result": {**found, "answer": {"effects": effects}}} for effects in (["stribeck_friction"], []))
    jobs = {one.workflow_id: one for one in (
        job("study", left), job("none", fitted), job("open", None),
        job("before", fitted, **of["before"]), job("after", fitted, **of["after"]),
        job("running", None, **of["after"]), job("foreign", fitted, **of["after"], recordings_digest="e5f6"),
        job("stale", fitted, table="after", table_digest="old"), job("gone", fitted, table="gone", table_digest="old"),
        job("other seed", fitted, **of["after"], settings={"seed": 2}),
        job("simulated", fitted, **of["after"], simulate=True))}

    def find(store: JobStore, name: str) -> SimpleNamespace:
        if name not in jobs:
            raise UnknownName.of(store.workflow, name, jobs)
        return jobs[name]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(JobStore, "find", find)
        with serving(Settings(tables=folder, jobs=f"sqlite:///{folder}/jobs.sqlite")) as address, \
                httpx.Client(base_url=address, timeout=30) as client:
            yield client


@pytest.mark.parametrize("part", ["report", "pictures", "pictures/surfaces"])
@pytest.mark.parametrize(("study", "before", "after", "status", "said"), [
    ("study", "before", "afte", 404, "Did you mean 'after'?"),
    ("study", "before", "running", 409, "Ask again when it is done"),
    ("open", "before", "after", 409, "Ask again when it is done"),
    ("study", "before", None, 422, "Name two fits"),
    ("study", None, "after", 422, "Name two fits"),
    ("none", "before", "after", 422, "Leave `before` and `after` out"),
    ("study", "before", "foreign", 422, "Fit the table to the recordings 'mine'"),
    ("study", "before", "stale", 422, "Submit the fit again"),
    ("study", "before", "gone", 404, "Known: after, before"),
    ("study", "after", "before", 422, "Build it from /v1/studies/study/model?which=before"),
    ("study", "before", "before", 422, "Build it from /v1/studies/study/model?which=after"),
    ("study", "before", "other seed", 422, "Submit the same fit on both tables"),
    ("study", "before", "simulated", 422, "Submit the same fit on both tables")])
def test_fits_that_do_not_belong_to_the_study_are_refused_with_a_remedy(
        kept: httpx.Client, part: str, study: str, before: str | None, after: str | None, status: int,
        said: str) -> None:
    named = {which: fit for which, fit in (("before", before), ("after", after)) if fit}
    answer = kept.get(f"/v1/studies/{study}/{part}", params=named)
    assert (answer.status_code, said in answer.json()["remedy"]) == (status, True), answer.text
