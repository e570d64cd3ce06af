"""What workers tell of their machines: kept in the job database, and no more than that they have them or not."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import text

from service.machines import Machines
from slipstick.black_box import BlackBox
from slipstick.black_box.known import KnownMachine, list_known
from slipstick.errors import InvalidValue, UnknownName
from slipstick.machine import open_machine
from slipstick.storage.database import open_database
from worker import heartbeat, known_machines

MOTOR = list_known([open_machine("dc_motor")], BlackBox.open_all("dc_motor"))
TANKS = list_known([open_machine("two_tanks")], BlackBox.open_all("two_tanks"))


@pytest.mark.parametrize("kind", ["sqlite", "postgresql"])
def test_machines_stay_without_their_workers(kind: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    url = (f"sqlite:///{tmp_path}/jobs.sqlite" if kind == "sqlite"
           else request.getfixturevalue("postgresql").url("machines"))
    engine = open_database(url)
    machines = Machines(engine)
    assert machines.read_all() == []
    with pytest.raises(UnknownName, match="no machine 'dc motor'"):
        machines.find("dc motor")
    with engine.begin() as connection:
        connection.execute(text(heartbeat._CREATE))

    def start(worker: str, *known: KnownMachine) -> None:
        heartbeat.beat(engine, worker)
        known_machines.tell(engine, worker, known)

    def running() -> dict[str, int]:
        return {each.name: each.workers for each in machines.read_all()}

    start("a", *MOTOR)
    assert running() == {"dc motor": 1}
    assert [machines.find("dc motor").known] == MOTOR
    start("b", *MOTOR, *TANKS)
    assert running() == {"dc motor": 2, "two tanks": 1}
    heartbeat.stop(engine, "b")
    assert running() == {"dc motor": 1, "two tanks": 0}
    start("b")
    assert running() == {"dc motor": 1, "two tanks": 0}
    start("a", *TANKS)
    assert running() == {"dc motor": 0, "two tanks": 1}
    with engine.begin() as connection:  # as a killed worker is forgotten by the one that takes over its jobs
        connection.execute(text("DELETE FROM slipstick_workers WHERE name = 'a'"))
    assert running() == {"dc motor": 0, "two tanks": 0}
    start("b")
    with engine.connect() as connection:
        assert connection.execute(text("SELECT count(*) FROM slipstick_machine_workers")).scalar_one() == 0
    engine.dispose()


def test_what_cannot_be_told_is_left_out(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    engine = open_database(f"sqlite:///{tmp_path}/jobs.sqlite")
    with engine.begin() as connection:
        connection.execute(text(heartbeat._CREATE))
    heartbeat.beat(engine, "a")
    wrong = ["two\nlines", "x" * 300, "", "..", "drives/../motor"]
    known_machines.tell(engine, "a", [*(KnownMachine(name, None, ()) for name in wrong), *MOTOR,
                                      KnownMachine("a/b..c", None, ())])
    assert [each.name for each in Machines(engine).read_all()] == ["a/b..c", "dc motor"]
    said = capfd.readouterr().err
    for name in wrong:
        assert f"The service is not told of the machine '{name[:60]}'" in said
    engine.dispose()


def test_other_content_is_an_error_of_this_machine_alone(tmp_path: Path) -> None:
    engine = open_database(f"sqlite:///{tmp_path}/jobs.sqlite")
    with engine.begin() as connection:
        connection.execute(text(heartbeat._CREATE))
    heartbeat.beat(engine, "a")
    known_machines.tell(engine, "a", [*MOTOR, *TANKS])
    with engine.begin() as connection:
        connection.execute(text("UPDATE slipstick_machines SET content = '{}' WHERE name = 'dc motor'"))
    motor, tanks = Machines(engine).read_all()
    with pytest.raises(InvalidValue, match="cannot be read"):
        _ = motor.known
    assert [tanks.known] == TANKS
    engine.dispose()


def test_a_worker_tells_and_a_killed_one_is_not_counted(tmp_path: Path, launch: Callable[..., object]) -> None:
    (tmp_path / "tables").mkdir()
    url = f"sqlite:///{tmp_path}/jobs.sqlite"
    worker = launch("worker", "work", "--no-compile", "--tables", str(tmp_path / "tables"), "--jobs", url, "--machine",
                    "dc_motor")
    machines, deadline = Machines(open_database(url)), time.monotonic() + 60
    while not machines.read_all():
        assert worker.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.1)
    told, = machines.read_all()
    assert (told.name, told.workers, [told.known]) == ("dc motor", 1, MOTOR)
    worker.kill()
    worker.wait()
    while machines.find("dc motor").workers:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert [machines.find("dc motor").known] == MOTOR
    machines.engine.dispose()
