"""The report of a study accepts two comparable fits of its models and rejects others with a remedy."""

from collections.abc import Iterator

import httpx
import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.table import Axis, Grid
from tests.benches import HEAVY, NOMINAL

BEFORE, AFTER = NOMINAL, NOMINAL.with_effect("stribeck_friction", {"strength": 0.2})
JOB_INPUT = {"recordings": "mine", "recordings_digest": "c3d4", "simulate": False, "parameters": ["pressure_bias"],
             "outside": "clip", "settings": {"seed": 1}}


def table(model: Model) -> Grid:
    axis = Axis("pressure_bias", np.array([0.9, 1.1]), 1.6, "bar")
    return Grid((axis,), np.ones((2, 1)), np.zeros((2, 1), np.uint8), HEAVY.conditions.take([0]), model, "the tests")


@pytest.fixture(scope="module")
def client(serving_jobs, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A service with tables of both models and a job store that contains studies and fits."""
    folder = tmp_path_factory.mktemp("tables")
    tables = {"before": table(BEFORE), "after": table(AFTER)}
    for name, grid in tables.items():
        grid.write(folder / f"{name}.h5")
    before, after = (JOB_INPUT | {"table": name, "table_digest": grid.digest} for name, grid in tables.items())
    extended, unchanged = (
        {"result": {"before": {"model": BEFORE.spec()}, "after": {"model": model.spec()}, "gap": gap}}
        for model, gap in ((AFTER, {}), (BEFORE, None)))
    jobs = {"study": (JOB_INPUT, extended), "none": (JOB_INPUT, unchanged), "open": (JOB_INPUT, None),
            "before": (before, unchanged), "after": (after, unchanged), "running": (after, None),
            "foreign": (after | {"recordings_digest": "e5f6"}, unchanged),
            "stale": (after | {"table_digest": "old"}, unchanged),
            "gone": (after | {"table": "gone", "table_digest": "old"}, unchanged),
            "other seed": (after | {"settings": {"seed": 2}}, unchanged),
            "simulated": (after | {"simulate": True}, unchanged)}
    with serving_jobs(folder, jobs) as client:
        yield client


@pytest.mark.parametrize("part", ["report", "pictures", "pictures/surfaces"])
@pytest.mark.parametrize(("study", "before", "after", "status", "remedy"), [
    ("study", "before", "afte", 404, "GET /v1/fits returns"),
    ("study", "before", "running", 409, "when its status is `done`"),
    ("open", "before", "after", 409, "when its status is `done`"),
    ("study", "before", None, 422, "Give both, or neither"),
    ("study", None, "after", 422, "Give both, or neither"),
    ("none", "before", "after", 422, "Omit `before` and `after`"),
    ("study", "before", "foreign", 422, "Fit the table to the recordings 'mine'"),
    ("study", "before", "stale", 422, "Submit the fit again"),
    ("study", "before", "gone", 404, "Known: after, before"),
    ("study", "after", "before", 422, "Build a table from /v1/studies/study/model?which=before"),
    ("study", "before", "before", 422, "Build a table from /v1/studies/study/model?which=after"),
    ("study", "before", "other seed", 422, "Submit the same fit on both tables"),
    ("study", "before", "simulated", 422, "Submit the same fit on both tables")])
def test_fits_that_do_not_belong_to_the_study_are_rejected_with_a_remedy(
        client: httpx.Client, part: str, study: str, before: str | None, after: str | None, status: int,
        remedy: str) -> None:
    named = {which: fit for which, fit in (("before", before), ("after", after)) if fit}
    response = client.get(f"/v1/studies/{study}/{part}", params=named)
    assert (response.status_code, remedy in response.json()["remedy"]) == (status, True), response.text
