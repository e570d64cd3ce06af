"""Pages and filters of lists: every entry is on exactly one page, and a filter leaves exactly what it says."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from test_problems import problem

from service.settings import Settings


@pytest.fixture(scope="module")
def client(shelf: Path, tmp_path_factory: pytest.TempPathFactory, serving: Any) -> Iterator[httpx.Client]:
    folder = tmp_path_factory.mktemp("lists")
    (folder / "tables").mkdir()
    for file in shelf.iterdir():
        (folder / "tables" / file.name).write_bytes(file.read_bytes())
    (folder / "tables" / "second.h5").write_bytes((shelf / "nominal.h5").read_bytes())
    with serving(Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite")) as address, \
            httpx.Client(base_url=address, timeout=30) as client:
        for number in range(5):
            table = ("nominal", "second")[number % 2]
            client.post("/v1/fits", json={"table": table}, headers={"Idempotency-Key": f"fit-{number}"})
            client.post("/v1/studies", json={}, headers={"Idempotency-Key": f"study-{number}"})
        for number in (0, 3):
            client.post(f"/v1/fits/fit-{number}/cancel")
            client.post(f"/v1/studies/study-{number}/cancel")
        yield client


def names(client: httpx.Client, address: str) -> list[str]:
    """The names on this page and all that follow, by the links; each page says the same total."""
    kind = address.split("?")[0].rpartition("/")[2]
    page = client.get(address).json()
    own = [entry.get("id") or entry["name"] for entry in page[kind]]
    following = names(client, page["links"]["next"]) if "next" in page["links"] else []
    if "limit" in address and "offset=0" not in address and "offset" in address:
        assert client.get(page["links"]["previous"]).json()["total"] == page["total"]
    return own + following


@pytest.mark.parametrize("kind", ["fits", "studies", "tables", "recordings", "benches"])
@pytest.mark.parametrize("limit", [1, 2, 3])
def test_pages_hold_every_entry_once(client: httpx.Client, kind: str, limit: int) -> None:
    whole = client.get(f"/v1/{kind}").json()
    assert whole["links"] == {}
    found = names(client, f"/v1/{kind}?limit={limit}")
    assert found == [entry.get("id") or entry["name"] for entry in whole[kind]]
    assert len(set(found)) == len(found) == whole["total"]
    beyond = client.get(f"/v1/{kind}", params={"offset": 100, "limit": limit}).json()
    assert (beyond[kind], beyond["total"]) == ([], whole["total"])


@pytest.mark.parametrize(("query", "expected"), [
    ("status=cancelled", "30"), ("status=queued", "421"), ("status=done", ""),
    ("status=cancelled&status=queued", "43210"),
    ("table=second", "31"), ("table=second&status=cancelled", "3"), ("table=nominal&limit=2", "420"),
    ("recordings=measured&limit=1", "43210"), ("recordings=others", ""), ("since=2020-01-01T00:00:00Z", "43210"),
    ("since=2999-01-01", "")])
def test_filters_select(client: httpx.Client, query: str, expected: str) -> None:
    assert names(client, f"/v1/fits?{query}") == [f"fit-{number}" for number in expected]
    if "table" not in query:
        assert names(client, f"/v1/studies?{query}") == [f"study-{number}" for number in expected]


def test_since_is_the_time_of_submission(client: httpx.Client) -> None:
    times = {fit["id"]: fit["submitted"] for fit in client.get("/v1/fits").json()["fits"]}
    found = client.get("/v1/fits", params={"since": times["fit-2"]}).json()["fits"]
    assert [fit["id"] for fit in found] == [id for id, time in times.items() if time >= times["fit-2"]]


def test_invalid_filters_are_refused(client: httpx.Client) -> None:
    for query in ("status=finished", "since=yesterday", "since=9138324121101", "limit=0", "limit=1001", "state=done"):
        problem(client.get(f"/v1/fits?{query}"), 422)
    problem(client.get("/v1/studies?table=nominal"), 422)
