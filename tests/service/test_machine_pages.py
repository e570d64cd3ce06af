"""Machines that workers have told of: over REST, on their pages, in forms, and in a browser."""

import html
import re
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote, quote_plus

import httpx
import pytest
from selenium import webdriver
from sqlalchemy import text
from test_acting_pages import Forms, Person, keys, operation_of
from test_problems import problem

from service.settings import Settings
from slipstick.black_box import BlackBox
from slipstick.black_box.known import KnownMachine, list_known
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import Effect, Parameter, list_experiments, open_machine, write_runs
from slipstick.pictures import units
from slipstick.storage.database import open_database
from tests.service.conftest import Serving
from worker import heartbeat, known_machines

DOCS = Path(__file__).parents[2] / "docs"
OPENED = open_machine("dc_motor")
MOTOR, = list_known([OPENED], BlackBox.open_all("dc_motor"))
OTHER, = list_known([], [BlackBox.open(DOCS / "motor.toml")])
"""A machine of another simulator, whose title has a slash."""
STRANGE = 'a "b" <b>&/?#%41'
Tell = Callable[..., None]


@pytest.fixture
def address(tmp_path: Path, serving: Serving) -> Iterator[str]:
    (tmp_path / "tables").mkdir()
    with serving(Settings(tables=tmp_path / "tables", jobs=f"sqlite:///{tmp_path}/jobs.sqlite")) as address:
        yield address


@pytest.fixture
def client(address: str) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=address, timeout=60) as client:
        yield client


@pytest.fixture
def tell(tmp_path: Path, client: httpx.Client) -> Iterator[Tell]:
    """A function by which a worker `name` says that it has some machines, and that it is `alive`."""
    engine = open_database(f"sqlite:///{tmp_path}/jobs.sqlite")

    def tell(*machines: KnownMachine, name: str = "a", alive: bool = True) -> None:
        with engine.begin() as connection:
            connection.execute(text(heartbeat._CREATE))
        heartbeat.beat(engine, name)
        known_machines.tell(engine, name, sorted(machines, key=lambda each: each.name))
        if not alive:
            return heartbeat.stop(engine, name)
        with engine.begin() as connection:  # the first picture may take longer than a heartbeat is valid
            connection.execute(text("UPDATE slipstick_workers SET seen = seen + 1000"))

    yield tell
    engine.dispose()


def words(page: str) -> str:
    return html.unescape(" ".join(re.sub("<[^>]+>", " ", page.partition("<main")[2]).split()))


def test_there_are_none_until_a_worker_tells_of_them(client: httpx.Client, tell: Tell) -> None:
    assert client.get("/v1/machines").json() == {"machines": [], "total": 0, "links": {}}
    assert "There is no machine 'dc motor'" in problem(client.get("/v1/machines/dc motor"), 404)["detail"]
    entry = '<li><a href="/#machines">Machines</a></li>'
    assert 'id="machines"' not in client.get("/").text
    assert entry not in client.get("/").text
    tell(MOTOR)
    assert entry in client.get("/").text
    assert entry in client.get("/machines/dc motor").text
    assert "/#builds" not in client.get("/").text
    assert client.get("/v1/machines").json()["total"] == 1
    assert "Did you mean 'dc motor'?" in problem(client.get("/v1/machines/dc moto"), 404)["remedy"]
    for wrong in ("%00", "dc%20motor%00", "", "x" * 5000):
        problem(client.get(f"/v1/machines/{wrong}", follow_redirects=True), 404)


