"""Tables, recordings and benches over HTTP: listed, described, uploaded, and refused with the reason."""

import shutil
from pathlib import Path

import h5py
import httpx
import numpy as np
import pytest

from service.settings import Settings
from slipstick.bench import parameters
from slipstick.storage.library import Library
from slipstick.table import Axis, Grid, Table
from tests.benches import HEAVY, TABLES


def test_a_table_is_described(client: httpx.Client, table: Table) -> None:
    listed = client.get("/v1/tables").json()["tables"]
    entry = next(entry for entry in listed if entry["name"] == "nominal")
    assert (entry["shape"], entry["digest"]) == ([9, 9, 216], table.digest)
    description = client.get(entry["href"]).json()
    assert [(axis["name"], axis["unit"], axis["nominal"]) for axis in description["axes"]] == [
        ("pressure_bias", "bar", 1.6), ("initial_position", "m", 5e-4)]
    assert sum(description["statuses"].values()) == 9 * 9 * 216
    assert description["model"] == table.model.spec()
    assert len(description["conditions"]) == 216
    assert description["conditions"][215]["motor_speed"] == table.conditions.motor_speed[215]


def test_a_rebuilt_table_replaces_the_old_one(client: httpx.Client, settings: Settings, table: Table) -> None:
    grid = np.linspace(0.8, 1.2, 3)
    axes = (Axis("pressure_bias", grid, 1.6, "bar"),)
    conditions = table.conditions.take([0])
    for shift in (0.0, 0.1):
        times = np.linspace(0.5, 0.7, 3)[:, None] + shift
        rebuilt = Grid(axes, times, np.zeros((3, 1), np.uint8), conditions, table.model)
        rebuilt.save(settings.tables / "changing.h5")
        response = client.post("/v1/evaluate", json={"table": "changing", "points": [[1.0]]}).json()
        assert response["table_digest"] == rebuilt.digest
        assert response["shifting_time"][0][0] == pytest.approx(0.6 + shift)
    (settings.tables / "changing.h5").unlink()


def test_a_damaged_table_is_listed_with_the_reason_and_rejected(client: httpx.Client, settings: Settings) -> None:
    content = bytearray((settings.tables / "nominal.h5").read_bytes())
    content[len(content) // 2] ^= 1
    (settings.tables / "damaged.h5").write_bytes(content)
    entry = next(entry for entry in client.get("/v1/tables").json()["tables"] if entry["name"] == "damaged")
    assert entry["digest"] is None
    assert entry["problem"]
    response = client.post("/v1/evaluate", json={"table": "damaged", "points": [[1.0, 1.0]]})
    assert response.status_code == 500
    assert response.json()["remedy"]
    (settings.tables / "damaged.h5").unlink()


def test_temporary_files_are_not_listed(settings: Settings, library: Library) -> None:
    shutil.copy(settings.tables / "nominal.h5", settings.tables / ".nominal.h5.tmp.h5")
    assert library.tables() == ["nominal"]
    (settings.tables / ".nominal.h5.tmp.h5").unlink()


CSV = {"Content-Type": "text/csv"}
HEADER = "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
ROW = "0,104.7197551,6,20,0.9\n"


def test_the_shipped_recordings_are_described_as_simulated(client: httpx.Client) -> None:
    description = client.get("/v1/recordings/measured").json()
    assert "imulated test-bench" in description["description"]
    assert len(description["measured_time"]) == len(description["conditions"]) == 216
    assert description["signals"]["units"]["pressure"] == "bar"


@pytest.mark.parametrize("form", ["csv", "h5"])
def test_an_upload_is_stored_and_usable(client: httpx.Client, settings: Settings, form: str) -> None:
    name = f"bench-{form}"
    content, media_type = (HEADER + ROW).encode(), "text/csv"
    if form == "h5":
        content, media_type = (settings.tables / "measured.h5").read_bytes(), "application/x-hdf5"
    headers = {"Content-Type": media_type}
    response = client.post("/v1/recordings", params={"name": name, "bench": "heavy"}, content=content, headers=headers)
    assert response.status_code == 201
    assert client.get(response.headers["Location"]).json() == response.json()
    likelihood = client.post("/v1/likelihood", json={
        "recordings": name, "candidates": [{"mean": [1, 1], "std": [0.1, 0.1], "output_std": 0.1}]})
    assert likelihood.json()["recordings_digest"] == response.json()["digest"]
    repeated = client.post("/v1/recordings", params={"name": name, "bench": "heavy"}, content=content, headers=headers)
    assert repeated.status_code == 200


def test_an_upload_cannot_be_a_table(client: httpx.Client, settings: Settings, tmp_path: Path) -> None:
    shutil.copy(settings.tables / "measured.h5", tmp_path / "both.h5")
    with h5py.File(tmp_path / "both.h5", "r+") as file:
        file.attrs["layout"] = "slipstick table"
    for content in ((tmp_path / "both.h5").read_bytes(), (settings.tables / "nominal.h5").read_bytes()):
        response = client.post("/v1/recordings", params={"name": "both"}, content=content,
                             headers={"Content-Type": "application/x-hdf5"})
        assert response.status_code == 422
        assert "The file is a table, not recordings" in response.json()["detail"]
    assert not list(settings.tables.glob("*both*"))


def test_a_name_of_the_other_kind_is_said_to_be_of_it(client: httpx.Client) -> None:
    for request, says in (({"table": "measured"}, "There is no table 'measured': 'measured' is recordings"),
                          ({"recordings": "nominal"}, "There is no recordings file 'nominal': 'nominal' is a table")):
        response = client.post("/v1/likelihood", json={
            "candidates": [{"mean": [1, 1], "std": [0.1, 0.1], "output_std": 0.1}], **request})
        assert (response.status_code, response.json()["detail"]) == (404, says)


@pytest.mark.parametrize("name", ["taken", "measured", "nominal"])
def test_an_upload_never_replaces_a_file(client: httpx.Client, settings: Settings, name: str) -> None:
    client.post("/v1/recordings", params={"name": "taken", "bench": "heavy"}, content=HEADER + ROW, headers=CSV)
    before = {path: path.read_bytes() for path in settings.tables.iterdir()}
    response = client.post("/v1/recordings", params={"name": name, "bench": "heavy"}, content=HEADER + ROW + ROW,
                           headers=CSV)
    assert response.status_code == 409
    assert {path: path.read_bytes() for path in settings.tables.iterdir()} == before


@pytest.mark.parametrize(("name", "content"), [
    ("bad", HEADER + ROW + "0,104.7197551,6,20,-1\n"), ("bad", b"\x00\xff"), ("bad", ""), ("../bad", HEADER + ROW)])
def test_an_invalid_upload_leaves_no_file(
        client: httpx.Client, settings: Settings, name: str, content: str | bytes) -> None:
    before = sorted(Path(settings.tables).parent.rglob("*"))
    response = client.post("/v1/recordings", params={"name": name, "bench": "heavy"}, content=content, headers=CSV)
    assert response.status_code == 422
    assert response.json()["remedy"]
    assert sorted(Path(settings.tables).parent.rglob("*")) == before


# Benches over HTTP: listed, described, uploaded, and refused with key and line.


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
    ("wrong", b"\xff\xff", 422, "is not UTF-8"),
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
