"""CSV has the numbers of JSON, with units in the headings, and conditions are described where they are numbered."""

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from test_problems import INPUTS, problem

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