def test_they_are_listed_and_described(client: httpx.Client, tell: Tell) -> None:
    tell(MOTOR, OTHER)
    entries = client.get("/v1/machines").json()["machines"]
    assert [(each["name"], each["workers"], each["blocks"], each["outputs"], each["experiments"], each["problem"])
            for each in entries] == [
        (OTHER.name, 1, [], ["run_up_time"], 6, None),
        ("dc motor", 1, ["winding", "shaft"], ["run_up_time", "largest_current"], 9, None)]
    page = client.get("/v1/machines", params={"limit": 1}).json()
    assert (page["total"], client.get(page["links"]["next"]).json()["machines"]) == (2, entries[1:])
    assert client.get("/v1/machines", params={"format": "csv"}).text.splitlines()[2].startswith("dc motor,1,winding sh")
    other, motor = (client.get(each["href"]).json() for each in entries)
    assert (other["declaration"], other["outputs"][0]["inputs"][0]) == (None, {
        "name": "resistance", "unit": "ohm", "nominal": 1.2, "lower": 0.6, "upper": 1.4, "points": 17})
    declared = motor["declaration"]
    assert (declared["experiments"], declared["duration"], declared["step"]) == (9, 1.0, 2e-3)
    winding = declared["blocks"][0]
    assert (winding["reads"], winding["gives"], winding["states"]) == (["voltage", "speed"], ["current"], ["current"])
    assert [each["within"] for each in winding["parameters"]] == [None, 0.03, None]  # infinity is not in JSON
    assert declared["commands"][0]["profiles"][0][2] == [0.021, 12.0]
    assert declared["outputs"][0]["above"] == 100.0
    assert [each["name"] for each in motor["outputs"][0]["inputs"]][:2] == ["resistance_value", "inductance"]


def test_a_description_is_sent_once_until_a_worker_ends(client: httpx.Client, tell: Tell) -> None:
    tell(MOTOR)
    for path in ("/v1/machines/dc motor", "/machines/dc motor"):
        tell(MOTOR)
        tag = client.get(path).headers["ETag"]
        assert client.get(path, headers={"If-None-Match": tag}).status_code == 304
        tell(MOTOR, alive=False)
        assert client.get(path, headers={"If-None-Match": tag}).status_code == 200


def test_what_cannot_be_read_is_listed_with_the_reason(client: httpx.Client, tell: Tell, tmp_path: Path) -> None:
    tell(MOTOR, OTHER)
    engine = open_database(f"sqlite:///{tmp_path}/jobs.sqlite")
    with engine.begin() as connection:
        connection.execute(text("UPDATE slipstick_machines SET content = '{\"name\": 1}' WHERE name = 'dc motor'"))
    engine.dispose()
    other, motor = client.get("/v1/machines").json()["machines"]
    assert (other["problem"], "cannot be read" in motor["problem"]) == (None, True)
    for path in ("/v1/machines/dc motor", "/machines/dc motor"):
        assert "cannot be read" in problem(client.get(path), 422)["detail"]
    assert "cannot be read" in words(client.get("/").text)


def test_the_page_shows_what_is_declared(client: httpx.Client, tell: Tell) -> None:
    tell(MOTOR, OTHER)
    page = client.get("/machines/dc motor").text
    shown = words(page)
    for said in ("2 blocks (winding and shaft), 6 parameters, 9 experiments", "1 running worker has its file",
                 "reads current, load torque", "gives speed", "states speed (may rest), position",
                 "laws also over angle",
                 "9 experiments of 1 s with a sample every 2 ms", "load torque 0.01, 0.02, 0.03 N m 2 % 5 %",
                 "inductance 0.003 H 3 % 5 %", "motor constant 0.05 N m/A estimated 5 %",
                 "time at which speed first rises above 100 rad/s", "run up time [s] and largest current [A]"):
        assert said in shown, said
    assert page.count("<svg role=") == 1  # the profiles of its command
    other = words(client.get(f"/machines/{quote(OTHER.name)}").text)
    for said in ("2 inputs, 6 conditions", "Python callable motor:run_up_time", "resistance 1.2 ohm 0.6 to 1.4"):
        assert said in other, said
    assert "Blocks" not in other
    front = client.get("/").text
    assert f'href="/machines/{quote(OTHER.name)}"' in front
    assert "no worker" not in front


