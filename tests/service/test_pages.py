"""The pages of recordings, tables and benches, names and laws of studies: what they show, and on a narrow screen."""

import datetime
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import httpx
import numpy as np
import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait
from test_problems import problem

from service.front import mapped
from service.front.details import numbers_table
from service.front.elements import job_name
from slipstick.machine import Profile, Runs
from slipstick.pictures import units
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.table import Grid
from tests.benches import HEAVY


@pytest.fixture
def client(own_client: httpx.Client) -> httpx.Client:
    return own_client


def text(client: httpx.Client, path: str) -> str:
    """The text of the main content of a page in one line."""
    page = client.get(path)
    assert (page.status_code, page.headers["Content-Type"]) == (200, "text/html; charset=utf-8"), page.text
    return " ".join(re.sub("<[^>]+>", " ", page.text.partition("<main")[2]).split())


def runs_of_a_fan() -> Runs:
    time = np.linspace(0, 1, 101)
    speed = np.array([30.0, 40.0, 50.0])[:, None] * time + 0.01 * np.sin(40 * time)
    speed[1, 50] = 500.0
    command = Profile(np.tile([0.0, 1.0], (3, 1)), np.tile([0.0, 12.0], (3, 1)))
    return Runs(time, {"fan speed": speed}, {"supply": command}, {"set speed": np.array([20.0, 35.0, 900.0])},
                {"housing <b>": np.full((3, 101), 20.0), "mass": np.array([1.0, 2.0, 3.0])},
                units={"fan speed": "rad/s", "set speed": "rad/s", "supply": "V", "housing <b>": "degC",
                       "mass": "kg m^2"}, machine="fan")


def test_recordings_are_flipped_through_run_by_run(client: httpx.Client, folder: Path) -> None:
    recordings = Recordings.open(folder / "tables" / "measured.h5")
    shown = text(client, "/recordings/measured?run=7")
    assert "Engagement 7 ← Previous Next → Engagement of 0 to 215" in shown
    assert f"shifting time {recordings.measured_time[7]:.4g} s" in shown
    for head in ("output torque [N m]", "input speed [rad/s]", "output speed [rad/s]", "pressure [bar]", "current [A]",
                 "shifting time [s]"):
        assert head in shown
    page = client.get("/recordings/measured?run=7").text
    assert 'rel="prev" href="?run=6#run"' in page
    assert 'rel="next" href="?run=8#run"' in page
    assert page.count('role="img"') == 6
    assert "motor speed</text>" in page
    assert "All 216 conditions as a table" in shown
    assert 'rel="prev"' not in client.get("/recordings/measured").text
    assert 'rel="next"' not in client.get("/recordings/measured?run=215").text
    for wrong in (216, -1, "x"):
        problem(client.get("/recordings/measured", params={"run": wrong}), 404 if wrong == 216 else 422)


def test_no_oil_below_vacuum_is_drawn_and_the_page_says_so(client: httpx.Client, folder: Path) -> None:
    pressure = Recordings.open(folder / "tables" / "measured.h5").signals["pressure"][0]
    assert pressure.min() < -1
    shown = text(client, "/recordings/measured")
    below = int((pressure < -1).sum())
    assert f"{below} samples from" in shown
    assert f"below vacuum, down to −{-pressure.min():.3g} bar, not drawn" in shown


def test_runs_of_a_machine_have_their_names_units_levels_and_flaws(client: httpx.Client, folder: Path) -> None:
    runs_of_a_fan().save(folder / "tables" / "fan.h5")
    shown = text(client, "/recordings/fan?run=1")
    for said in ("Run 1", "set speed 35 rad/s", "fan speed [rad/s]", "supply [V]", "housing &lt;b&gt; [°C]",
                 "fan speed: spike at 0.5 s", "1 run with a gap, a spike or a saturation: 1", "mass [kg m²]"):
        assert said in shown, (said, shown)
    page = client.get("/recordings/fan?run=1").text
    assert "<b>" not in page.partition("<main")[2]
    assert "set speed</text>" in page
    assert "set speed</text>" not in client.get("/recordings/fan?run=2").text  # beyond what the signal reaches
    assert "No gap, no spike and no saturation in any signal." in text(client, "/recordings/fan?run=0")


def test_recordings_without_signals_show_their_numbers(client: httpx.Client, folder: Path) -> None:
    with h5py.File(folder / "tables" / "measured.h5", "r+") as file:
        del file["signals"]
    page = client.get("/recordings/measured?run=3")
    assert "Engagement 3" in page.text
    assert "No gap" not in page.text
    assert page.text.count('role="img"') == 1


def test_a_table_has_a_map_for_a_chosen_condition(client: httpx.Client, library: Library) -> None:
    table = library.table("nominal")
    shown = text(client, "/tables/nominal?condition=5&x=initial_position")
    assert "Shifting time over initial position and pressure bias" in shown
    assert "Condition 5: profile 0, motor 105 rad/s, 10 kg m², brake 80 N m" in shown
    page = client.get("/tables/nominal?condition=5").text
    assert '<option value="pressure_bias" selected>' in page
    times = table.interpolate(np.array([[x, y] for x in table.axes[0].values for y in table.axes[1].values]))[:, 5]
    assert f"from {times.min():.4g} to {times.max():.4g} s" in page
    assert "A cross marks the nominal point" in page
    assert ">nominal</text>" in page
    problem(client.get("/tables/nominal?condition=216"), 404)
    problem(client.get("/tables/nominal?x=pressure_bais"), 404)


