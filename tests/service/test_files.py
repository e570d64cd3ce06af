"""Files of the service: one that is broken concerns itself alone, limits hold, and what a job uses is not deleted."""

import os
import shutil
import sqlite3
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest
from test_problems import problem

from service.settings import Settings
from slipstick.errors import BadBench, BadRecording, BadTable, LimitExceeded, UnknownName
from slipstick.storage.library import Library
from slipstick.storage.versions import _open_verified, holds_table, open_bench, open_recordings
from tests.benches import TABLES

CSV = {"Content-Type": "text/csv"}
HEADER = "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
ROW = "0,104.7197551,6,20,0.9\n"


@pytest.fixture
def folder(shelf: Path, tmp_path: Path) -> Path:
    shutil.copytree(shelf, tmp_path / "tables")
    return tmp_path / "tables"


@pytest.fixture
def client(folder: Path, serving) -> Iterator[httpx.Client]:
    settings = Settings(tables=folder, jobs=f"sqlite:///{folder.parent}/jobs.sqlite", engagements=300,
                        folder_bytes=sum(path.stat().st_size for path in folder.iterdir()) + 100_000)
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


def test_a_broken_file_concerns_itself_alone(client: httpx.Client, folder: Path) -> None:
    for form in ("h5", "toml"):
        (folder / f"dangling.{form}").symlink_to("nowhere")
        (folder / f"folder.{form}").mkdir()
        os.mkfifo(folder / f"pipe.{form}")
    for kind, good in (("tables", "nominal"), ("benches", "heavy")):
        entries = {entry["name"]: entry["problem"] for entry in client.get(f"/v1/{kind}").json()[kind]}
        assert entries.pop(good) is None
        assert sorted(entries) == ["dangling", "folder", "pipe"]
        assert all("is not a file" in reason for reason in entries.values())
        assert client.get(f"/v1/{kind}/{good}").is_success
        assert "is not a file" in client.get(f"/v1/{kind}/dangling").json()["detail"]
    assert client.get("/v1/health").is_success
    assert client.post("/v1/evaluate", json={"points": [[1.0, 1.0]]}).is_success
    for kind in ("tables", "benches"):
        for answer in (client.delete(f"/v1/{kind}/folder"), client.patch(f"/v1/{kind}/folder", json={"name": "new"})):
            assert "'folder' cannot be deleted or renamed" in problem(answer, 422)["detail"]
    assert client.delete("/v1/tables/dangling").status_code == 204
    assert not os.path.lexists(folder / "dangling.h5")


def test_each_of_many_files_is_opened_once_for_lists_and_forms(client: httpx.Client, folder: Path,
                                                               few_recordings: Path) -> None:
    for number in range(17):  # more than the contents that are kept
        for name, copied in (("nominal.h5", folder / "nominal.h5"), ("measured.h5", few_recordings / "few.h5"),
                             ("heavy.toml", folder / "heavy.toml")):
            stem, _, form = name.partition(".")
            shutil.copy(copied, folder / f"{stem}-{number}.{form}")
    pages = ("/", "/upload", "/find", "/tables/nominal", "/recordings/measured", "/benches/heavy", "/v1/tables",
             "/v1/recordings", "/v1/benches")

    def count_opened() -> int:
        for page in pages:
            client.get(page).raise_for_status()
        return sum(each.cache_info().misses for each in (_open_verified, open_recordings, open_bench))

    count_opened()
    opened = count_opened()
    assert count_opened() <= opened + 6  # the files of the pages, whose contents may be forgotten
    client.patch("/v1/recordings/measured-3", json={"name": "renamed"}).raise_for_status()
    client.delete("/v1/benches/heavy-3").raise_for_status()
    (folder / "heavy-4.toml").write_text((folder / "heavy-4.toml").read_text().replace('title = "', 'title = "Other '))
    front = client.get("/").text
    assert "/recordings/renamed" in front
    assert "/recordings/measured-3\"" not in front
    assert "/benches/heavy-3\"" not in front
    titles = {each["name"]: each["title"] for each in client.get("/v1/benches").json()["benches"]}
    assert titles["heavy-4"] == f"Other {titles['heavy-5']}"


def test_a_file_that_vanishes_is_an_error_of_that_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = Library(folder)
    names = [(library.table, "nominal", BadTable), (library.recording, "measured", BadRecording),
             (library.bench, "heavy", BadBench)]
    for opened, name, _ in names:
        opened(name)
    for known in ("has_table", "has_recordings", "has_bench"):
        monkeypatch.setattr(Library, known, lambda *_: True)
    for path in folder.iterdir():
        path.unlink()
    monkeypatch.setattr(Path, "is_file", lambda _: True)  # it vanishes after this check
    for opened, name, error in names:
        with pytest.raises(error, match="is not a file"):
            opened(name)
    assert holds_table(folder / "nominal.h5")


