"""The numbers in the responses equal those of the library, as JSON, arrays, CSV and pictures."""

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from test_problems import INPUTS, problem

from service import npy
from slipstick.inference.problems import table_problem
from slipstick.storage.library import Library
from slipstick.table import Table
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import Candidate, by_sampling, converged, exact, expanded_with_lines
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
    refused = client.post("/v1/evaluate", json=points)
    assert refused.status_code == 422
    assert "Point 0 has pressure_bias = 2, outside the range of the table, 0.5 to 1.5" in refused.json()["detail"]
    assert "`outside` to `clip`" in refused.json()["remedy"]
    rounded = client.post("/v1/evaluate", json={"points": [[np.nextafter(1.5, 2.0), 1.0]], "conditions": [0]}).json()
    assert (rounded["outside"], rounded["points_outside"]) == ("error", 0)
    assert rounded["shifting_time"] == [[table.interpolate(np.array([[1.5, 1.0]]))[0, 0]]]
    array = io.BytesIO()
    np.save(array, np.array(points["points"]))
    assert client.post("/v1/evaluate", content=array.getvalue(),
                       headers={"Content-Type": npy.MEDIA_TYPE}).status_code == 422
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
            ("expansion", expanded_with_lines(problem, candidates, without_checks, ACROSS, 7)),
            ("sampling", by_sampling(problem, candidates, without_checks, standard_normals(2, 1024, 7)))):
        response = client.post("/v1/likelihood", json={**body, "method": method}).json()
        assert response["recordings_digest"] == recordings.digest
        assert [result["per_condition"] for result in response["candidates"]] == expected.tolist()
        assert [result["log10_likelihood"] for result in response["candidates"]] == expected.sum(axis=1).tolist()
    response = client.post("/v1/likelihood", json={**body, "method": "exact", "per_condition": False}).json()
    assert response["candidates"][2]["log10_likelihood"] == exact(problem, candidates[2]).sum()
    assert response["candidates"][2]["per_condition"] is None


# CSV has the numbers of JSON, with units in the headings, and conditions are described where they are numbered.


FIRST = "profile 0, motor 105 rad/s, 6 kg m², brake 20 N m"
CONDITION = ["condition", "current_profile", "motor_speed [rad/s]", "load_inertia [kg m^2]", "brake_torque [N m]"]


def rows(answer: httpx.Response) -> list[dict[str, str]]:
    assert answer.status_code == 200, answer.text
    assert answer.headers["Content-Type"] == "text/csv; charset=utf-8"
    assert answer.headers["Content-Disposition"].endswith('.csv"')
    assert "Accept" in answer.headers["Vary"].split(", ")
    return list(csv.DictReader(io.StringIO(answer.text)))


def both(client: httpx.Client, path: str, body: dict[str, Any]) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """The answer as JSON and as CSV, which parameter and header select alike."""
    table = rows(client.post(path, json=body, params={"format": "csv"}))
    assert table == rows(client.post(path, json=body, headers={"Accept": "text/csv"}))
    return client.post(path, json=body).json(), table


def numbers(table: list[dict[str, str]], heading: str) -> list[float | None]:
    return [float(row[heading]) if row[heading] else None for row in table]


@pytest.fixture(scope="module")
def conditions(client: httpx.Client) -> list[dict[str, float]]:
    found: list[dict[str, float]] = client.get("/v1/tables/nominal").json()["conditions"]
    return found


