"""ETag and 304: a response that has not changed is not sent or drawn again, one that has is; and gzip."""

import gzip
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import httpx
import numpy as np
import pytest
from test_problems import problem

from service.drawings import Drawings
from service.settings import Settings
from slipstick.machine import Runs, write_runs
from slipstick.machine.runs_file import MARK
from slipstick.storage.children import Kept


@pytest.fixture
def folder(shelf: Path, tmp_path: Path) -> Path:
    shutil.copytree(shelf, tmp_path / "tables")
    return tmp_path / "tables"


@pytest.fixture
def client(folder: Path, serving: Any) -> Iterator[httpx.Client]:
    with serving(Settings(tables=folder, jobs=f"sqlite:///{folder.parent}/jobs.sqlite")) as address, \
            httpx.Client(base_url=address, timeout=30) as client:
        yield client


@pytest.fixture
def with_fit(made: Callable[..., dict[str, Any]], folder: Path, serving_jobs: Any) -> Iterator[httpx.Client]:
    digests = {"table_digest": "t", "recordings_digest": "r", "bench": None, "bench_digest": None,
               "sensing_digest": None}
    job_input = {"table": "nominal", "recordings": "measured", "simulate": False, "outside": "clip",
                 "parameters": ["pressure_bias", "initial_position"], "settings": {"seed": 1}, **digests}
    with serving_jobs(folder, {"fit": (job_input, made())}) as client:
        yield client


def again(client: httpx.Client, path: str, tag: str, **headers: str) -> httpx.Response:
    return client.get(path, headers={"If-None-Match": tag, **headers})


@pytest.mark.parametrize("path", ["/v1/tables/nominal", "/v1/recordings/measured", "/v1/benches/heavy"])
def test_files_are_sent_once(client: httpx.Client, path: str) -> None:
    first = client.get(path)
    tag = first.headers["ETag"]
    same = again(client, path, tag)
    assert (same.status_code, same.content, same.headers["ETag"]) == (304, b"", tag)
    assert "content-type" not in same.headers
    for known in (f'"a", {tag}', tag.removeprefix("W/"), "*"):
        assert again(client, path, known).status_code == 304
    for other in ('"a"', "", tag[:-2] + 'x"'):
        assert again(client, path, other).content == first.content
    assert again(client, path, tag, Accept="text/html").headers["ETag"] != tag


def test_a_changed_file_is_sent_again(client: httpx.Client, folder: Path) -> None:
    tag = client.get("/v1/recordings/measured").headers["ETag"]
    with h5py.File(folder / "measured.h5", "a") as file:
        file.attrs["description"] = "another one"
    changed = again(client, "/v1/recordings/measured", tag)
    assert changed.json()["description"] == "another one"
    (folder / "runs.h5").write_bytes(write_runs(
        Runs(np.arange(9.0), {"speed": np.ones((2, 9))}, units={"speed": "m/s"}, machine="first")))
    tags = {path: client.get(path).headers["ETag"] for path in ("/v1/recordings/runs", "/recordings/runs")}
    with h5py.File(folder / "runs.h5", "a") as file:
        file.attrs[MARK] = "second"
    for path, known in tags.items():
        assert "second" in again(client, path, known).raise_for_status().text, path
    bench = client.get("/v1/benches/heavy").headers["ETag"]
    text = (folder / "heavy.toml").read_text()
    (folder / "heavy.toml").write_text(text.replace("Heavy-vehicle", "Heavier"))
    assert again(client, "/v1/benches/heavy", bench).status_code == 200


def test_errors_have_no_tag(client: httpx.Client) -> None:
    for path in ("/v1/tables/none", "/v1/fits/none/report"):
        answer = again(client, path, "*")
        assert answer.status_code == 404
        assert "ETag" not in answer.headers


@pytest.mark.parametrize("path", ["report", "pictures/residuals?format=svg", "pictures"])
def test_results_are_drawn_once_whoever_asks(with_fit: httpx.Client, path: str,
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    call = Kept.call

    def counted(child: Kept, function: str, *rest: Any) -> bytes:
        drawn.extend([function] * (function != "slipstick.report.made:prepare"))  # by the service, at its start
        return call(child, function, *rest)

    monkeypatch.setattr(Kept, "call", counted)
    first = with_fit.get(f"/v1/fits/fit/{path}")
    assert first.is_success, first.text
    assert len(drawn) == 1
    assert again(with_fit, f"/v1/fits/fit/{path}", '"other"').content == first.content
    if path != "pictures":
        assert again(with_fit, f"/v1/fits/fit/{path}", first.headers["ETag"]).status_code == 304
    assert len(drawn) == 1
    problem(with_fit.get("/v1/fits/fit/pictures/others"), 404)


def test_the_drawings_kept_have_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[bytes] = []
    monkeypatch.setattr(Kept, "call", lambda _, __, content, ___: drawn.append(content) or bytes(400))
    drawings = Drawings(1000)

    def ask(*keys: str) -> int:
        drawn.clear()
        for key in keys:
            assert len(drawings.made("page", lambda: {"kind": "fit"}, key)) == 400
        return len(drawn)

    assert ask("a", "b", "a", "b") == 2
    assert ask("a", "c", "a") == 1  # the one that was asked for least recently is gone
    assert ask("b") == 1
    assert drawings.made("page", dict) == drawings.made("page", dict)
    assert len(drawn) == 3


def test_each_format_has_its_own_tag(with_fit: httpx.Client) -> None:
    address = "/v1/fits/fit/pictures/residuals"
    svg = with_fit.get(address, headers={"Accept": "image/svg+xml"})
    assert "Accept" in svg.headers["Vary"]
    assert again(with_fit, address, svg.headers["ETag"], Accept="image/svg+xml").status_code == 304
    assert again(with_fit, address, svg.headers["ETag"], Accept="application/json").status_code == 200


def test_text_is_compressed_if_the_client_can_read_it(client: httpx.Client) -> None:
    def raw(path: str, encoding: str, **headers: str) -> tuple[httpx.Response, bytes]:
        with client.stream("GET", path, headers={"Accept-Encoding": encoding, **headers}) as answer:
            return answer, b"".join(answer.iter_raw())

    plain, whole = raw("/v1/tables/nominal", "identity")
    packed, part = raw("/v1/tables/nominal", "gzip")
    assert "Content-Encoding" not in plain.headers
    assert packed.headers["Content-Encoding"] == "gzip"
    assert "Accept-Encoding" in packed.headers["Vary"]
    assert gzip.decompress(part) == whole
    assert len(part) < len(whole) / 5
    assert plain.headers["ETag"] == packed.headers["ETag"]
    assert raw("/v1/tables/nominal", "gzip", **{"If-None-Match": packed.headers["ETag"]})[1] == b""
    assert "Content-Encoding" not in raw("/v1/live", "gzip")[0].headers  # too short


def test_arrays_and_events_are_not_compressed(client: httpx.Client) -> None:
    points = {"points": [[1.0, 1.0]] * 10}
    headers = {"Accept": "application/x-npy", "Accept-Encoding": "gzip"}
    answer = client.post("/v1/evaluate", json=points, headers=headers)
    assert len(answer.content) > 10_000
    assert "Content-Encoding" not in answer.headers
    job = client.post("/v1/fits", json={}).json()["links"]["self"]
    with client.stream("GET", f"{job}/events") as stream:
        assert "Content-Encoding" not in stream.headers
        assert next(stream.iter_lines())

