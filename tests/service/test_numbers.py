"""The numbers in the responses equal those of the library, and are correct."""

import io

import httpx
import numpy as np
import pytest

from service import npy
from slipstick.inference import table_problem
from slipstick.storage.library import Library
from slipstick.table import Table
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import Candidate, by_expansion, by_sampling, converged, exact
from slipstick.uncertainty.likelihood.line_rules import ACROSS

POINTS = [[1.0, 1.0], [0.9, 1.1], [0.5, 1.5]]
CONDITIONS = [215, 0, 100]


def test_evaluate_returns_the_shifting_times_of_the_table(client: httpx.Client, table: Table) -> None:
    response = client.post("/v1/evaluate", json={"points": POINTS, "conditions": CONDITIONS}).json()
    assert response["table_digest"] == table.digest
    assert response["points_outside"] == 0
    assert response["shifting_time"] == table.interpolate(np.array(POINTS))[:, CONDITIONS].tolist()


def test_answers_name_the_physical_values_of_the_axes(client: httpx.Client) -> None:
    inputs = {"mean": [1.0, 1.0], "std": [0.05, 0.05]}
    for path, body in (("/v1/evaluate", {"points": POINTS}), ("/v1/propagate", {"inputs": inputs}),
                       ("/v1/likelihood", {"candidates": [{**inputs, "output_std": 0.01}]})):
        assert client.post(path, json=body).json()["axes"] == [
            {"name": "pressure_bias", "nominal": 1.6, "unit": "bar"},
            {"name": "initial_position", "nominal": 5e-4, "unit": "m"}]


def test_evaluate_with_npy_returns_the_same_shifting_times(client: httpx.Client, table: Table) -> None:
    body = io.BytesIO()
    np.save(body, np.asfortranarray(POINTS, dtype=np.float32))
    response = client.post("/v1/evaluate", params={"conditions": CONDITIONS}, content=body.getvalue(),
                         headers={"Content-Type": "application/x-npy", "Accept": "application/x-npy"})
    assert response.headers["Slipstick-Table-Digest"] == table.digest
    times = np.load(io.BytesIO(response.content))
    assert np.array_equal(times, table.interpolate(np.float32(POINTS).astype(float))[:, CONDITIONS])


def test_an_array_that_is_sent_in_pieces_is_complete(client: httpx.Client, table: Table) -> None:
    points = np.column_stack([np.linspace(0.8, 1.2, 1500), np.linspace(1.2, 0.8, 1500)])
    response = client.post("/v1/evaluate", json={"points": points.tolist()}, headers={"Accept": npy.MEDIA_TYPE})
    expected = io.BytesIO()
    np.save(expected, table.interpolate(points))
    assert len(response.content) > 2 * npy.PIECE
    assert response.headers["Content-Length"] == str(len(response.content))
    assert response.content == expected.getvalue()


def test_the_outside_policy_is_the_same_for_all_operations(client: httpx.Client, table: Table) -> None:
    points = {"points": [[2.0, 1.0], [1.0, 1.0]], "conditions": [0]}
    inputs = {"mean": [1.45, 1.0], "std": [0.1, 0.05]}
    requests = [("/v1/evaluate", points), ("/v1/propagate", {"inputs": inputs, "conditions": [0]}),
                ("/v1/likelihood", {"candidates": [{**inputs, "output_std": 0.01}]})]
    for path, body in requests:
        response = client.post(path, json={**body, "outside": "error"})
        assert (response.status_code, response.json()["type"]) == (422, "urn:slipstick:problem:outside-table")
    clip, nan = ([client.post(path, json={**body, "outside": outside}).json() for path, body in requests]
                 for outside in ("clip", "nan"))
    edge = table.interpolate(np.array([[1.5, 1.0]]))[0, 0]
    assert [row[0] for row in clip[0]["shifting_time"]] == [edge, table.interpolate(np.ones((1, 2)))[0, 0]]
    assert nan[0]["shifting_time"][0] == [None]
    assert clip[0]["points_outside"] == 1
    assert clip[1]["conditions"][0]["mean"] is not None
    assert nan[1]["conditions"][0]["mean"] is None
    assert nan[1]["conditions"][0]["reason"]
    assert clip[2]["candidates"][0]["log10_likelihood"] < 0
    # With `nan`, inputs outside have no density, and an expansion with a node outside does not exist.
    assert nan[2]["candidates"][0]["log10_likelihood"] < clip[2]["candidates"][0]["log10_likelihood"] - 0.1
    expanded = client.post("/v1/likelihood", json={**requests[2][1], "outside": "nan", "method": "expansion"}).json()
    assert expanded["candidates"][0]["log10_likelihood"] is None
    for result in (clip[1], nan[1], clip[2]["candidates"][0]):
        assert result["mass_outside"] == pytest.approx(0.3085, abs=1e-4)  # P(N(1.45, 0.1^2) > 1.5)


