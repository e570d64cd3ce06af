import shutil

import httpx
import numpy as np
import pytest

from service.settings import Settings
from slipstick.storage.library import Library
from slipstick.table import Axis, Grid, Table


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
        rebuilt.write(settings.tables / "changing.h5")
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