def test_map_and_curves_of_a_table_have_the_same_unit(library: Library) -> None:
    table = library.table("nominal")
    assert isinstance(table, Grid)
    drawn = mapped._draw(replace(table, times=0.05 * table.times), 5, [0, 1])
    assert [panel.title for panel in drawn] == 2 * ["shifting time [ms]"]


def test_columns_without_a_unit_have_none() -> None:
    shown = numbers_table("number", {"voltage_profile [1]": [0.0], "load_torque [N m]": [0.5]}, 1, "condition")
    assert re.findall("<th>([^<]+)", shown)[:3] == ["number", "voltage profile", "load torque [N m]"]


def test_a_bench_shows_blocks_sensors_profiles_and_curves(client: httpx.Client) -> None:
    shown = text(client, "/benches/heavy")
    for said in ("valve reads current gives oil pressure", "output torque N m 6", "current [A]", "torque ratio",
                 "capacity factor [rad/s/(N m)^0.5]", "profile 5", "inertia of the input shaft 0.25 kg m²",
                 "load inertia [kg m²]", "All 216 conditions as a table"):
        assert said in shown, (said, shown)
    assert HEAVY.physics.converter is not None
    assert "kg m^2" not in client.get("/benches/heavy").text


@pytest.mark.parametrize("path", ["recordings/measured?run=2", "tables/nominal", "benches/heavy"])
def test_a_page_that_has_not_changed_is_not_sent_again(client: httpx.Client, path: str) -> None:
    first = client.get(f"/{path}")
    assert client.get(f"/{path}", headers={"If-None-Match": first.headers["ETag"]}).status_code == 304
    other = client.get(f"/{path}{'&' if '?' in path else '?'}other=1")
    assert other.status_code == 422


def test_long_lists_are_folded(client: httpx.Client, folder: Path) -> None:
    for number in range(13):
        (folder / "tables" / f"again{number}.toml").write_bytes((folder / "tables" / "heavy.toml").read_bytes())
    page = client.get("/").text.partition('<section id="benches"')[2]
    assert page.partition("<details>")[0].count('<li class="entry">') == 12
    assert "<summary>2 more</summary>" in page
    assert page.count('<li class="entry">') == 14


def test_a_job_is_called_by_what_it_is_about_or_as_its_client_calls_it(client: httpx.Client) -> None:
    client.post("/v1/studies", json={})
    client.post("/v1/studies", json={}, headers={"Idempotency-Key": "mine"})
    names = re.findall(r'<h3><a href="[^"]*">([^<]*)</a>', client.get("/").text)
    today = datetime.datetime.now(datetime.UTC)
    assert f"study of measured, {today.day} {today:%b}" in names
    assert "mine" in names
    old = datetime.datetime(2020, 2, 3, tzinfo=datetime.UTC)
    assert job_name("fit", "a", "0b6e1d9e-4f4d-4f7e-9a10-5a9cf0d2b1aa", old) == "fit of a, 3 Feb 2020"


STUDY = {"recordings": "few", "recordings_digest": "c3d4", "bench": "heavy", "bench_digest": HEAVY.digest,
         "sensing_digest": HEAVY.sensing_digest, "settings": {}}


def test_studies_have_names_and_their_laws(serving_jobs: Any, folder: Path, few_study: dict[str, Any]) -> None:
    made_up = "0b6e1d9e-4f4d-4f7e-9a10-5a9cf0d2b1aa"
    nothing = {**few_study, "result": {**few_study["result"], "findings": []}}
    with serving_jobs(folder / "tables", {made_up: (STUDY, few_study), "none": (STUDY, nothing)}) as client:
        law = client.get(f"/studies/{made_up}/law.svg")
        assert law.headers["Content-Type"] == "image/svg+xml"
        assert f"Law: {few_study['result']['findings'][0]['title']}</title>" in law.text
        again = client.get(f"/studies/{made_up}/law.svg", headers={"If-None-Match": law.headers["ETag"]})
        assert again.status_code == 304
        problem(client.get("/studies/none/law.svg"), 404)
        problem(client.get("/studies/other/law.svg"), 404)
        page = client.get("/compare", params={"kind": "study", "first": made_up, "second": "none"}).text
        gap = few_study["result"]["gap"]["closures"]["output_torque"]
        for words in ("current → pressure", "output torque", f"{units.number(gap['rms_before'], 3)} to "
                      f"{units.number(gap['rms_after'], 3)} N m"):
            assert words in page


@pytest.mark.slow
def test_pages_fit_a_narrow_screen_and_arrow_keys_flip(client: httpx.Client, browser: webdriver.Chrome,
                                                       folder: Path) -> None:
    runs_of_a_fan().save(folder / "tables" / "fan.h5")
    address = str(client.base_url).rstrip("/")
    browser.get_log("browser")
    size = {"height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 390, **size})
    try:
        for path in ("", "recordings/measured?run=3", "recordings/fan", "tables/nominal", "benches/heavy"):
            browser.get(f"{address}/{path}")
            assert browser.execute_script("return document.documentElement.scrollWidth") <= 390, path
            tops = [figure.rect["x"] for figure in browser.find_elements(By.CSS_SELECTOR, ".panel")]
            assert len(set(tops)) <= 1, path
        browser.get(f"{address}/recordings/measured?run=3")
        browser.find_element(By.TAG_NAME, "body").send_keys(Keys.ARROW_RIGHT)
        WebDriverWait(browser, 10).until(lambda _: "run=4" in browser.current_url)
        assert browser.find_element(By.ID, "run-title").text == "Engagement 4"
        assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
