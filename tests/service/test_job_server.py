"""The job store on a PostgreSQL server: the same answers as on SQLite, and no password in any message."""

import time
from pathlib import Path

import pytest
from dbos import DBOSClient
from sqlalchemy import text

from service.heartbeats import Heartbeats
from service.job_filter import ACTIVE, ENDED, JobFilter
from service.job_store import APPLICATION, JobStore, connect
from service.job_table import JobTable
from service.jobs import input_of
from service.problem_details import Conflict
from service.retention import remove_old
from slipstick.errors import InvalidValue, UnknownName
from slipstick.storage.database import is_server, open_database, shown
from tests.postgresql import PASSWORD, Server
from worker import heartbeat
from worker.worker_name import locked_name


@pytest.mark.parametrize("kind", ["sqlite", "postgresql"])
def test_submit_find_cancel_delete_and_retention(kind: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    url = (f"sqlite:///{tmp_path}/jobs.sqlite" if kind == "sqlite"
           else request.getfixturevalue("postgresql").url("store"))
    client: DBOSClient = connect(url)
    table = JobTable(open_database(url), APPLICATION)
    fits, studies = JobStore(client, table, "fit", "/v1/fits"), JobStore(client, table, "study", "/v1/studies")
    order = {"table": "tab\u00e9", "settings": {"generations": 3}}
    for name in ("one", "two", "three"):
        assert fits.submit(name, order, "short").status == "ENQUEUED"
        time.sleep(0.002)  # a server orders by whole ms
    assert fits.submit("two", order, "short").workflow_id == "two"
    assert input_of(fits.find("two")) == order
    with pytest.raises(Conflict):
        studies.submit("two", {}, "long")
    assert [job.workflow_id for job in fits.newest(2, 0)] == ["three", "two"]
    assert (fits.total(), studies.total()) == (3, 0)
    assert table.states() == [("fit", "ENQUEUED", "short", 3)]
    assert fits.ahead(fits.find("three")) == 2
    assert [job.workflow_id for job in fits.active(2)] == ["one", "two"]
    using = JobFilter(ACTIVE, table="tab\u00e9")
    assert (fits.total(using), [job.workflow_id for job in fits.newest(1, 1, using)]) == (3, ["two"])
    assert fits.total(JobFilter(table="other")) == fits.total(JobFilter(ENDED, table="tab\u00e9")) == 0
    for wanted in (JobFilter(table="a\0"), JobFilter(text="\0")):
        assert (fits.total(wanted), fits.newest(9, 0, wanted)) == (0, [])
    for odd in ({"machine": "a\0"}, {"axes": {"\0": [1.0]}}, {"parameters": ["a", "\0"]}):
        with pytest.raises(InvalidValue, match=r"U\+0000"):
            fits.submit("odd", odd, "short")
    assert fits.total(using) == 3
    assert fits.progress("one") is None
    fits.cancel("one")
    fits.cancel("two")
    assert fits.find("one").status == "CANCELLED"
    assert remove_old(client, 365, 1, time.time()) == ["one"]  # the newest ended job is kept
    assert remove_old(client, 365, 1, time.time() + 366 * 86_400) == ["two"]
    fits.delete("three")
    for name in ("one", "two", "three"):
        with pytest.raises(UnknownName):
            fits.find(name)
    client.destroy()


def test_heartbeats_and_names_on_a_server(postgresql: Server) -> None:
    url = postgresql.url("heartbeats")
    engine = open_database(url)
    beats = Heartbeats(engine)
    assert beats.alive() == 0
    with locked_name("a", engine, None) as is_held:
        with pytest.raises(InvalidValue, match="'a' is already running"), locked_name("a", engine, None):
            pass
        with engine.begin() as connection:
            connection.execute(text(heartbeat._CREATE))
        for name in ("a", "b"):
            heartbeat.beat(engine, name)
        assert beats.alive() == 2
        heartbeat.stop(engine, "b")
        assert beats.alive() == 1
        postgresql.kill()
        postgresql.start()
        heartbeat.beat(engine, "a")  # the restart may take longer than a heartbeat is valid
        assert beats.alive() == 1
        other = open_database(url)
        with pytest.raises(Exception, match=r"terminating connection|closed"):
            is_held()
        with locked_name("a", other, None):
            assert not is_held()
        deadline = time.monotonic() + 10
        while not is_held():  # the server releases the lock once it has noticed that the connection was closed
            assert time.monotonic() < deadline
    for used in (engine, other, beats.engine):
        used.dispose()


def test_errors_name_the_database_and_not_the_password(postgresql: Server) -> None:
    url = postgresql.url("hidden")
    assert is_server(url)
    assert is_server(url.replace("postgresql:", "postgres:"))
    assert shown(f"{url}?password={PASSWORD}") == url.replace(PASSWORD, "***")
    wrong = url.replace(PASSWORD, "secret")
    for bad, message in (
            (wrong, "authentication failed"), (url.replace("/hidden", "/missing"), "does not exist"),
            (url.replace(f":{postgresql.port}", ":1"), "refused"), ("postgresql://u:p@h:secret/d", "not valid"),
            ("mysql://u:secret@h/d", "kind 'mysql'"), ("sqlite://", "has no file"), ("secret", "not valid")):
        with pytest.raises(InvalidValue, match=message) as caught:
            open_database(bad)
        assert "secret" not in str(caught.value)
    open_database(url).dispose()