def test_parameters_are_told_as_they_are_declared(client: httpx.Client, tell: Tell) -> None:
    block = replace(MOTOR.declared.blocks[0], parameters=(
        Parameter("offset", "V", value=0.0, scale=0.2, within=1.0, scatter=0.0), Parameter("open", "A", scatter=0.1),
        Parameter("start", "A", value=1.0, first_of="current", scale=2.0, within=0.5)))
    effect = Effect("brush drop", "brush voltage", "current", "Coulomb friction")
    declared = replace(MOTOR.declared, blocks=(block,), effects=(effect,), signals=("power",), inputs=("flow",))
    tell(KnownMachine("dc motor", declared, ()))
    page = client.get("/machines/dc motor").text
    for said in ("offset 0 V 0.2 V none", "open not stated estimated 10 %", "start first current 1 A 0.1 A",
                 "brush drop brush voltage current Coulomb friction", "may depend on: power", "equations read: flow"):
        assert said in words(page), said
    assert 'id="build"' not in page  # it is not simulated


def test_texts_of_a_declaration_stay_texts(client: httpx.Client, tell: Tell) -> None:
    mark = "<script>alert(1)</script>"
    block = replace(MOTOR.declared.blocks[0], name=mark, reads=(mark,), states=(mark,), switches=(mark,),
                    parameters=(Parameter(mark, mark, value=1.0),))
    sensor = replace(MOTOR.declared.sensors[0], unit=mark)
    command = replace(MOTOR.declared.commands[0], name=mark, unit=mark)
    declared = replace(MOTOR.declared, blocks=(block,), sensors=(sensor,), commands=(command,), name=STRANGE)
    tell(replace(MOTOR, name=STRANGE, declared=declared))
    entry, = client.get("/v1/machines").json()["machines"]
    assert entry["name"] == client.get(entry["href"]).json()["name"] == STRANGE
    for path in (entry["href"].removeprefix("/v1"), "/", "/find?among=machines"):
        page = client.get(path).text
        assert html.escape(STRANGE) in page
        assert mark not in page
        assert "<b>" not in page
        assert Forms(page).inline == []


def test_lists_of_a_declaration_may_be_empty(client: httpx.Client, tell: Tell) -> None:
    quantity = replace(MOTOR.declared.blocks[0].quantities[0], over=())
    block = replace(MOTOR.declared.blocks[0], quantities=(quantity,))
    tell(replace(MOTOR, declared=replace(MOTOR.declared, blocks=(block,), commands=(), conditions=())))
    page = words(client.get("/machines/dc motor").raise_for_status().text)
    assert "all combinations of nothing" in page
    assert f"{quantity.name} {units.raised(quantity.unit)} nothing" in page
    tell(KnownMachine("dc motor", replace(MOTOR.declared, blocks=()), ()))
    for path in ("/", "/machines/dc motor"):
        assert "0 blocks, 0 parameters" in words(client.get(path).raise_for_status().text)


def test_odd_numbers_of_a_declaration_are_left_out(client: httpx.Client, tell: Tell) -> None:
    inf, nan = float("inf"), float("nan")
    sweep = MOTOR.declared.commands[0].profiles[0]
    many = tuple(tuple((time, value + shift) for time, value in sweep) for shift in range(40))
    command = replace(MOTOR.declared.commands[0], profiles=((), ((0.0, nan),), ((inf, 1.0),), *many))
    condition = replace(MOTOR.declared.conditions[0], levels=(nan, 1e300), within=inf)
    parameter = Parameter("gain", "V", value=nan, within=nan, scatter=inf)
    block = replace(MOTOR.declared.blocks[0], parameters=(parameter,))
    tell(KnownMachine("dc motor", replace(
        MOTOR.declared, blocks=(block,), commands=(command,), conditions=(condition,), duration=inf, step=nan), ()))
    declared = client.get("/v1/machines/dc motor").raise_for_status().json()["declaration"]
    assert (declared["duration"], declared["conditions"][0]["levels"]) == (None, [None, 1e300])
    page = client.get("/machines/dc motor").raise_for_status().text
    assert page.count("<svg role=") == 1
    assert "31 more are not drawn" in words(page)


