"""The numbers that come over the wire are those of the library, and right."""

import io

import httpx
import numpy as np
import pytest

from slipstick.inference import table_problem
from slipstick.storage.library import Library
from slipstick.table import Table
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import Candidate, by_expansion, by_sampling, converged, exact

POINTS = [[1.0, 1.0], [0.9, 1.1], [0.5, 1.5]]
CONDITIONS = [215, 0, 100]


def test_evaluate_gives_the_numbers_of_the_table(client: httpx.Client, table: Table) -> None:
    answer = client.post("/v1/evaluate", json={"points": POINTS, "conditions": CONDITIONS}).json()
    assert answer["table_digest"] == table.digest
    assert answer["points_outside"] == 0
    assert answer["shifting_time"] == table.interpolate(np.array(POINTS))[:, CONDITIONS].tolist()


def test_evaluate_takes_and_gives_npy_with_the_same_numbers(client: httpx.Client, table: Table) -> None:
    body = io.BytesIO()
    np.save(body, np.asfortranarray(POINTS, dtype=np.float32))
    answer = client.post("/v1/evaluate", params={"conditions": CONDITIONS}, content=body.getvalue(),
                         headers={"Content-Type": "application/x-npy", "Accept": "application/x-npy"})
    assert answer.headers["Slipstick-Table-Digest"] == table.digest
    times = np.load(io.BytesIO(answer.content))
    assert np.array_equal(times, table.interpolate(np.float32(POINTS).astype(float))[:, CONDITIONS])


def test_the_outside_policy_means_the_same_everywhere(client: httpx.Client, table: Table) -> None:
    beyond = {"points": [[2.0, 1.0], [1.0, 1.0]], "conditions": [0]}
    inputs = {"mean": [1.45, 1.0], "std": [0.1, 0.05]}
    requests = [("/v1/evaluate", beyond), ("/v1/propagate", {"inputs": inputs, "conditions": [0]}),
                ("/v1/likelihood", {"candidates": [{**inputs, "output_std": 0.01}]})]
    for path, body in requests:
        refused = client.post(path, json={**body, "outside": "error"})
        assert (refused.status_code, refused.json()["type"]) == (422, "urn:slipstick:problem:outside-table")
    clip, gap = ([client.post(path, json={**body, "outside": outside}).json() for path, body in requests]
                 for outside in ("clip", "nan"))
    edge = table.interpolate(np.array([[1.5, 1.0]]))[0, 0]
    assert [row[0] for row in clip[0]["shifting_time"]] == [edge, table.interpolate(np.ones((1, 2)))[0, 0]]
    assert gap[0]["shifting_time"][0] == [None]
    assert clip[0]["points_outside"] == 1
    assert clip[1]["conditions"][0]["mean"] is not None
    assert gap[1]["conditions"][0]["mean"] is None
    assert gap[1]["conditions"][0]["reason"]
    assert clip[2]["candidates"][0]["log10_likelihood"] < 0
    # Inputs in the gap have no density; an expansion with a node in it does not exist.
    assert gap[2]["candidates"][0]["log10_likelihood"] < clip[2]["candidates"][0]["log10_likelihood"] - 0.1
    expanded = client.post("/v1/likelihood", json={**requests[2][1], "outside": "nan", "method": "expansion"}).json()
    assert expanded["candidates"][0]["log10_likelihood"] is None
    for answer in (clip[1], gap[1], clip[2]["candidates"][0]):
        assert answer["mass_outside"] == pytest.approx(0.3085, abs=1e-4)  # P(N(1.45, 0.1^2) > 1.5)


def test_propagate_agrees_with_plain_monte_carlo(client: httpx.Client, table: Table) -> None:
    mixing = [[0.05, 0.0], [0.03, 0.04]]
    answer = client.post("/v1/propagate", json={
        "inputs": {"mean": [1.0, 1.1], "mixing": mixing}, "output_std": 0.003, "conditions": CONDITIONS,
        "density_points": 201, "coefficients": True}).json()
    points = Inputs(mean=np.array([1.0, 1.1]), mixing=np.array(mixing)).points(standard_normals(2, 1 << 16, 3))
    times = table.interpolate(points)[:, CONDITIONS]
    times += 0.003 * np.random.default_rng(1).standard_normal(times.shape)
    for column, found in enumerate(answer["conditions"]):
        assert found["condition"] == CONDITIONS[column]
        assert found["mean"] == pytest.approx(times[:, column].mean(), abs=2e-4)
        assert found["std"] == pytest.approx(times[:, column].std(), rel=0.03)
        assert found["quantiles"] == pytest.approx(np.quantile(times[:, column], [0.05, 0.5, 0.95]), abs=2e-3)
        steps = np.diff(found["density_time"]) * 1e3  # the density is per ms
        assert np.sum(np.array(found["density"])[1:] * steps) == pytest.approx(1, abs=0.01)
        assert len(found["coefficients"]) == len(answer["degrees"]) == 45
        assert found["coefficients"][answer["degrees"].index([0, 0])] == found["mean"]


def test_likelihood_gives_the_numbers_of_the_library(client: httpx.Client, library: Library, table: Table) -> None:
    recordings = library.recording("measured")
    problem = table_problem(table, recordings, "clip")
    candidates = [Candidate(Inputs(mean=np.array([1.0, mean]), std=np.array([0.05, 0.08])), 0.02)
                  for mean in np.linspace(0.8, 1.2, 5)]
    body = {"samples": 1024, "seed": 7, "candidates": [
        {"mean": one.inputs.mean.tolist(), "std": [0.05, 0.08], "output_std": 0.02} for one in candidates]}
    plain = ExpansionSettings(checks=0)
    for method, expected in (
            ("auto", np.array([converged(problem, one, 7)[0] for one in candidates])),
            ("expansion", by_expansion(problem, candidates, plain)),
            ("sampling", by_sampling(problem, candidates, plain, standard_normals(2, 1024, 7)))):
        answer = client.post("/v1/likelihood", json={**body, "method": method}).json()
        assert answer["recordings_digest"] == recordings.digest
        assert [found["per_condition"] for found in answer["candidates"]] == expected.tolist()
        assert [found["log10_likelihood"] for found in answer["candidates"]] == expected.sum(axis=1).tolist()
    answer = client.post("/v1/likelihood", json={**body, "method": "exact", "per_condition": False}).json()
    assert answer["candidates"][2]["log10_likelihood"] == exact(problem, candidates[2]).sum()
    assert answer["candidates"][2]["per_condition"] is None
