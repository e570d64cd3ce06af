"""Which fits the report of a study takes, and what is said of others."""

from collections.abc import Iterator

import httpx
import numpy as np
import pytest

from slipstick.clutch.conditions import paper_conditions
from slipstick.clutch.model import Model
from slipstick.table import Axis, Grid

BEFORE, AFTER = Model(), Model().with_effect("stribeck_friction", {"strength": 0.2})
ORDER = {"recordings": "mine", "recordings_digest": "c3d4", "simulate": False, "parameters": ["pressure_bias"],
         "outside": "clip", "settings": {"seed": 1}}


def table(model: Model) -> Grid:
    axis = Axis("pressure_bias", np.array([0.9, 1.1]), 1.6, "bar")
    return Grid((axis,), np.ones((2, 1)), np.zeros((2, 1), np.uint8), paper_conditions().take([0]), model, "the tests")


@pytest.fixture(scope="module")
def kept(keeping, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A service with tables of both models, and a store that holds studies and fits as if a worker had run them."""
    folder = tmp_path_factory.mktemp("tables")
    tables = {"before": table(BEFORE), "after": table(AFTER)}
    for name, one in tables.items():
        one.write(folder / f"{name}.h5")
    of = {name: {"table": name, "table_digest": one.digest} for name, one in tables.items()}
    found = {"models": {"before": BEFORE.spec(), "after": AFTER.spec()}}
    left, fitted = ({"result": {**found, "answer": {"effects": effects}}} for effects in (["stribeck_friction"], []))
    before, after = (ORDER | of[name] for name in ("before", "after"))
    jobs = {"study": (ORDER, left), "none": (ORDER, fitted), "open": (ORDER, None), "before": (before, fitted),
            "after": (after, fitted), "running": (after, None),
            "foreign": (after | {"recordings_digest": "e5f6"}, fitted),
            "stale": (after | {"table_digest": "old"}, fitted),
            "gone": (after | {"table": "gone", "table_digest": "old"}, fitted),
            "other seed": (after | {"settings": {"seed": 2}}, fitted),
            "simulated": (after | {"simulate": True}, fitted)}
    with keeping(folder, jobs) as client:
        yield client


@pytest.mark.parametrize("part", ["report", "pictures", "pictures/surfaces"])
@pytest.mark.parametrize(("study", "before", "after", "status", "said"), [
    ("study", "before", "afte", 404, "GET /v1/fits lists those"),
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