def test_a_form_builds_a_table_of_any_output_and_inputs(client: httpx.Client, tell: Tell) -> None:
    tell(MOTOR)
    page, document = client.get("/machines/dc motor").text, client.get("/openapi.json").json()
    (attributes, fields), = Forms(page).forms
    operation = operation_of(document, attributes["data-method"], attributes["action"])
    body = set(keys(document, operation["requestBody"]["content"]["application/json"]["schema"]))
    assert {field["name"].partition(".")[0] for field in fields} <= body
    assert {field["name"] for field in fields} >= {"machine", "name", "output", "axes.motor_constant"}
    assert '<option value="largest_current">largest current in A</option>' in page
    assert len(set(Forms(page).ids)) == len(Forms(page).ids)
    assert "multiple of 0.0001 kg m², from 0.5 to 1.5" in words(page)


def test_what_the_machine_does_not_have_is_refused_before_a_worker_is_asked(client: httpx.Client, tell: Tell) -> None:
    def submit(**body: Any) -> httpx.Response:
        return client.post("/v1/builds", json={"name": "x", "machine": MOTOR.name, **body})

    tell(MOTOR)
    assert "run_up_time" in problem(submit(output="run_up"), 404)["remedy"]
    beyond = problem(submit(axes={"resistance_value": [0.1, 2, 9]}), 422)["detail"]
    assert "exceeds the range of the input" in beyond
    assert "does not increase" in problem(submit(axes={"resistance_value": [1.2, 0.8, 5]}), 422)["detail"]
    assert submit(axes={"resistance_value": [0.8, 1.2, 5]}).status_code == 202
    assert submit(name="y", machine="unknown", axes={"any": [0.1, 2, 9]}).status_code == 202


def test_recordings_of_a_machine_begin_on_the_front_page_and_on_its_own(client: httpx.Client, tell: Tell) -> None:
    tell(replace(MOTOR, name=STRANGE), OTHER)
    added = f"/upload?machine={quote_plus(STRANGE)}"
    for path in ("/", f"/machines/{quote(STRANGE)}"):
        assert html.escape(f"{added}#read-files") in client.get(path).text, path
    assert "Add recordings of it" not in client.get(f"/machines/{quote(OTHER.name)}").text
    chosen, = re.findall(r'<option value="([^"]*)" selected>', client.get(added).text.partition('id="read-files"')[2])
    assert chosen == f"machine={quote_plus(STRANGE)}"


def test_a_machine_without_a_worker_is_shown_and_its_jobs_say_so(client: httpx.Client, tell: Tell) -> None:
    runs = simulate_runs(OPENED, list_experiments(OPENED), seed=1)
    client.post("/v1/recordings", params={"name": "runs"}, content=write_runs(runs, OPENED),
                headers={"Content-Type": "application/x-hdf5"}).raise_for_status()
    missing = "No running worker has the machine “dc motor”"
    lacking = "It needs a worker with the file of the machine “dc motor”, and none is running"

    def submit(kind: str, **body: Any) -> dict[str, Any]:
        job: dict[str, Any] = client.post(f"/v1/{kind}", json=body).raise_for_status().json()
        return job

    study = submit("studies", recordings="runs")  # nobody has ever told of it
    assert missing in study["note"]
    assert study["missing_machine"] == "dc motor"
    page = client.get("/recordings/runs").text
    assert lacking in words(page)
    assert 'href="/machines/dc%20motor"' not in page
    tell(MOTOR)
    state = client.get(study["links"]["self"]).json()
    assert missing not in state["note"]
    assert state["missing_machine"] is None
    page = client.get("/recordings/runs").text
    assert lacking not in words(page)
    assert 'href="/machines/dc%20motor"' in page
    assert 'href="/recordings/runs"' in client.get("/machines/dc motor").text
    tell(MOTOR, alive=False)
    for job in (study, submit("calibrations", recordings="runs"), submit("builds", machine="dc motor", name="new")):
        assert missing in client.get(job["links"]["self"]).json()["note"]
        shown = client.get(job["links"]["self"].removeprefix("/v1")).text
        assert missing in words(shown)
        assert "No worker is alive. The job" not in words(shown)
        assert 'href="/machines/dc%20motor"' in shown
    assert missing in words(client.get("/").text)
    shown = words(client.get("/machines/dc motor").text)
    assert "No running worker has its file" in shown
    assert "reads voltage, speed" in shown
    assert lacking in words(client.get("/recordings/runs").text)
    assert 'class="mark no worker"' in client.get("/").text