def test_recordings_have_a_limited_number_of_rows(client: httpx.Client, folder: Path,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    def upload(name: str, rows: int) -> httpx.Response:
        return client.post(f"/v1/recordings?name={name}&bench=heavy", content="# remark\n" + HEADER + ROW * rows,
                           headers=CSV)

    assert "301 engagements; the limit is 300" in problem(upload("long", 301), 413)["detail"]
    assert upload("fits", 300).status_code == 201
    monkeypatch.setattr(Library, "read_recordings", lambda *_: 1 / 0)  # read before its lines are counted
    assert "1,302 lines; the limit is 300" in problem(upload("longer", 1300), 413)["detail"]
    assert upload("counted", 1000).status_code == 500
    monkeypatch.undo()
    with pytest.raises(LimitExceeded, match="216 engagements; the limit is 215"):
        Library(folder, most_engagements=215).add_recordings("h", (folder / "measured.h5").read_bytes(), "h5")
    assert not (folder / "h.h5").exists()


def test_the_folder_has_a_quota(client: httpx.Client, folder: Path) -> None:
    bench = (TABLES / "compact.toml").read_text()
    full = client.post("/v1/benches?name=large", content=bench + "#" * 100_000,
                       headers={"Content-Type": "application/toml"})
    assert "SLIPSTICK_FOLDER_BYTES" in problem(full, 413)["remedy"]
    assert not (folder / "large.toml").exists()
    assert client.post("/v1/benches?name=small", content=bench,
                       headers={"Content-Type": "application/toml"}).status_code == 201


def test_what_a_result_is_of_is_deleted_only_by_force(client: httpx.Client, folder: Path) -> None:
    job = client.post("/v1/fits", json={}).json()["links"]["self"]
    with sqlite3.connect(folder.parent / "jobs.sqlite") as jobs:
        jobs.execute("UPDATE workflow_status SET status = 'SUCCESS'")
    for path in ("/v1/tables/nominal", "/v1/recordings/measured"):
        refused = problem(client.delete(path), 409)
        assert f"results of 1 finished job with '{path.rpartition('/')[2]}', such as {job}" in refused["detail"]
        assert f"(DELETE {job}), or repeat the request with ?force=true" in refused["remedy"]
        assert client.get(path).is_success
    assert client.delete("/v1/tables/nominal?force=true").status_code == 204
    assert client.get(job).json()["status"] == "done"
    assert client.delete(job).status_code == 204
    assert client.delete("/v1/recordings/measured").status_code == 204


def test_a_bench_with_a_study_is_deleted_only_by_force(client: httpx.Client, folder: Path) -> None:
    job = client.post("/v1/studies", json={"bench": "heavy"}).json()["links"]["self"]
    assert job in problem(client.delete("/v1/benches/heavy?force=true"), 409)["detail"]
    with sqlite3.connect(folder.parent / "jobs.sqlite") as jobs:
        jobs.execute("UPDATE workflow_status SET status = 'SUCCESS'")
    assert "?force=true" in problem(client.delete("/v1/benches/heavy"), 409)["remedy"]
    assert client.delete("/v1/benches/heavy?force=true").status_code == 204
    assert not (folder / "heavy.toml").exists()


def test_what_a_job_uses_is_not_deleted(client: httpx.Client, folder: Path) -> None:
    job = client.post("/v1/fits", json={}).json()["links"]
    for path in ("/v1/tables/nominal", "/v1/recordings/measured"):
        for force in ("false", "true"):
            assert job["self"] in problem(client.delete(f"{path}?force={force}"), 409)["detail"]
        assert client.get(path).is_success
    client.post(job["cancel"])
    for path in ("/v1/tables/nominal", "/v1/recordings/measured"):
        deleted = client.delete(path)
        assert (deleted.status_code, deleted.content) == (204, b"")
        problem(client.delete(path), 404)
    assert sorted(path.name for path in folder.iterdir()) == ["heavy.toml"]
    assert client.delete("/v1/benches/heavy").status_code == 204
    problem(client.delete("/v1/benches/heavy"), 404)
    problem(client.delete("/v1/tables/..%2fjobs"), 404)


@pytest.mark.parametrize(("path", "file"), [("/v1/tables/nominal", "nominal.h5"), ("/v1/benches/heavy", "heavy.toml"),
                                            ("/v1/recordings/measured", "measured.h5")])
def test_a_file_is_renamed(client: httpx.Client, folder: Path, path: str, file: str) -> None:
    before, tag = client.get(path).json(), client.get(path).headers["ETag"]
    renamed = client.patch(path, json={"name": "other-name"})
    assert renamed.status_code == 200, renamed.text
    new = f"{path.rpartition('/')[0]}/other-name"
    assert (renamed.headers["Location"], renamed.json()["href"], renamed.json()["name"]) == (new, new, "other-name")
    after = client.get(new, headers={"If-None-Match": tag})
    assert after.json() == {**before, "name": "other-name"}
    problem(client.get(path), 404)
    problem(client.patch(path, json={"name": "third"}), 404)
    assert not (folder / file).exists()
    assert client.patch(new, json={"name": path.rpartition("/")[2]}).is_success
    assert client.get(path, headers={"If-None-Match": tag}).status_code == 304


def test_a_renaming_never_replaces_a_file(client: httpx.Client, folder: Path) -> None:
    recordings = (folder / "measured.h5").read_bytes()
    for path, name in (("/v1/tables/nominal", "measured"), ("/v1/recordings/measured", "nominal"),
                       ("/v1/benches/heavy", "heavy")):
        refused = problem(client.patch(path, json={"name": name}), 409)
        assert (refused["detail"], refused["remedy"]) == (f"A file named '{name}' already exists",
                                                          "Choose another name")
    assert (folder / "measured.h5").read_bytes() == recordings
    for name in ("../outside", "", "a b", ".hidden", "x" * 65):
        problem(client.patch("/v1/tables/nominal", json={"name": name}), 422)
    for body in ({}, {"name": 1}, {"name": "a", "digest": "b"}, []):
        problem(client.patch("/v1/tables/nominal", json=body), 422)
    problem(client.patch("/v1/recordings/nominal", json={"name": "a"}), 404)  # it is a table
    assert client.get("/v1/tables/nominal").is_success


def test_an_invalid_file_is_renamed(client: httpx.Client, folder: Path) -> None:
    (folder / "broken.h5").write_bytes(b"no table")
    renamed = client.patch("/v1/tables/broken", json={"name": "other"}).json()
    assert renamed["name"] == "other"
    assert renamed["problem"]
    (folder / "dangling.h5").symlink_to(folder / "nowhere.h5")
    assert client.patch("/v1/tables/dangling", json={"name": "still"}).json()["problem"]
    assert (folder / "still.h5").is_symlink()


def test_of_changes_at_the_same_time_a_single_one_happens(folder: Path) -> None:
    library, start = Library(folder), threading.Barrier(3)

    def change(act: Callable[[], None]) -> bool:
        start.wait()
        try:
            act()
        except UnknownName:
            return False
        return True

    acts = [lambda: library.rename("recordings file", "many", "first"),
            lambda: library.rename("recordings file", "many", "second"),
            lambda: library.remove("recordings file", "many")]
    with ThreadPoolExecutor(3) as threads:
        for _ in range(100):
            shutil.copy(folder / "measured.h5", folder / "many.h5")
            happened = list(threads.map(change, acts))
            left = [name for name in ("first", "second", "many") if (folder / f"{name}.h5").exists()]
            assert sum(happened) == 1
            assert left == [name for name, done in zip(("first", "second"), happened[:2], strict=True) if done]
            for name in left:
                library.remove("recordings file", name)


def test_what_a_job_uses_is_not_renamed_and_results_keep_the_former_name(client: httpx.Client, folder: Path) -> None:
    job = client.post("/v1/fits", json={"bench": "heavy"}).json()["links"]
    paths = ("/v1/tables/nominal", "/v1/recordings/measured", "/v1/benches/heavy")
    for path in paths:
        refused = problem(client.patch(path, json={"name": "other"}), 409)
        assert job["self"] in refused["detail"]
        assert "Cancel these jobs first" in refused["remedy"]
        assert client.get(path).is_success
    with sqlite3.connect(folder.parent / "jobs.sqlite") as jobs:
        jobs.execute("UPDATE workflow_status SET status = 'SUCCESS'")
    for number, path in enumerate(paths):
        assert client.patch(path, json={"name": f"other{number}"}).is_success
    fit = client.get(job["self"]).json()
    assert (fit["status"], fit["table"], fit["recordings"], fit["bench"]) == ("done", "nominal", "measured", "heavy")
