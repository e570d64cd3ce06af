"""Benches over HTTP: listed, described, uploaded, and refused with key and line."""

import httpx
import pytest

from service.settings import Settings
from slipstick.bench import parameters
from tests.benches import HEAVY, TABLES

TOML = {"Content-Type": "application/toml"}
COMPACT = (TABLES / "compact.toml").read_text()


def upload(client: httpx.Client, name: str, content: str | bytes) -> httpx.Response:
    return client.post("/v1/benches", params={"name": name}, content=content, headers=TOML)


def test_the_shipped_bench_is_described_in_the_units_of_the_model(client: httpx.Client) -> None:
    entry = next(one for one in client.get("/v1/benches").json()["benches"] if one["name"] == "heavy")
    described = client.get(entry["href"]).json()
    assert entry["digest"] == described["digest"] == HEAVY.digest
    assert described["sensing_digest"] == HEAVY.sensing_digest
    assert [one["name"] for one in described["parameters"]] == list(parameters.NAMES)
    assert tuple(one["value"] for one in described["parameters"]) == HEAVY.physics.nominal
    assert {one["name"] for one in described["parameters"] if one["uncertain"]} == set(HEAVY.uncertain)
    assert described["sensors"]["pressure"] == {"noise": 0.05, "resolution": None, "lag": None}
    assert described["sample_time"] == 0.002
    assert described["conditions"] == 216
    assert len(described["current_profiles"]) == 6
    assert described["torque_converter"] == HEAVY.physics.curves.spec()


def test_an_uploaded_bench_is_used_and_never_replaced(client: httpx.Client, settings: Settings) -> None:
    created = upload(client, "small", COMPACT)
    assert created.status_code == 201
    assert client.get(created.headers["Location"]).json() == created.json()
    assert (settings.tables / "small.toml").read_text() == COMPACT
    assert upload(client, "small", COMPACT.replace("Compact", "Other")).status_code == 409
    assert (settings.tables / "small.toml").read_text() == COMPACT
    # Its profiles number those of a CSV file: profile 4 exists on this bench, and 1.9 s is after its end.
    row = "4,1500,0.4,5,{}\n"
    sheet = "current_profile,motor_speed [rpm],load_inertia [kg m^2],brake_torque [N m],shifting_time [ms]\n" + row
    answers = [client.post("/v1/recordings", params={"name": f"small-{time}", "bench": "small"},
                           content=sheet.format(time), headers={"Content-Type": "text/csv"}) for time in (550, 1900)]
    assert [answer.status_code for answer in answers] == [201, 422]
    assert answers[0].json()["measured_time"] == [pytest.approx(0.55)]
    assert answers[0].json()["conditions"][0]["motor_speed"] == pytest.approx(157.0796327)
    assert "exceeds the 1.8 s" in answers[1].json()["detail"]


@pytest.mark.parametrize(("name", "content", "status", "says"), [
    ("wrong", COMPACT.replace("gear_ratio", "gear_rate"), 422, "line 26, parameters.gear_rate: the key is unknown"),
    ("wrong", COMPACT.replace('"12 bar/A"', '"12 bar"'), 422, "parameters.current_gain.value: the unit 'bar' cannot"),
    ("wrong", "no bench at all", 422, "is not TOML"), ("wrong", b"\xff\xff", 422, "is not UTF-8"),
    ("wrong", COMPACT[:COMPACT.index("[[profiles]]")] + '[profiles]\nfile = "measured.h5"\n', 422,
     "an uploaded bench cannot refer to other files"),
    ("../wrong", COMPACT, 422, "is not a valid file name"), ("", COMPACT, 422, ""), ("heavy", COMPACT, 409, "exists"),
])
def test_what_is_wrong_is_refused_and_leaves_no_file(client: httpx.Client, settings: Settings, name: str,
                                                     content: str | bytes, status: int, says: str) -> None:
    before = {path: path.read_bytes() for path in settings.tables.parent.rglob("*.toml")}
    answer = upload(client, name, content)
    assert answer.status_code == status
    assert says in answer.json()["detail"]
    assert answer.json()["remedy"]
    assert {path: path.read_bytes() for path in settings.tables.parent.rglob("*.toml")} == before


def test_an_invalid_file_is_listed_with_the_reason(client: httpx.Client, settings: Settings) -> None:
    path = settings.tables / "broken.toml"
    path.write_text(COMPACT.replace("[converter]", "[convertor]"))
    try:
        entry = next(one for one in client.get("/v1/benches").json()["benches"] if one["name"] == "broken")
        assert (entry["digest"], entry["title"]) == (None, "")
        assert "convertor: the key is unknown" in entry["problem"]
        assert client.get("/v1/benches/broken").status_code == 422
    finally:
        path.unlink()


def test_recordings_as_csv_need_a_bench(client: httpx.Client) -> None:
    sheet = ("current_profile,motor_speed [rpm],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
             "0,1000,6,20,0.9\n")
    for bench, status in (({}, 422), ({"bench": "none"}, 404)):
        answer = client.post("/v1/recordings", params={"name": "alone", **bench}, content=sheet,
                             headers={"Content-Type": "text/csv"})
        assert answer.status_code == status
    assert client.get("/v1/recordings/alone").status_code == 404


@pytest.mark.parametrize(("route", "body"), [
    ("evaluate", {"points": [[1.0, 1.0]]}),
    ("propagate", {"inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.05]}}),
    ("likelihood", {"candidates": [{"mean": [1.0, 1.0], "std": [0.05, 0.05], "output_std": 0.01}]}),
])
def test_a_table_of_another_bench_is_refused(route: str, body: dict, client: httpx.Client) -> None:
    upload(client, "other", COMPACT)
    assert client.post(f"/v1/{route}", json={**body, "bench": "heavy"}).status_code == 200
    refused = client.post(f"/v1/{route}", json={**body, "bench": "other"})
    assert refused.status_code == 422
    assert "another bench than 'compact'" in refused.json()["detail"]
    assert client.post(f"/v1/{route}", json={**body, "bench": "nowhere"}).status_code == 404
