import shutil
from pathlib import Path

import h5py
import httpx
import pytest

from service.settings import Settings

CSV = {"Content-Type": "text/csv"}
HEADER = "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
ROW = "0,104.7197551,6,20,0.9\n"


def test_the_shipped_recordings_are_described_as_simulated(client: httpx.Client) -> None:
    description = client.get("/v1/recordings/measured").json()
    assert "imulated test-bench" in description["description"]
    assert len(description["measured_time"]) == len(description["conditions"]) == 216
    assert description["signals"]["units"]["pressure"] == "bar"


def test_only_the_recorded_signals_are_described(client: httpx.Client, settings: Settings, tmp_path: Path) -> None:
    shutil.copy(settings.tables / "measured.h5", tmp_path / "some.h5")
    with h5py.File(tmp_path / "some.h5", "r+") as file:
        del file["signals/pressure"]
    response = client.post("/v1/recordings", params={"name": "without-pressure"},
                           content=(tmp_path / "some.h5").read_bytes(), headers={"Content-Type": "application/x-hdf5"})
    assert response.status_code == 201, response.text
    assert response.json()["signals"]["units"] == {
        "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}


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
    assert not list(settings.tables.glob("*both*"))


@pytest.mark.parametrize("name", ["taken", "measured", "nominal"])
def test_an_upload_never_replaces_a_file(client: httpx.Client, settings: Settings, name: str) -> None:
    client.post("/v1/recordings", params={"name": "taken", "bench": "heavy"}, content=HEADER + ROW, headers=CSV)
    before = {path: path.read_bytes() for path in settings.tables.iterdir()}
    response = client.post("/v1/recordings", params={"name": name, "bench": "heavy"}, content=HEADER + ROW + ROW,
                           headers=CSV)
    assert response.status_code == 409
    assert {path: path.read_bytes() for path in settings.tables.iterdir()} == before


@pytest.mark.parametrize(("name", "content"), [
    ("bad", HEADER + ROW + "0,104.7197551,6,20,-1\n"), ("bad", "nonsense"), ("bad", b"\x00\xff"), ("bad", ""),
    ("../bad", HEADER + ROW), ("a/b", HEADER + ROW), (".bad", HEADER + ROW), ("", HEADER + ROW)])
def test_an_invalid_upload_leaves_no_file(
        client: httpx.Client, settings: Settings, name: str, content: str | bytes) -> None:
    before = sorted(Path(settings.tables).parent.rglob("*"))
    response = client.post("/v1/recordings", params={"name": name, "bench": "heavy"}, content=content, headers=CSV)
    assert response.status_code == 422
    assert response.json()["remedy"]
    assert sorted(Path(settings.tables).parent.rglob("*")) == before
