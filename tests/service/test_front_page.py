"""The front page and /docs: what they list and say, the progress of studies, and both in a real browser."""

import html
import json
import re
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.wait import WebDriverWait
from test_problems import problem

from service.front import jobs
from service.job_store import JobStore
from service.settings import Settings
from service.study_schemas import StudyWithProgress
from slipstick.naming.asked import Asked
from slipstick.studies import StudySettings
from slipstick.studies.progress import StudyProgress, StudySteps
from tests.benches import HEAVY


@pytest.fixture
def client(own_client: httpx.Client) -> httpx.Client:
    return own_client


def text(client: httpx.Client, **query: int) -> str:
    """The text of the page in one line."""
    page = client.get("/", params=query)
    assert (page.status_code, page.headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    return " ".join(re.sub("<[^>]+>", " ", page.text.partition("<main")[2]).split())


def test_an_empty_service_says_what_to_do_first(tmp_path: Path, serving: Any) -> None:
    (tmp_path / "tables").mkdir()
    with serving(Settings(tables=tmp_path / "tables", jobs=f"sqlite:///{tmp_path}/jobs.sqlite")) as address, \
            httpx.Client(base_url=address) as client:
        found = text(client)
    steps = ("Add a bench", "slipstick bench new", "Add recordings", "slipstick work")
    assert sorted(steps, key=found.index) == list(steps)
    for nothing in ("There is no table yet", "There are no recordings yet", "There is no bench yet", "0 workers alive"):
        assert nothing in found
    assert "All as" not in found


BROWSER = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"


@pytest.mark.parametrize(("path", "status", "says"), [
    ("/nothing", 404, "There is no resource at /nothing."), ("/tables/nominl", 404, "Did you mean 'nominal'?"),
    ("/v1/studies/none/report", 404, "none"), ("/tables/%3Cb%3E", 404, "'<b>'"),
    ("/?count=0", 422, "query.count: Input should be greater than"),
])
def test_a_browser_gets_an_error_as_a_page_and_a_program_as_a_problem(client: httpx.Client, path: str, status: int,
                                                                      says: str) -> None:
    page = client.get(path, headers={"Accept": BROWSER})
    assert (page.status_code, page.headers["Content-Type"]) == (status, "text/html; charset=utf-8")
    assert html.escape(says) in page.text
    for link in ("/", "/docs", "/v1", "/#studies"):
        assert f'href="{link}"' in page.text
    assert page.headers["X-Request-ID"] in page.text
    assert "<b>" not in page.text.partition("<main")[2]
    for accept in ("*/*", "application/json", "application/json, text/html;q=0.5", ""):
        problem(client.get(path, headers={"Accept": accept}), status)
    problem(client.post("/nothing", headers={"Accept": BROWSER}), 404)


def test_the_page_lists_files_and_jobs_and_the_steps_that_are_left(client: httpx.Client, folder: Path) -> None:
    (folder / "tables" / "damaged.h5").write_bytes(b"nothing")
    found = text(client)
    for said in ("Grid of 9 × 9 points over pressure bias (0.8 to 2.4 bar) and initial position (0.25 to 0.75 mm), "
                 "under 216 conditions", "216 engagements with signals", "Heavy-vehicle test bench, 216 conditions",
                 "damaged invalid", "No job is running or waiting", "What to do next", "slipstick work"):
        assert said in found
    assert "worker build " not in found
    for id in ("one", "two", "three"):
        client.post("/v1/studies", json={}, headers={"Idempotency-Key": id})
    client.post("/v1/studies/two/cancel")
    found = text(client)
    for said in ("0 workers alive · 0 running · 2 waiting", "No worker is alive", "Next in its queue",
                 "1 job before it in its queue", "two cancelled"):
        assert said in found
    assert "Study “" not in found  # the step is done


def test_ended_jobs_come_in_parts(client: httpx.Client) -> None:
    for number in range(3):
        client.post(f"{client.post('/v1/fits', json={}).json()['links']['self']}/cancel")
        assert text(client).count("cancelled") == number + 1
    assert text(client, count=2).count("cancelled") == 2
    assert "Show more fits" in text(client, count=2)
    for _ in range(3):
        client.post("/v1/fits", json={})
    shown = text(client, count=2)
    assert "0 running · 3 waiting" in shown
    assert "1 job before it in its queue" in shown
    assert "2 jobs before it" not in shown
    assert "1 more job: studies that wait" in shown
    assert "2 jobs before it in its queue" in text(client, count=3)
    assert "more job" not in text(client, count=3)
    assert "Show more" not in text(client, count=3)
    for wrong in ({"count": 0}, {"counts": 2}):
        problem(client.get("/", params=wrong), 422)


@pytest.mark.parametrize(("path", "said"), [
    ("tables/nominal", ("pressure bias 1.6 bar 0.5 to 1.5 9", "motor speed [rad/s]", "215 5 198.97 14 80")),
    ("recordings/measured", ("shifting time [s]", "0 0 104.72 6 20 0.3028")),
    ("benches/heavy", ("pressure_bias", "1.6 bar", "load inertia [kg m²]", "215 5"))])
def test_files_have_pages_with_their_conditions(client: httpx.Client, path: str, said: tuple[str, ...]) -> None:
    page = client.get(f"/{path}")
    assert page.headers["Content-Type"] == "text/html; charset=utf-8"
    found = " ".join(re.sub("<[^>]+>", " ", page.text).split())
    for words in said:
        assert words in found, found[:3000]
    problem(client.get(f"/{path}x"), 404)
    assert f'href="/{path}"' in client.get("/").text


def test_a_page_has_some_conditions_and_the_number_of_the_others(client: httpx.Client,
                                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.front.details._MOST", 10)
    found = client.get("/recordings/measured").text
    assert "<th>9</th>" in found
    assert "<th>10</th>" not in found
    assert "206 more are in the description as JSON" in found


def test_names_are_text_not_markup(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    client.post("/v1/studies", json={}, headers={"Idempotency-Key": "one"})
    monkeypatch.setattr("service.front.jobs.describe_subject", lambda job: "<script>alert(1)</script>")
    assert "&lt;script&gt;alert" in client.get("/").text
    assert "<script>alert" not in client.get("/").text


@pytest.mark.slow
def test_the_page_in_a_browser(quick_service: tuple[Path, httpx.Client], browser: webdriver.Chrome,
                               requested: Callable[[], list[str]], tmp_path: Path) -> None:
    address = str(quick_service[1].base_url).rstrip("/")
    requested(), browser.get_log("browser")
    browser.get(f"{address}/")
    wait = WebDriverWait(browser, 60, ignored_exceptions=[StaleElementReferenceException])  # updates replace the jobs
    assert not browser.find_elements(By.CSS_SELECTOR, "progress")
    # A fit that is submitted later appears, shows its progress, and ends with its report, without a reload.
    browser.execute_script("window.marked = true")
    settings = {"population": 60, "generations": 300, "patience": 300, "intervals": False}
    quick_service[1].post("/v1/fits", json={"settings": settings}, headers={"Idempotency-Key": "watched"})
    job = "//li[.//a[text()='watched']]"
    seen: list[float] = []

    def advances(_: object) -> bool:
        bars = browser.execute_script("return [...document.querySelectorAll('progress')].map(bar => bar.value)")
        seen.extend(value for value in bars if value not in seen)
        return len(seen) >= 3

    wait.until(advances)
    assert seen == sorted(seen)
    # The keyboard: the focus survives an update of the jobs.
    # In one step: an update in between would replace the link.
    browser.execute_script("[...document.links].find(link => link.textContent === 'watched').focus()")
    count = len(seen)
    wait.until(lambda _: advances(_) and len(seen) > count)
    assert browser.execute_script("return document.activeElement.textContent") == "watched"
    quick_service[1].post("/v1/fits/watched/cancel")
    wait.until(lambda _: "cancelled" in browser.find_element(By.XPATH, job).text)
    assert browser.execute_script("return window.marked")
    assert {urlsplit(url).netloc for url in requested()} == {urlsplit(address).netloc}
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


@pytest.mark.slow
@pytest.mark.parametrize("width", [320, 1100])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_on_screens_of_all_kinds(client: httpx.Client, browser: webdriver.Chrome, width: int,
                                          scheme: str) -> None:
    client.post("/v1/studies", json={}, headers={"Idempotency-Key": "a" * 64})
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                            {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 500})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia",
                            {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
    try:
        browser.get(str(client.base_url))
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        ink, page = browser.execute_script(
            "let s = getComputedStyle(document.body); return [s.color, s.backgroundColor]")
        bright = [sum(int(part) for part in re.findall(r"\d+", color)[:3]) for color in (ink, page)]
        assert (bright[0] < bright[1]) == (scheme == "light")
        # The first stop of the keyboard skips the navigation; later ones reach every link.
        body = browser.find_element(By.TAG_NAME, "body")
        body.send_keys(Keys.TAB)
        first = browser.switch_to.active_element
        assert first.text == "Skip to the content"
        assert first.rect["x"] >= 0
        links = browser.execute_script("return document.querySelectorAll('a').length")
        reached = {first.get_attribute("href")}
        for _ in range(links + 10):
            browser.switch_to.active_element.send_keys(Keys.TAB)
            reached.add(browser.switch_to.active_element.get_attribute("href"))
        assert {link.get_attribute("href") for link in browser.find_elements(By.TAG_NAME, "a")} <= reached
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


@pytest.mark.slow
def test_the_page_of_a_job_that_is_deleted_says_so(client: httpx.Client, folder: Path,
                                                   browser: webdriver.Chrome) -> None:
    client.post("/v1/studies", json={}, headers={"Idempotency-Key": "doomed"}).raise_for_status()
    browser.get(str(client.base_url.join("/studies/doomed")))
    wait = WebDriverWait(browser, 30, ignored_exceptions=[StaleElementReferenceException])
    wait.until(lambda _: "Next in its queue" in browser.find_element(By.TAG_NAME, "main").text)
    with closing(sqlite3.connect(folder / "jobs.sqlite")) as database, database:
        database.execute("DELETE FROM workflow_status")
    wait.until(lambda _: "There is no study" in browser.find_element(By.TAG_NAME, "main").text)


@pytest.mark.slow
def test_the_page_without_scripts_reloads(client: httpx.Client, browser: webdriver.Chrome) -> None:
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        browser.get(str(client.base_url))
        assert "No job is running" in browser.find_element(By.TAG_NAME, "main").text
        client.post("/v1/studies", json={}, headers={"Idempotency-Key": "later"})
        end = time.monotonic() + 30
        while "later" not in browser.find_element(By.TAG_NAME, "main").text:
            assert time.monotonic() < end
            time.sleep(0.5)
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


# The progress of a study over REST and on the front page; a worker of an earlier version reported less.


Running = Callable[[dict[str, Any] | None], httpx.Response]
JOB_INPUT = {"recordings": "few", "recordings_digest": "c3d4", "bench": "heavy", "bench_digest": HEAVY.digest,
             "sensing_digest": HEAVY.sensing_digest, "settings": json.loads(json.dumps(asdict(StudySettings())))}


@pytest.fixture
def running(serving_jobs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A function that returns the status of a running study whose worker has reported this progress."""
    with serving_jobs(tmp_path, {"mine": (JOB_INPUT, None)}) as client:
        def status(progress: dict[str, Any] | None) -> httpx.Response:
            monkeypatch.setattr(JobStore, "progress", lambda *_: progress)
            return client.get("/v1/studies/mine")

        yield status


def test_a_running_study_states_its_step_its_share_and_what_it_tries(running: Running) -> None:
    reported: list[StudyProgress] = []
    tries = Asked("contact", ("contact",), ("friction coefficient", "slip"))
    StudySteps(("pressure", "output_torque", "output_speed", "input_speed"), reported.append).report_naming(tries)
    found = running(asdict(reported[0])).json()
    assert found["progress"] == {"stage": "name", "step": 7, "steps": 12, "done": 0.5, "doing": reported[0].doing,
                                 "budget_left": None}
    shown = jobs.describe_progress(StudyWithProgress(**found))
    assert '<progress value="0.500" aria-label="Steps of mine">50 %</progress>' in shown
    assert "Step 7 of 12. Block “pressure, slip → torque in full contact”: trying “friction" in shown
    assert "time budget" not in shown
    limited = running({**asdict(reported[0]), "budget_left": 300.0}).json()
    assert limited["progress"]["budget_left"] == 300
    assert "5 min of the time budget left" in jobs.describe_progress(StudyWithProgress(**limited))


def test_progress_of_an_earlier_version_is_left_out(running: Running) -> None:
    for reported in ({"stage": "name", "doing": "asking the blocks"}, None):
        answer = running(reported)
        assert (answer.status_code, answer.json()["progress"]) == (200, None)
        assert "Starting" in jobs.describe_progress(StudyWithProgress(**answer.json()))


def test_a_study_that_is_done_has_done_all_of_its_steps(
        serving_jobs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    last = {"stage": "confirm", "step": 12, "steps": 12, "done": 11 / 12, "doing": "Predicting held-out conditions"}
    monkeypatch.setattr(JobStore, "progress", lambda *_: last)
    with serving_jobs(tmp_path, {"mine": (JOB_INPUT, {"result": {}})}) as client:
        found = client.get("/v1/studies/mine").json()
    assert found["status"] == "done"
    assert found["progress"] == {**last, "done": 1.0, "budget_left": None}


# The page /docs in a browser without internet access: it renders, and "Try it out" works, with files as well.

CSV = """current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]
0,104.7,6,20,0.9
0,104.7,6,50,0.95
"""


@pytest.mark.slow
def test_the_page_works_without_internet_access(browser: webdriver.Chrome, requested: Callable[[], list[str]],
                                                address: str, tmp_path: Path) -> None:
    requested(), browser.get_log("browser")
    browser.get(f"{address}/docs")
    wait = WebDriverWait(browser, 20)
    blocks = wait.until(lambda _: browser.find_elements(By.CSS_SELECTOR, ".opblock"))
    assert len(blocks) >= 14
    file = tmp_path / "two.csv"
    file.write_text(CSV)
    for operation in ("evaluate", "propagate", "likelihood", "upload_recordings", "submit_fit", "follow_fit"):
        block = browser.find_element(By.CSS_SELECTOR, f".opblock[id$='-{operation}']")
        chosen = file if operation == "upload_recordings" else None
        assert _try(browser, block, chosen) in ("200", "201", "202"), f"{operation}: {block.text}"
    browser.save_screenshot(tmp_path / "docs.png")
    hosts = {urlsplit(url).netloc for url in requested()}
    assert hosts == {urlsplit(address).netloc}
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def _try(browser: webdriver.Chrome, block: WebElement, file: Path | None) -> str:
    """Execute an operation with "Try it out", with this `file`, and return the status that the page displays."""
    wait = WebDriverWait(block, 20)
    block.find_element(By.CSS_SELECTOR, ".opblock-summary-control").click()
    for button in (".try-out__btn", ".execute"):
        if button == ".execute" and file is not None:
            wait.until(lambda block: block.find_element(By.CSS_SELECTOR, "input[type=file]")).send_keys(str(file))
        element = wait.until(lambda block, button=button: block.find_element(By.CSS_SELECTOR, button))
        browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()
    status = wait.until(lambda block: block.find_element(
        By.CSS_SELECTOR, ".live-responses-table tbody .response-col_status"))
    return status.text.split()[0]