def test_evaluations(client: httpx.Client, conditions: list[dict[str, float]]) -> None:
    body = {"points": [[1.0, 1.0], [0.9, 1.1], [9.0, 9.0]], "conditions": [215, 0], "outside": "nan"}
    answer, table = both(client, "/v1/evaluate", body)
    assert list(table[0]) == ["point", "pressure_bias", "initial_position", *CONDITION, "shifting_time [s]"]
    assert numbers(table, "shifting_time [s]") == [time for row in answer["shifting_time"] for time in row]
    assert numbers(table, "shifting_time [s]")[-2:] == [None, None]
    for place, row in enumerate(table):
        condition = conditions[(215, 0)[place % 2]]
        assert (int(row["point"]), float(row["pressure_bias"])) == (place // 2, body["points"][place // 2][0])
        assert [float(row[name]) for name in CONDITION] == list(condition.values())
    assert answer["described"][1] == FIRST
    assert client.post("/v1/evaluate", json={**body, "describe": False}).json()["described"] is None
    problem(client.post("/v1/evaluate", json={"points": [[1.0, 1.0]] * 100}, params={"format": "csv"}), 413)


def test_propagations(client: httpx.Client) -> None:
    answer, table = both(client, "/v1/propagate", {"inputs": INPUTS, "conditions": [3, 0], "quantiles": [0.1, 0.9]})
    found = answer["conditions"]
    for name in ("mean", "std", "error"):
        assert numbers(table, f"{name} [s]") == [row[name] for row in found]
    assert numbers(table, "quantile 0.9 [s]") == [row["quantiles"][1] for row in found]
    assert numbers(table, "total of initial_position") == [row["total"][1] for row in found]
    assert [row["described"] for row in found][1] == FIRST
    assert [row["condition"] for row in table] == ["3", "0"]


def test_likelihoods(client: httpx.Client) -> None:
    candidates = [{**INPUTS, "output_std": std} for std in (0.01, 0.1)]
    answer, table = both(client, "/v1/likelihood", {"candidates": candidates})
    assert numbers(table, "log10_density") == [one for row in answer["candidates"] for one in row["per_condition"]]
    assert list(table[0]) == ["candidate", *CONDITION, "shifting_time [s]", "log10_density"]
    measured = client.get("/v1/recordings/measured").json()["measured_time"]
    assert numbers(table, "shifting_time [s]") == measured * 2
    assert (answer["described"][0], len(answer["described"])) == (FIRST, len(measured))
    answer, table = both(client, "/v1/likelihood", {"candidates": candidates, "per_condition": False})
    assert numbers(table, "log10_likelihood") == [row["log10_likelihood"] for row in answer["candidates"]]
    assert answer["described"] is None


def test_residuals(made: Callable[..., dict[str, Any]], shelf: Path, tmp_path: Path, serving_jobs: Any) -> None:
    output = made()
    output["figure_data"]["prediction"]["before"][1] = None
    with serving_jobs(tmp_path, {"fit": ({"recordings": "measured"}, output), "running": ({}, None)}) as client:
        found = client.get("/v1/fits/fit/residuals").json()["residuals"]
        table = rows(client.get("/v1/fits/fit/residuals?format=csv"))
        problem(client.get("/v1/fits/running/residuals"), 409)
    prediction = output["figure_data"]["prediction"]
    assert found[0]["described"] == FIRST
    assert list(table[0])[:5] == CONDITION
    for name, expected in (("measured", prediction["measured"]), ("predicted", prediction["mean"]),
                           ("before", prediction["before"]), ("std", prediction["std"])):
        assert [row[name] for row in found] == numbers(table, f"{name} [s]") == expected
    assert found[5]["residual"] == prediction["measured"][5] - prediction["mean"][5]


def test_residuals_of_another_machine_have_its_unit(made: Callable[..., dict[str, Any]], tmp_path: Path,
                                                    serving_jobs: Any) -> None:
    output = made()
    output["figure_data"] |= {"output": {"name": "largest_current", "unit": "A"}}
    with serving_jobs(tmp_path, {"fit": ({"recordings": "measured"}, output)}) as client:
        table = rows(client.get("/v1/fits/fit/residuals?format=csv"))
    assert list(table[0])[5:] == [f"{name} [A]" for name in ("measured", "before", "predicted", "std", "residual")]


@pytest.fixture(scope="module")
def submitted(client: httpx.Client) -> None:
    for kind in ("fits", "studies"):
        job = client.post(f"/v1/{kind}", json={}).json()["links"]["self"]
        client.post(f"{job}/cancel")


@pytest.mark.parametrize("kind", ["benches", "tables", "recordings", "fits", "studies"])
def test_lists(client: httpx.Client, submitted: None, kind: str) -> None:
    entries = client.get(f"/v1/{kind}").json()[kind]
    table = rows(client.get(f"/v1/{kind}", params={"format": "csv"}))
    assert len(table) == len(entries) > 0
    for entry, row in zip(entries, table, strict=True):
        for name in {"name", "digest", "id", "status", "recordings", "submitted"} & set(entry):
            assert row[name] == entry[name]
        assert not {"links", "settings"} & set(row)
    assert len(rows(client.get(f"/v1/{kind}", params={"format": "csv", "limit": 1}))) == 1
    problem(client.get(f"/v1/{kind}", params={"format": "xml"}), 422)


# Propagations as pictures and pages over HTTP.


BODY = {"inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.08]}, "conditions": [0, 215]}


@pytest.mark.parametrize(("form", "media_type", "start"), [
    ("svg", "image/svg+xml", b"<svg role=\"img\""), ("png", "image/png", b"\x89PNG"),
    ("html", "text/html; charset=utf-8", b"<!doctype html>"), ("json", "application/json", b"{")])
def test_the_same_request_is_drawn(client: httpx.Client, form: str, media_type: str, start: bytes) -> None:
    by_query = client.post(f"/v1/propagate?format={form}", json=BODY)
    by_header = client.post("/v1/propagate", json=BODY, headers={"Accept": media_type.split(";")[0]})
    for answer in (by_query, by_header):
        assert answer.status_code == 200
        assert answer.headers["Content-Type"] == media_type
        assert "Accept" in answer.headers["Vary"].split(", ")
    assert by_query.content.startswith(start)
    assert by_query.content == by_header.content


def test_the_page_has_the_numbers_of_the_answer(client: httpx.Client) -> None:
    numbers = client.post("/v1/propagate", json=BODY).json()
    assert client.post("/v1/propagate", json=BODY, headers={"Accept": "*/*"}).json() == numbers
    page = client.post("/v1/propagate?format=html", json=BODY).text
    for one in numbers["conditions"]:
        assert f">{1e3 * one['mean']:.1f}</td>" in page
        assert f">{100 * one['total'][0]:.0f} %</td>" in page
    assert "215: profile 5, motor" in page


def test_many_conditions_and_unknown_forms_are_refused(client: httpx.Client) -> None:
    answer = client.post("/v1/propagate?format=svg", json={"inputs": BODY["inputs"]})
    assert (answer.status_code, answer.json()["remedy"]) == (413, "Select conditions, or request JSON")
    assert client.post("/v1/propagate?format=pdf", json=BODY).status_code == 422
    assert client.post("/v1/propagate?format=svg", json={**BODY, "output_std": 0}).status_code == 200  # no density
