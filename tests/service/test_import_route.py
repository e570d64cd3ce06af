"""Files and their mapping as an upload: stored as recordings, or refused with the name of the file or channel."""

from pathlib import Path

import httpx
import pytest

from service.settings import Settings
from tests.benches import TABLES
from tests.slipstick.acquisition.conftest import LOCK, MAP, archive, csv, run

ZIP = {"Content-Type": "application/zip"}
FILES = {"channels.toml": MAP.encode(), "runs/a.csv": csv(run()), "runs/b.csv": csv(run(lock=3.0))}


@pytest.fixture(autouse=True)
def compact(settings: Settings) -> None:
    (settings.tables / "compact.toml").write_bytes((TABLES / "compact.toml").read_bytes())


def upload(client: httpx.Client, content: bytes, name: str = "imported", bench: str = "compact") -> httpx.Response:
    return client.post("/v1/recordings/import", params={"name": name, "bench": bench}, content=content, headers=ZIP)


def test_files_and_mapping_become_recordings(client: httpx.Client) -> None:
    response = upload(client, archive(FILES))
    assert response.status_code == 201, response.text
    body = response.json()
    assert body["recordings"]["measured_time"] == pytest.approx([LOCK], abs=3e-3)
    assert body["engagements"] == ["a.csv"]
    aside, = body["set_aside"]
    assert aside["engagement"] == "b.csv"
    assert "no lock-up" in aside["reason"]
    assert client.get(response.headers["Location"]).json() == body["recordings"]
    assert upload(client, archive(FILES)).status_code == 200
    other = {**FILES, "runs/a.csv": csv(run(seed=9))}
    assert upload(client, archive(other)).status_code == 409


def test_a_mapping_of_some_signals_gives_those_and_says_what_stays_open(client: httpx.Client) -> None:
    lines = [line for line in MAP.splitlines() if not line.startswith("pressure")]
    body = upload(client, archive({**FILES, "channels.toml": "\n".join(lines).encode()}), "partial").json()
    assert list(body["recordings"]["signals"]["units"]) == ["input_speed", "output_speed", "output_torque"]
    assert body["open_questions"][0].startswith("pressure not mapped: the recordings hold input_speed, ")


def test_a_wrong_upload_is_refused_and_leaves_no_file(client: httpx.Client, settings: Settings) -> None:
    before = sorted(Path(settings.tables).iterdir())
    response = upload(client, archive({**FILES, "x.mat": b"MATLAB 5.0 MAT-file" + b"\xff" * 999}), "wrong")
    assert response.status_code == 422
    assert "x.mat cannot be read as a MATLAB file" in response.json()["detail"]
    assert response.json()["remedy"]
    assert sorted(Path(settings.tables).iterdir()) == before


def test_what_is_no_archive_and_no_bench_is_refused(client: httpx.Client) -> None:
    response = upload(client, b"PK\x03\x04 nonsense")
    assert (response.status_code, "not a readable ZIP" in response.text) == (422, True)
    assert upload(client, archive(FILES), bench="nowhere").status_code == 404