def test_propagate_agrees_with_monte_carlo(client: httpx.Client, table: Table) -> None:
    mixing = [[0.05, 0.0], [0.03, 0.04]]
    response = client.post("/v1/propagate", json={
        "inputs": {"mean": [1.0, 1.1], "mixing": mixing}, "output_std": 0.003, "conditions": CONDITIONS,
        "density_points": 201, "coefficients": True}).json()
    points = Inputs(mean=np.array([1.0, 1.1]), mixing=np.array(mixing)).points(standard_normals(2, 1 << 16, 3))
    times = table.interpolate(points)[:, CONDITIONS]
    times += 0.003 * np.random.default_rng(1).standard_normal(times.shape)
    for column, distribution in enumerate(response["conditions"]):
        assert distribution["condition"] == CONDITIONS[column]
        assert distribution["mean"] == pytest.approx(times[:, column].mean(), abs=2e-4)
        assert distribution["std"] == pytest.approx(times[:, column].std(), rel=0.03)
        assert distribution["quantiles"] == pytest.approx(np.quantile(times[:, column], [0.05, 0.5, 0.95]), abs=2e-3)
        steps = np.diff(distribution["density_time"]) * 1e3  # the density is per ms
        assert np.sum(np.array(distribution["density"])[1:] * steps) == pytest.approx(1, abs=0.01)
        assert len(distribution["coefficients"]) == len(response["degrees"]) == 45
        assert distribution["coefficients"][response["degrees"].index([0, 0])] == distribution["mean"]


def test_likelihood_returns_the_values_of_the_library(client: httpx.Client, library: Library, table: Table) -> None:
    recordings = library.recording("measured")
    problem = table_problem(table, recordings, "clip")
    candidates = [Candidate(Inputs(mean=np.array([1.0, mean]), std=np.array([0.05, 0.08])), 0.02)
                  for mean in np.linspace(0.8, 1.2, 5)]
    body = {"samples": 1024, "seed": 7, "candidates": [
        {"mean": candidate.inputs.mean.tolist(), "std": [0.05, 0.08], "output_std": 0.02} for candidate in candidates]}
    without_checks = ExpansionSettings(checks=0)
    for method, expected in (
            ("auto", np.array([converged(problem, candidate, 7)[0] for candidate in candidates])),
            ("expansion", by_expansion(problem, candidates, without_checks, ACROSS)),
            ("sampling", by_sampling(problem, candidates, without_checks, standard_normals(2, 1024, 7)))):
        response = client.post("/v1/likelihood", json={**body, "method": method}).json()
        assert response["recordings_digest"] == recordings.digest
        assert [result["per_condition"] for result in response["candidates"]] == expected.tolist()
        assert [result["log10_likelihood"] for result in response["candidates"]] == expected.sum(axis=1).tolist()
    response = client.post("/v1/likelihood", json={**body, "method": "exact", "per_condition": False}).json()
    assert response["candidates"][2]["log10_likelihood"] == exact(problem, candidates[2]).sum()
    assert response["candidates"][2]["per_condition"] is None
