"""The pages on which a user acts: what their forms send is what the operations take, and the whole way in a browser."""

import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import httpx
import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.select import Select
from selenium.webdriver.support.wait import WebDriverWait
from sqlalchemy import text as sql
from test_import_route import FILES, ZIP
from test_problems import problem

from service.settings import Settings
from service.tokens import new_token
from slipstick.black_box import BlackBox
from slipstick.black_box.known import KnownMachine, list_known
from slipstick.storage.database import open_database
from tests.benches import TABLES
from tests.slipstick.acquisition.conftest import LOCK, archive, csv, run
from tests.slipstick.acquisition.sled import DRIVEN, SLED, STANDSTILLS, as_csv, recording
from tests.slipstick.acquisition.sled import MAP as OF_SLEDS
from worker import heartbeat, known_machines

PAGES = ("/", "/upload", "/find", "/compare", "/recordings/measured", "/tables/nominal", "/benches/heavy")


@pytest.fixture
def client(own_client: httpx.Client) -> httpx.Client:
    return own_client


@pytest.fixture
def shared(address: str) -> Iterator[httpx.Client]:
    """A client of the service of all tests, whose files stay."""
    with httpx.Client(base_url=address, timeout=30) as client:
        yield client


class Forms(HTMLParser):
    """The forms of a page with the attributes of their fields, and what the page must not have."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.forms: list[tuple[dict[str, str], list[dict[str, str]]]] = []
        self.inline: list[str] = []
        self.ids: list[str] = []
        self.labelled: set[str] = set()
        self.is_in_label = False
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attributes}
        self.inline += [name for name in given if name.startswith("on")] + ["script"] * (
            tag == "script" and "src" not in given)
        self.ids += [value for name, value in given.items() if name == "id"]
        if tag == "form":
            self.forms.append((given, []))
        elif tag == "label":
            self.labelled.add(given.get("for", ""))
            self.is_in_label = True
        elif tag in ("input", "select", "textarea") and self.forms:
            self.forms[-1][1].append({"aria-label": "label around it", **given} if self.is_in_label else given)

    def handle_endtag(self, tag: str) -> None:
        self.is_in_label = self.is_in_label and tag != "label"


@pytest.fixture
def document(shared: httpx.Client) -> dict[str, Any]:
    document: dict[str, Any] = shared.get("/openapi.json").json()
    return document


def operation_of(document: dict[str, Any], method: str, action: str) -> dict[str, Any]:
    for path, methods in document["paths"].items():
        if re.fullmatch(re.sub(r"\\{\w+\\}", "[^/]+", re.escape(path)), action) and method.lower() in methods:
            operation: dict[str, Any] = methods[method.lower()]
            return operation
    raise AssertionError(f"{method} {action} is no operation")


def keys(document: dict[str, Any], schema: dict[str, Any], prefix: str = "") -> Iterator[str]:
    """The keys of a JSON body, with dots for those of objects in it."""
    schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema
    for name, inner in schema.get("properties", {}).items():
        yield f"{prefix}{name}"
        yield from keys(document, inner, f"{prefix}{name}.")


def test_what_forms_send_is_what_operations_take(shared: httpx.Client, document: dict[str, Any]) -> None:
    sent = 0
    for path in PAGES:
        for attributes, fields in Forms(shared.get(path).text).forms:
            if "data-body" not in attributes:  # a search or a choice, which works without a script
                continue
            operation = operation_of(document, attributes["data-method"], attributes["action"])
            known = {(each["in"], each["name"]) for each in operation.get("parameters", ())}
            content = operation.get("requestBody", {}).get("content", {})
            if "application/json" in content:
                known |= {("body", name) for name in keys(document, content["application/json"]["schema"])}
            given = {(field["data-place"], re.sub(r"^axes\..*", "axes", field["name"]))  # any parameter is an axis
                     for field in fields if field["data-sends"] != "file"}
            assert attributes["data-body"] == "other" or given <= known, (path, attributes["action"], given - known)
            sent += len(given)
    assert sent > 60


def test_pages_run_scripts_of_their_own_files_only_and_name_their_fields(shared: httpx.Client) -> None:
    for path in PAGES:
        page = shared.get(path)
        forms = Forms(page.text)
        assert forms.inline == []
        assert "default-src 'none'; style-src 'unsafe-inline'; script-src 'self'; connect-src 'self'" in page.text
        assert "Set-Cookie" not in page.headers
        assert sorted(set(forms.ids)) == sorted(forms.ids)
        for _, fields in forms.forms:
            for field in fields:
                if field.get("type") not in ("hidden", "checkbox"):
                    assert field.get("aria-label") or field["id"] in forms.labelled, field


FORGED = ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "http://[evil"},
          {"Sec-Fetch-Site": "cross-site"}, {"Sec-Fetch-Site": "same-site"})


def test_what_a_page_of_another_site_sends_is_refused(shared: httpx.Client, document: dict[str, Any]) -> None:
    operations = [(method, path) for path, methods in document["paths"].items() for method in methods
                  if method != "get"]
    assert ("delete", "/v1/benches/{name}") in operations
    for method, path in operations:
        for headers in FORGED:
            refused = shared.request(method.upper(), path.replace("{name}", "heavy"), content=b"{}", headers={
                **headers, "Content-Type": "application/json"})
            assert refused.status_code == 403, (method, path, headers)
            assert "another site" in refused.text
    assert shared.get("/v1/benches/heavy").is_success


def test_files_are_downloaded_as_they_are(client: httpx.Client, folder: Path) -> None:
    for kind, name, file in (("tables", "nominal", "nominal.h5"), ("recordings", "measured", "measured.h5"),
                             ("benches", "heavy", "heavy.toml")):
        response = client.get(f"/v1/{kind}/{name}/file")
        assert response.content == (folder / "tables" / file).read_bytes()
        assert response.headers["Content-Disposition"] == f'attachment; filename="{file}"'
        assert f"'{name}'" in problem(client.get(f"/v1/{kind}/{name}x/file"), 404)["remedy"]


def test_an_invalid_file_has_a_page_that_says_why_and_deletes_it(client: httpx.Client, folder: Path) -> None:
    (folder / "tables" / "damaged.h5").write_bytes(b"nothing")
    assert 'href="/tables/damaged"' in client.get("/").text
    page = client.get("/tables/damaged")
    assert page.status_code == 200
    assert "not an HDF5 file" in page.text
    assert 'action="/v1/tables/damaged" method="post" data-method="DELETE"' in page.text
    assert client.get("/v1/tables/damaged/file").content == b"nothing"
    problem(client.get("/recordings/nowhere"), 404)


@pytest.fixture
def compact(folder: Path) -> None:
    shutil.copy(TABLES / "compact.toml", folder / "tables")


def test_a_mapping_is_proposed_for_a_file(client: httpx.Client, compact: None) -> None:
    def propose(content: bytes, bench: str = "compact", name: str = "a.csv") -> httpx.Response:
        return client.post("/v1/recordings/proposal", params={"file": name, "bench": bench}, content=content,
                           headers={"Content-Type": "application/octet-stream"})

    proposed = propose(csv(run(), units="ms;kPa;rpm;rpm;N m")).json()
    assert proposed["mapping"]["signals"]["pressure"] == {"channel": "p_oil"}
    assert proposed["mapping"]["time"] == {"channel": "t"}
    assert [channel["name"] for channel in proposed["channels"]] == ["t", "p_oil", "n_in", "n_out", "M_out"]
    assert proposed["channels"][1] == {"name": "p_oil", "unit": "kPa", "samples": 1300}
    assert set(proposed["open_keys"]) >= {"shift_command", "load_inertia"}
    reasons = {guess["name"]: guess["reason"] for guess in proposed["guesses"]}
    assert reasons["pressure"] == "the name 'p_oil' and the unit 'kPa'"
    assert "a.csv is empty" in problem(propose(b""), 422)["detail"]
    assert propose(csv(run()), name=f"{251 * 'x'}.csv").is_success  # the longest name that file systems have
    problem(propose(b"\x00" * 2000), 422)
    problem(propose(b"t;n\n1;2\n", "nowhere"), 404)


def test_a_preview_says_what_would_be_imported_and_stores_nothing(client: httpx.Client, folder: Path,
                                                                  compact: None) -> None:
    def send(**query: str) -> httpx.Response:
        return client.post("/v1/recordings/import", params={"name": "imported", "bench": "compact", **query},
                           content=archive(FILES), headers=ZIP)

    preview = send(preview="true")
    assert preview.status_code == 200
    assert "Location" not in preview.headers
    assert preview.json()["recordings"]["measured_time"] == pytest.approx([LOCK], abs=3e-3)
    assert "no lock-up" in preview.json()["set_aside"][0]["reason"]
    assert not (folder / "tables" / "imported.h5").exists()
    stored = send()
    assert stored.status_code == 201
    assert stored.json() == preview.json()
    pictured, = send(preview="true", pictures="3").json()["pictures"]
    assert pictured["label"] == "a.csv"
    assert pictured["conditions"] == "profile 0, motor 157 rad/s, 0.4 kg m², brake 5 N m"
    pressure = next(each for each in pictured["pictures"] if each["title"] == "pressure [bar]")
    assert "dashed: shift command and shifting time" in pressure["caption"]
    assert pressure["svg"].startswith("<svg ")
    problem(send(preview="true", pictures="13"), 422)
    assert "'../x' is not a valid file name" in problem(send(preview="true", name="../x"), 422)["detail"]


@pytest.fixture
def sled(folder: Path) -> None:
    """A worker has told of the sled, which was called with signs of HTML and TOML, and of a machine without channels.
    """
    tell_of(folder, [*list_known([replace(DRIVEN, name=MACHINE)], []), *list_known([], BlackBox.open_all("two_tanks"))])


MACHINE = 'the <b>"sled"</b>'
OF_SLED = {"machine": MACHINE}


def tell_of(folder: Path, machines: list[KnownMachine]) -> None:
    """Let a worker tell of machines in the job database of a folder."""
    engine = open_database(f"sqlite:///{folder}/jobs.sqlite")
    with engine.begin() as connection:
        connection.execute(sql(heartbeat._CREATE))
    heartbeat.beat(engine, "sledge")
    known_machines.tell(engine, "sledge", machines)


def test_files_of_a_machine_are_proposed_previewed_and_imported(client: httpx.Client, folder: Path, sled: None) -> None:
    def propose(**query: str) -> httpx.Response:
        return client.post("/v1/recordings/proposal", params={"file": "sled.csv", **query},
                           content=as_csv(recording()), headers={"Content-Type": "application/octet-stream"})

    def send(files: dict[str, bytes], **query: str) -> httpx.Response:
        return client.post("/v1/recordings/import", params={"name": "moves", **OF_SLED, **query},
                           content=archive(files), headers=ZIP)

    assert propose(**OF_SLED).json()["open_keys"][-1] == "load"
    both = {**OF_SLED, "bench": "heavy"}
    for query, words in (({}, "Neither a bench nor a machine"), (both, "A bench and a machine"),
                         ({"machine": "two tanks"}, "declares outputs, and no channels")):
        assert words in problem(propose(**query), 422)["detail"]
    assert "'sled'" in problem(propose(machine="sled"), 404)["detail"]
    mapping = f"{OF_SLEDS}{STANDSTILLS}".replace('{ value = "3 N" }', '{ column = "load" }\nplan = "plan.csv"')
    files = {"channels.toml": mapping.encode(), "sled.csv": as_csv(recording()),
             "plan.csv": b"file;load [N]\nsled.csv;3,5\n"}
    preview = send(files, preview="true", pictures="2")
    assert preview.status_code == 200, preview.text
    body = preview.json()
    assert (body["recordings"]["machine"], body["computed"], len(body["engagements"])) == (MACHINE, None, 5)
    assert [[each["title"] for each in run["pictures"]] for run in body["pictures"]] == 2 * [
        ["position [m]", "speed [m/s]", "drive voltage [V]"]]
    assert body["doubts"] == []
    wrong = send({**files, "channels.toml": mapping.replace("mm/s", "m/s").encode()}, preview="true").json()["doubts"]
    assert [doubt.partition(" m/s in")[0] for doubt in wrong] == ["speed reaches 501.22"]
    assert not (folder / "tables" / "moves.h5").exists()
    stored = send(files)
    assert stored.status_code == 201
    assert client.get(stored.headers["Location"]).json()["conditions"] == {"load": [3.5] * 5}
    assert "sled" in client.get("/recordings/moves").text
    other = as_csv({"t": recording()["t"], "v": recording()["v"]})
    assert "other.csv has no channel" in problem(send({**files, "other.csv": other}), 422)["detail"]
    for wrong in ({"sled.csv": b""}, {"sled.csv": b"\0" * 99}, {"plan.csv": b""}, {"channels.toml": b"[signals"}):
        assert problem(send({**files, **wrong}), 422)["remedy"]


def test_fields_of_a_mapping_are_named_and_escaped(client: httpx.Client, sled: None) -> None:
    assert "machine=the+%3Cb%3E%22sled%22%3C%2Fb%3E" in client.get("/upload").text
    for query in ({"bench": "heavy"}, OF_SLED):
        page = client.get("/upload/mapping", params=query).text
        forms = Forms(f"<form>{page}</form>")
        assert sorted(set(forms.ids)) == sorted(forms.ids)
        (_, fields), = forms.forms
        for field in fields:
            assert field.get("aria-label") or field["id"] in forms.labelled, field
    paths = [json.loads(field["data-path"]) for field in fields if "data-path" in field]
    assert ["commands", "drive voltage", "held"] in paths
    problem(client.get("/upload/mapping", params={"machine": "nowhere"}), 404)


def text(page: str) -> str:
    return " ".join(re.sub("<[^>]+>", " ", page.partition("<main")[2]).split())


def test_jobs_and_files_are_searched(client: httpx.Client, folder: Path) -> None:
    shutil.copy(folder / "tables" / "measured.h5", folder / "tables" / "winter_100.h5")
    for key, recordings in (("first-of-all", "measured"), ("second", "winter_100")):
        assert client.post("/v1/studies", json={"recordings": recordings},
                           headers={"Idempotency-Key": key}).status_code == 202
    client.post("/v1/studies/second/cancel")
    client.post("/v1/fits", json={}, headers={"Idempotency-Key": "third"})
    for query, listed in (({"text": "FIRST"}, {"first-of-all"}), ({"text": "winter"}, {"second"}),
                          ({"text": "heavy"}, {"first-of-all", "second"}), ({"text": "%"}, set()),
                          ({"text": "r_1"}, {"second"}), ({"text": "f_r"}, set()),
                          ({"text": "winter", "status": "queued"}, set())):
        jobs = client.get("/v1/studies", params=query).json()
        assert ({job["id"] for job in jobs["studies"]}, jobs["total"]) == (listed, len(listed)), query
        page = text(client.get("/find", params=query).text)
        assert {job for job in ("first-of-all", "second") if f"{job} " in page} == listed, query
    assert "third queued" in text(client.get("/find", params={"text": "nominal"}).text)
    assert "third" not in text(client.get("/find", params={"among": "studies"}).text)
    page = text(client.get("/find", params={"text": "winter"}).text)
    assert "winter_100 216 engagements" in page
    assert "measured 216" not in page
    assert "No job was found" in text(client.get("/find", params={"text": "<b>nothing"}).text)
    assert "<b>nothing" not in client.get("/find", params={"text": "<b>nothing"}).text
    problem(client.get("/find", params={"among": "all of them"}), 422)


def test_a_queued_job_has_a_page_on_which_it_is_cancelled(client: httpx.Client) -> None:
    client.post("/v1/studies", json={}, headers={"Idempotency-Key": "mine"})
    page = client.get("/studies/mine").text
    assert 'href="/recordings/measured"' in page
    assert "Next in its queue" in page
    assert "No worker is alive" in page
    assert 'action="/v1/studies/mine/cancel"' in page
    assert "Delete" not in text(page)
    client.post("/v1/studies/mine/cancel")
    page = client.get("/studies/mine").text
    assert "cancelled" in page
    assert 'action="/v1/studies/mine" method="post" data-method="DELETE"' in page
    assert "the study “mine” is removed for everybody" in text(page).lower()
    problem(client.get("/fits/mine"), 404)


JOB = {"recordings": "measured", "recordings_digest": "c3d4" * 16, "table": "nominal", "table_digest": "a1b2" * 16,
       "simulate": False, "outside": "clip", "parameters": ["pressure_bias", "initial_position"], "bench": None,
       "bench_digest": None, "sensing_digest": None, "time_budget": 60.0}


BUILD = {"name": "gone", "machine": None, "output": None, "axes": {"pressure_bias": [0.8, 1.2, 3]},
         "accuracy": "default", "recordings": None, "recordings_digest": None, "bench": "heavy",
         "bench_digest": "d4" * 32, "sensing_digest": None, "model_digest": None, "time_budget": 60.0}
BUILT = {"result": {"digest": "e5" * 32, "shape": [3, 216],
                    "statuses": {"locked": 648, "never_locked": 0, "failed": 0}},
         "seconds": {}, "processor_seconds": {}}


def test_a_job_links_to_the_files_that_are_still_there(serving_jobs: Any, tmp_path: Path,
                                                       made: Callable[..., dict[str, Any]]) -> None:
    shutil.copy(TABLES / "heavy.toml", tmp_path)
    with serving_jobs(tmp_path, {"old": ({**JOB, "settings": {}}, made(n=24)), "built": (BUILD, BUILT)}) as client:
        page = client.get("/fits/old").text
        assert "recordings measured, which was renamed or deleted · table nominal, which" in text(page)
        assert not re.search('href="/(recordings|tables)/', page)
        page = client.get("/builds/built").text
        assert 'href="/benches/heavy"' in page
        assert 'href="/tables/gone"' not in page
        assert "The build “built” is removed for everybody with its result, and cannot" in text(page)
        assert "there is no table; the runs that are done are kept" in text(client.get("/benches/heavy").text)
        problem(client.get("/builds/built/pictures"), 404)


def test_a_page_says_that_the_service_no_longer_answers(folder: Path, serving: Any, screen: webdriver.Chrome) -> None:
    with serving(Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite")) as address:
        person = Person(screen, address)
        httpx.post(f"{address}/v1/studies", json={}, headers={"Idempotency-Key": "left"})
        person.open("/studies/left")
        person.until("Next in its queue")
        assert "does not answer" not in screen.find_element(By.TAG_NAME, "main").text
    person.until("The service does not answer. What is shown here was so when it last did.")


def test_two_fits_side_by_side(serving_jobs: Any, tmp_path: Path, made: Callable[..., dict[str, Any]]) -> None:
    outputs = [made(n=24), made(n=24)]
    outputs[1]["result"]["log10_likelihood"] = -150.0
    outputs[0]["result"]["mass_outside"], outputs[1]["result"]["mass_outside"] = 6e-16, 0.02
    jobs: Mapping[str, Any] = {
        name: ({**JOB, "settings": {"seed": seed, "population": 24}}, output)
        for name, seed, output in zip(("old", "new"), (1, 2), outputs, strict=True)}
    with serving_jobs(tmp_path, jobs) as client:
        page = client.get("/compare", params={"kind": "fit", "first": "old", "second": "new"})
        assert page.status_code == 200, page.text
        said = text(page.text)
        for words in ("log10 likelihood −269 −150", "seed 1 2", "pressure bias, mean 1.600 bar 1.600 bar",
                      f"output noise {1e3 * outputs[0]['result']['output_std']:#.4g} ms",
                      "outside the table below 0.01 % 2 %"):
            assert words in said, (words, said)
        assert "population" not in said
        assert page.text.count('<tr class=differs><th scope="row">log10 likelihood') == 1
        forms = Forms(page.text)
        assert sorted(set(forms.ids)) == sorted(forms.ids)
        assert page.text.count("<svg role=") % 2 == 0
        assert page.text.count("<svg role=") > 10
        problem(client.get("/compare", params={"kind": "fit", "first": "old", "second": "none"}), 404)
        pictures = client.get("/fits/old/pictures").text
        assert 'href="/v1/fits/old/pictures/profiles?format=png"' in pictures


# The whole way in a browser, with a worker.


class Person:
    """Somebody in front of a browser."""

    def __init__(self, browser: webdriver.Chrome, address: str) -> None:
        self.browser, self.address = browser, address
        self.wait = WebDriverWait(browser, 60)

    def open(self, path: str) -> None:
        self.browser.get(f"{self.address}{path}")

    def form(self, id: str) -> WebElement:
        """The form, unfolded."""
        form: WebElement = self.wait.until(lambda browser: browser.find_element(By.ID, id))
        self.browser.execute_script(
            "for (let e = arguments[0]; e; e = e.parentElement) { if (e.tagName === 'DETAILS') e.open = true }"
            "arguments[0].querySelectorAll('details').forEach(details => details.open = true)", form)
        return form

    def fill(self, form: WebElement, **values: str) -> None:
        for name, value in values.items():
            field = form.find_element(By.CSS_SELECTOR, f"[name$='{name}']")
            if field.tag_name == "select":
                Select(field).select_by_value(value)
            else:
                if field.get_attribute("type") != "file":
                    field.clear()
                field.send_keys(value)

    def send(self, form: WebElement) -> None:
        button = form.find_element(By.CSS_SELECTOR, ".send button")
        self.browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", button)
        button.click()

    def go_to(self, selector: str) -> WebElement:
        """What the key Tab reaches by and by."""
        for _ in range(200):
            self.browser.switch_to.active_element.send_keys(Keys.TAB)
            if self.browser.execute_script("return document.activeElement.matches(arguments[0])", selector):
                return self.browser.switch_to.active_element
        raise AssertionError(f"Tab does not reach {selector}")

    def arrive(self, path: str) -> None:
        self.wait.until(lambda browser: browser.current_url.partition("#")[0] == f"{self.address}{path}")

    def wrong(self, form: WebElement) -> str:
        """What the form says is wrong, once it says so."""
        def said(_: object) -> str:
            return " ".join(each.text for each in form.find_elements(By.CSS_SELECTOR, ".wrong") if each.is_displayed())

        told: str = self.wait.until(said)
        return told

    def until(self, words: str) -> None:
        # By a script, because the page may be replaced between two requests of the test.
        said = "return document.querySelector('main')?.innerText ?? ''"
        self.wait.until(lambda browser: words in browser.execute_script(said))


@pytest.fixture
def screen(browser: webdriver.Chrome) -> Iterator[webdriver.Chrome]:
    browser.get_log("browser")
    yield browser
    browser.get("about:blank")


QUICK = {"population": "8", "generations": "2", "intervals": "false"}


@pytest.mark.slow
def test_from_files_to_a_comparison_in_a_browser(quick_service: tuple[Path, httpx.Client], screen: webdriver.Chrome,
                                                 tmp_path: Path) -> None:
    tables, client = quick_service
    shutil.copy(TABLES / "compact.toml", tables)
    person = Person(screen, str(client.base_url).rstrip("/"))
    # Recordings by the file field; its name is proposed. What is wrong stands beside the field.
    person.open("/upload")
    upload = person.form("upload-recordings")
    person.send(upload)
    assert person.wrong(upload) == "Choose a file Fill in this field"
    shutil.copy(tables / "measured.h5", tmp_path / "few runs.h5")
    person.fill(upload, file=str(tmp_path / "few runs.h5"))
    assert upload.find_element(By.NAME, "name").get_attribute("value") == "few-runs"
    person.fill(upload, name="nominal")
    person.send(upload)
    assert person.wrong(upload).startswith("A different file named 'nominal' already exists. Choose another name")
    assert screen.switch_to.active_element.get_attribute("name") == "name"
    person.fill(upload, name="acted")
    person.send(upload)
    person.arrive("/recordings/acted")
    # Files of a logger: proposed, completed, previewed, imported.
    person.open("/upload")
    paths = []
    for name, lock in (("a", LOCK), ("b", 3.0)):
        paths.append(tmp_path / f"{name}.csv")
        paths[-1].write_bytes(csv(run(lock=lock), units="ms;kPa;rpm;rpm;N m"))
    choose = person.form("read-files")
    person.fill(choose, files="\n".join(map(str, paths)), subject="bench=compact", name="logged")
    person.send(choose)
    mapping = person.form("mapping")
    person.wait.until(lambda _: mapping.is_displayed())
    pressure = mapping.find_element(By.NAME, "signals.pressure.channel")
    assert Select(pressure).first_selected_option.text == "p_oil [kPa]"
    person.send(mapping)
    assert person.wrong(mapping) == "Choose a channel, or state a time with its unit"
    sheet = tmp_path / "plan.csv"
    sheet.write_text("file;brake torque [N m]\na.csv;5,0\nb.csv;5,0\n")
    person.form("mapping")  # with what was folded when it was shown
    person.fill(mapping, **{"shift_command.level": "100 ms", "current_profile.value": "0",
                            "motor_speed.value": "1500 rpm", "load_inertia.value": "0,4 kg m^2", "plan": str(sheet)})
    brake = Select(mapping.find_element(By.NAME, "conditions.brake_torque"))
    person.wait.until(lambda _: brake.first_selected_option.text == "brake torque [N m]")
    sign = mapping.find_element(By.NAME, "signals.output_torque.sign")
    screen.execute_script("arguments[0].scrollIntoView({block: 'center'})", sign)
    sign.click()
    person.send(mapping)
    preview = person.form("preview")
    person.wait.until(lambda _: preview.is_displayed())
    assert "1 of 2 engagements" in preview.text
    assert "b.csv: no lock-up" in preview.text
    assert len(preview.find_elements(By.CSS_SELECTOR, ".picture svg")) == 5
    assert not (tables / "logged.h5").exists()
    person.send(preview)
    person.arrive("/recordings/logged")
    import_runs_by_keys(person, tables, tmp_path)
    # Two fits, the second one by the keyboard alone, watched to their ends without a reload by hand.
    person.open("/recordings/acted")
    fit = person.form("fit")
    person.fill(fit, **{"Idempotency-Key": "acted-one", "settings.seed": "1.5", "table": "nominal"}
                if fit.find_elements(By.CSS_SELECTOR, "select[name=table]") else
                {"Idempotency-Key": "acted-one", "settings.seed": "1.5"})
    person.send(fit)
    assert "integer" in person.wrong(fit)
    assert screen.switch_to.active_element.get_attribute("name") == "settings.seed"
    person.fill(fit, **{f"settings.{name}": value for name, value in {**QUICK, "seed": "1"}.items()})
    person.send(fit)
    person.arrive("/fits/acted-one")
    person.until("Results")
    by_keyboard(person)
    person.until("Results")
    # A long one is cancelled.
    client.post("/v1/fits", json={"recordings": "acted", "settings": {
        "population": 60, "generations": 300, "patience": 300}}, headers={"Idempotency-Key": "acted-long"})
    person.open("/fits/acted-long")
    person.until("running")
    person.send(person.form("cancel"))
    person.until("cancelled")
    person.until("Delete the fit")
    # Side by side.
    person.open("/fits/acted-one")
    compare = person.form("compare-second").find_element(By.XPATH, "./ancestor::form")
    person.fill(compare, second="acted-two")
    person.send(compare)
    person.until("Two fits side by side")
    assert "seed" in screen.find_element(By.TAG_NAME, "main").text
    # Another name, and deletion, which says what goes and what it needs.
    person.open("/recordings/acted")
    rename = person.form("rename")
    person.fill(rename, name="acted-again")
    person.send(rename)
    person.arrive("/recordings/acted-again")
    person.open("/fits/acted-one")
    delete = person.form("delete")
    assert "is removed for everybody with its result" in delete.find_element(By.XPATH, "./ancestor::details").text
    person.send(delete)
    person.arrive("/")
    assert client.get("/v1/fits/acted-one").status_code == 404
    person.open("/recordings/logged")
    person.send(person.form("delete"))
    person.arrive("/")
    assert not (tables / "logged.h5").exists()
    severe = [entry["message"] for entry in screen.get_log("browser") if entry["level"] == "SEVERE"]
    assert [message for message in severe if "status of 4" not in message] == []


def import_runs_by_keys(person: Person, tables: Path, folder: Path) -> None:
    """Cut a long recording of the sled into runs, after its file was chosen with keys only, and look at two of them."""
    name = 'long "x" <b>.csv'
    (folder / name).write_bytes(as_csv(recording()).replace(b"t,v,x,u", b"t [ms],v [mm/s],x [mm],u [V]"))
    tell_of(tables.parent, list_known([SLED], []))
    person.open("/upload")
    choose = person.form("read-files")
    person.fill(choose, files=str(folder / name), subject="machine=sled")
    assert choose.find_element(By.NAME, "name").get_attribute("value") == "long-x-b-"
    person.go_to("#read-files button").send_keys(Keys.ENTER)
    mapping = person.form("mapping")
    person.wait.until(lambda _: mapping.is_displayed())
    person.go_to("[name='commands.drive voltage.channel']").send_keys("u")
    person.go_to("[name='conditions.load.value']").send_keys("3 N")
    person.go_to("[name='runs.cut']").send_keys("at stand")
    person.go_to("[name='runs.channel']").send_keys("v")
    person.go_to("[name='runs.level']").send_keys("20")
    person.go_to("#mapping .send button").send_keys(Keys.ENTER)
    preview = person.form("preview")
    person.wait.until(lambda _: preview.is_displayed())
    assert "5 of 5 runs, none is set aside" in preview.text
    assert f"{name}, run 0: load 3 N" in preview.text
    person.browser.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    assert f"{name}, run 1: load 3 N" in preview.text
    person.go_to("#preview .send button").send_keys(Keys.ENTER)
    person.arrive("/recordings/long-x-b-")
    assert (tables / "long-x-b-.h5").exists()


def by_keyboard(person: Person) -> None:
    """Start a fit of `acted` with Tab, Space, letters and Enter only."""
    person.open("/recordings/acted")
    screen, go_to = person.browser, person.go_to
    go_to("details:has(#fit) > summary").send_keys(Keys.ENTER)
    go_to("#fit input[value=initial_position]").send_keys(Keys.SPACE)
    go_to("#fit [name=Idempotency-Key]").send_keys("acted-two")
    go_to("#fit .experts > summary").send_keys(Keys.SPACE)
    for name, value in {"seed": "2", **QUICK}.items():
        field = go_to(f"#fit [name='settings.{name}']")
        field.send_keys(value if field.tag_name == "input" else "no")
    screen.switch_to.active_element.send_keys(Keys.TAB)
    go_to("#fit button").send_keys(Keys.ENTER)
    person.arrive("/fits/acted-two")


@pytest.mark.slow
def test_what_is_wrong_with_files_of_a_logger_is_said_beside_its_field(
        client: httpx.Client, folder: Path, sled: None, screen: webdriver.Chrome, tmp_path: Path) -> None:
    person = Person(screen, str(client.base_url).rstrip("/"))
    person.open("/upload")
    paths = [tmp_path / f"sled_{number}.csv" for number in (10, 11)]
    for seed, path in enumerate(paths):
        path.write_bytes(as_csv(recording(2, seed)).replace(b"t,v,x,u", b"t [ms],v [mm/s],x [mm],u [V]"))
    upload = person.form("upload-recordings")
    (tmp_path / "semicolons.csv").write_text("t;v\n1;2\n")
    person.fill(upload, file=str(tmp_path / "semicolons.csv"), bench="heavy")
    person.send(upload)
    assert "Files of a logger, with other columns or separators, are added below" in person.wrong(upload)
    (tmp_path / "run.mf4").write_bytes(b"MDF")
    person.fill(upload, file=str(tmp_path / "run.mf4"))
    person.send(upload)
    assert person.wrong(upload) == ("'run.mf4' does not end in .csv or .h5 or .hdf5. Choose such a file. "
                                    "Files of a logger, with other columns or separators, are added below.")
    # The common begin of the names is proposed, and replaced by typing.
    choose = person.form("read-files")
    person.fill(choose, files="\n".join(map(str, paths)), subject="machine=the+%3Cb%3E%22sled%22%3C%2Fb%3E")
    assert choose.find_element(By.NAME, "name").get_attribute("value") == "sled"
    person.go_to("#read-files [name=name]").send_keys("measured")
    assert choose.find_element(By.NAME, "name").get_attribute("value") == "measured"
    person.send(choose)
    mapping = person.form("mapping")
    person.wait.until(lambda _: mapping.is_displayed())
    # A row that is empty, and a channel of another quantity; the words go when the row is changed.
    person.send(mapping)
    assert person.wrong(mapping) == "Choose a channel, or state a number with its unit"
    person.fill(mapping, **{"load.value": "3 N", "drive voltage.channel": ""})
    assert not [each for each in mapping.find_elements(By.CSS_SELECTOR, ".wrong") if each.is_displayed()]
    assert not mapping.find_elements(By.CSS_SELECTOR, "[aria-invalid]")
    person.send(mapping)
    assert person.wrong(mapping) == "Choose a channel"
    person.fill(mapping, **{"drive voltage.channel": "u"})
    person.fill(mapping, **{"signals.speed.channel": "u"})
    person.send(mapping)
    assert person.wrong(mapping) == (
        "The channel 'u' of sled_10.csv has the unit V, which is no unit of a quantity in m/s. Check that it is the "
        "right channel; if it is, state the unit of its numbers")
    person.fill(mapping, **{"signals.speed.channel": "v", "signals.speed.unit": "m/s"})
    person.send(mapping)
    preview = person.form("preview")
    person.wait.until(lambda _: preview.is_displayed())
    assert "m/s in the runs, and 0.5 m/s in the experiments that the machine declares. Check its unit" in preview.text
    # Another name keeps the mapping and the preview.
    person.send(preview)
    assert person.wrong(preview).startswith("A different file named 'measured' already exists. Choose another name")
    name = choose.find_element(By.NAME, "name")
    name.clear()
    name.send_keys("moves", Keys.ENTER)
    assert preview.is_displayed()
    assert "already exists" not in preview.text
    assert mapping.find_element(By.NAME, "signals.speed.unit").get_attribute("value") == "m/s"
    person.send(preview)
    person.arrive("/recordings/moves")
    assert (folder / "tables" / "moves.h5").exists()


@pytest.mark.slow
def test_the_page_asks_for_a_token_and_respects_its_role(folder: Path, serving: Any, screen: webdriver.Chrome) -> None:
    secrets, lines = zip(*(new_token(role, role) for role in ("read", "run")), strict=True)
    (folder / "tokens.txt").write_text("\n".join(lines))
    with serving(Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite",
                          tokens=folder / "tokens.txt")) as address:
        person = Person(screen, address)
        screen.get(address.replace("://", f"://reader:{secrets[0]}@") + "/recordings/measured")
        study = person.form("study")
        person.fill(study, **{"Idempotency-Key": "asked"})
        person.send(study)
        dialog = person.wait.until(lambda browser: browser.find_element(By.CSS_SELECTOR, "dialog[open]"))
        assert "needs the role run; the token 'read' has the role read" in dialog.text
        screen.switch_to.active_element.send_keys(Keys.ESCAPE)
        assert "needs the role run" in person.wrong(study)
        person.send(study)
        field = person.wait.until(lambda browser: browser.find_element(By.ID, "token"))
        field.send_keys(secrets[1], Keys.ENTER)
        person.arrive("/studies/asked")
        assert secrets[1] not in screen.current_url
        kept = screen.execute_script("return [document.cookie, localStorage.length, Object.values(sessionStorage)]")
        assert kept == ["", 0, [secrets[1]]]
        person.send(person.form("cancel"))
        person.until("cancelled")  # with the same token
        screen.execute_script("sessionStorage.clear()")


@pytest.mark.slow
def test_nothing_leaves_a_narrow_screen(client: httpx.Client, screen: webdriver.Chrome) -> None:
    screen.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True})
    try:
        for path in PAGES:
            screen.get(str(client.base_url).rstrip("/") + path)
            screen.execute_script("document.querySelectorAll('details').forEach(details => details.open = true)")
            assert screen.execute_script("return document.documentElement.scrollWidth") <= 390, path
    finally:
        screen.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