def test_machines_are_searched(client: httpx.Client, tell: Tell) -> None:
    tell(MOTOR, OTHER)
    shown = client.get("/find", params={"text": "DC MOT"}).text
    assert 'href="/machines/dc%20motor"' in shown
    assert f'href="/machines/{quote(OTHER.name)}"' in shown
    assert "/machines/dc" not in client.get("/find", params={"text": "DC MOT", "among": "tables"}).text
    only = client.get("/find", params={"text": "dc motor", "among": "machines"}).text
    assert 'href="/machines/dc%20motor"' in only
    assert 'id="jobs"' not in only


@pytest.fixture
def screen(browser: webdriver.Chrome) -> Iterator[webdriver.Chrome]:
    browser.get_log("browser")
    yield browser
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.get("about:blank")


@pytest.mark.slow
def test_a_table_is_built_from_the_page_of_a_machine_whose_worker_is_then_killed(
        client: httpx.Client, address: str, tmp_path: Path, launch: Callable[..., Any],
        screen: webdriver.Chrome) -> None:
    shutil.copy(Path(__file__).parents[2] / "tables" / "machines" / "dc_motor.py", tmp_path / "mine.py")
    worker = launch("worker", "work", "--tables", str(tmp_path / "tables"), "--jobs",
                    f"sqlite:///{tmp_path}/jobs.sqlite", "--machine", str(tmp_path / "mine.py"))
    deadline = time.monotonic() + 60
    while not client.get("/v1/machines").json()["total"]:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    person = Person(screen, address)
    person.open("/#machines")
    screen.find_element("link text", "dc motor").click()
    person.arrive("/machines/dc%20motor")
    form = person.form("build")
    person.fill(form, name="currents", output="largest_current", **{"axes.resistance_value": "0,8 1,2"})
    person.send(form)
    assert person.wrong(form).startswith("Give the lowest and highest multiple and the number of points")
    person.fill(form, **{"axes.resistance_value": "0.5 x 3"})
    person.send(form)
    assert "valid number" in person.wrong(form)
    wrong = form.find_element("css selector", "[aria-invalid=true]")
    assert wrong.get_attribute("name") == "axes.resistance_value"
    person.fill(form, **{"axes.resistance_value": "0,8 1,2 3"})
    person.send(form)
    person.until("3 × 9 runs, 0 of them without an output")
    assert client.get("/v1/tables/currents").json()["output"] == "largest_current"
    person.open("/tables/currents")
    screen.find_element("link text", "The machine “dc motor”").click()
    person.arrive("/machines/dc%20motor")
    person.until("Grid of 3 points over resistance value")
    worker.kill()
    worker.wait()
    while client.get("/v1/machines/dc motor").json()["workers"]:
        assert time.monotonic() < deadline + 60
        time.sleep(0.1)
    screen.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True})
    person.open("/machines/dc%20motor")
    person.until("No running worker has its file")
    screen.execute_script("document.querySelectorAll('details').forEach(details => details.open = true)")
    assert screen.execute_script("return document.documentElement.scrollWidth") <= 390
    assert [entry for entry in screen.get_log("browser") if "422" not in entry["message"]] == []
