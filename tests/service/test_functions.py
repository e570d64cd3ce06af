"""The answers of the service are those of the public functions, to the last digit."""

from typing import Any

import httpx
import numpy as np
import pytest

import slipstick
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.table import Table

INPUTS = {"mean": [1.0, 1.1], "std": [0.05, 0.08]}
CONDITIONS = [215, 0, 100]


@pytest.mark.parametrize("changes", [
    {}, {"density_points": 0, "output_std": 0.0, "quantiles": []}, {"tolerance": 2e-3}, {"coefficients": True},
    {"families": ["gamma", "uniform"], "seed": 3, "samples": 1024}, {"correlation": [[1.0, -0.5], [-0.5, 1.0]]},
    {"std": None, "mixing": [[0.05, 0.0], [0.03, 0.04]], "rule": "regression", "runs": 120},
    {"mean": [1.5, 1.0], "outside": "nan"}, {"order": 3, "norm": 0.7, "nodes": 6},
    {"families": ["normal", "beta"], "support": [[0.5, 1.5], [0.8, 1.4]]}])
def test_a_propagation(client: httpx.Client, table: Table, changes: dict[str, Any]) -> None:
    result = slipstick.propagate(table, **{**INPUTS, "conditions": CONDITIONS, **changes}, name="nominal")
    posted = client.post("/v1/propagate", json={**result.request, "table": "nominal"})
    assert posted.status_code == 200, posted.text
    assert posted.json() == result.answer
    drawn = client.post("/v1/propagate?format=csv", json={**result.request, "table": "nominal"})
    assert drawn.text.splitlines()[0] == ",".join(result.columns)


def test_the_defaults_of_a_propagation_are_those_of_the_function(client: httpx.Client, table: Table) -> None:
    posted = client.post("/v1/propagate", json={"inputs": INPUTS}).json()
    result = slipstick.propagate(table, **INPUTS, density_points=0, name="nominal")
    assert posted == result.answer


@pytest.mark.parametrize("changes", [
    {}, {"method": "exact"}, {"method": "expansion", "order": 4, "seed": 2}, {"method": "sampling", "samples": 512},
    {"families": ["gamma", "lognormal"], "output_std": 0.05}, {"mean": [1.45, 1.0], "outside": "nan"},
    {"std": None, "mixing": [[0.05, 0.0], [0.03, 0.04]]}])
def test_a_likelihood(client: httpx.Client, table: Table, library: Library, shelf: Any,
                      changes: dict[str, Any]) -> None:
    recordings = library.recording("measured")
    result = slipstick.likelihood(shelf / "nominal.h5", recordings, **{**INPUTS, "output_std": 0.02, **changes},
                                  name="measured")
    posted = client.post("/v1/likelihood", json={**result.request, "table": "nominal"})
    assert posted.status_code == 200, posted.text
    assert posted.json() == result.answer


def test_times_in_another_unit_are_refused_as_by_a_fit(client: httpx.Client, library: Library) -> None:
    recordings = library.recording("measured")
    wrong = Recordings(recordings.conditions, 1e-3 * recordings.measured_time).to_bytes()
    assert client.post("/v1/recordings", params={"name": "kiloseconds"}, content=wrong,
                       headers={"Content-Type": "application/x-hdf5"}).status_code == 201
    try:
        refused = [client.post(path, json={"recordings": "kiloseconds", **body}) for path, body in (
            ("/v1/likelihood", {"candidates": [{**INPUTS, "output_std": 0.02}]}), ("/v1/fits", {}))]
    finally:
        client.delete("/v1/recordings/kiloseconds")
    assert [each.status_code for each in refused] == [422, 422]
    assert refused[0].json()["detail"] == refused[1].json()["detail"]


def test_a_likelihood_of_zero_has_no_number(client: httpx.Client, shelf: Any) -> None:
    recordings = Recordings.open(shelf / "measured.h5")
    result = slipstick.likelihood(shelf / "nominal.h5", recordings, [9.0, 9.0], [0.01, 0.01], 0.02, outside="nan",
                                  name="measured")
    assert result.log10_likelihood == -np.inf
    assert result.error is None
    assert client.post("/v1/likelihood", json={**result.request, "table": "nominal"}).json() == result.answer
    assert "is 0: at all relevant inputs, the model has no shifting time for 216 of them" in result.summary()[0]
