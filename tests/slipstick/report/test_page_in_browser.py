"""The reports in a browser, from disk: every picture is drawn without scripts or network, in the dark and on paper."""

import base64
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

from slipstick.law_files import write_law
from slipstick.pictures import CAPTIONS, theme
from slipstick.report import page
from slipstick.report.propagation import propagation_page
from slipstick.report.study.page import study_page
from slipstick.studies import StudyResult, StudySettings
from slipstick.studies.export import law_table
from slipstick.studies.figures import Figures

FIT = {"id": "first-fit", "table": "nominal", "table_digest": "a1b2", "recordings": "<b>mine</b>",
       "recordings_digest": "c3d4", "simulate": False, "outside": "clip",
       "settings": {"seed": 7}, "submitted": None, "ended": None}
STUDY = {"id": "first-study", "recordings": "<b>mine</b>", "recordings_digest": "c3d4",
         "settings": asdict(StudySettings()), "submitted": None, "ended": None}
HOSTILE = ("</script><script>window.taken = true</script>", "<img src=x onerror=\"window.taken = true\">")
Shows = Callable[[str, int, int], None]
SEVEN = *HOSTILE, *(f"input_{number}" for number in range(5))


@pytest.fixture
def shows(browser: webdriver.Chrome, requested: Callable[[], list[str]],
          tmp_path: Path) -> Shows:
    """Opens a page and checks the number of pictures, their minimal height in px, and that nothing is requested."""
    def show(html: str, pictures: int, height: int) -> None:
        requested()
        browser.get_log("browser")
        path = tmp_path / "report.html"
        path.write_text(html)
        browser.get(path.as_uri())
        drawn = WebDriverWait(browser, 20).until(
            lambda browser: len(svgs := browser.find_elements(By.CSS_SELECTOR, ".picture svg")) == pictures
            and svgs)
        for picture in drawn:
            assert picture.size["width"] <= 850
            assert picture.size["height"] > height
            assert len(picture.find_elements(By.TAG_NAME, "path")) > 10
        assert not browser.execute_script("return window.taken")
        assert browser.find_elements(By.TAG_NAME, "img") == []
        assert requested() == []
        assert browser.get_log("browser") == []
        browser.set_window_size(900, 1600)
        assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
        browser.set_window_size(1200, 1600)

    return show


@pytest.mark.parametrize("axes", [("pressure_bias",), SEVEN], ids=["one", "seven"])
def test_every_picture_of_a_fit_is_drawn_without_a_network(
        shows: Shows, made: Callable[..., dict[str, Any]], axes: tuple[str, ...]) -> None:
    shows(page(FIT, made(axes, 20)), len(CAPTIONS), 150)


@pytest.mark.parametrize(("name", "drawn"), [("friction", 7), ("nothing", 3), ("times", 1)])
def test_every_picture_of_a_study_is_drawn_without_a_network(
        shows: Shows, studied: Callable[[str], tuple[StudyResult, Figures]],
        both_fits: dict[str, dict[str, Any]], name: str, drawn: int) -> None:
    result, figures = studied(name)
    named = dict.fromkeys(("title", "quantity", "depends_on"), HOSTILE[1])
    result = replace(result, sentence=HOSTILE[0], findings=[replace(one, **named) for one in result.findings])
    output = {"result": asdict(result), "figure_data": asdict(figures), "seconds": {}, "processor_seconds": {}}
    shows(study_page(STUDY, output, both_fits if name == "friction" else None), drawn, 140)


def test_contents_lead_to_sections_and_files_are_saved_without_a_network(
        browser: webdriver.Chrome, studied: Callable[[str], tuple[StudyResult, Figures]], tmp_path: Path) -> None:
    result, figures = studied("friction")
    output = {"result": asdict(result), "figure_data": asdict(figures), "seconds": {}, "processor_seconds": {}}
    path = tmp_path / "report.html"
    path.write_text(study_page(STUDY, output))
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    browser.get(path.as_uri())
    link = browser.find_element(By.CSS_SELECTOR, ".contents a[href='#limitations']")
    link.click()
    assert browser.execute_script("return document.querySelector('#limitations').getBoundingClientRect().top < 900")
    browser.find_element(By.LINK_TEXT, "CSV").click()
    law = tmp_path / "friction_coefficient_over_slip.csv"
    WebDriverWait(browser, 20).until(lambda _: law.exists() and law.stat().st_size)
    assert law.read_bytes() == write_law(law_table(result.findings[0]), ".csv")


@pytest.fixture
def opened(browser: webdriver.Chrome, made: Callable[..., dict[str, Any]],
           tmp_path: Path) -> Iterator[Callable[..., webdriver.Chrome]]:
    """Opens the page of a fit with a width in px and properties of the media, such as a dark colour scheme."""
    def show(width: int = 1200, **media: Any) -> webdriver.Chrome:
        path = tmp_path / "report.html"
        path.write_text(page(FIT, made(n=20)))
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500})
        browser.get(path.as_uri())
        return browser

    yield show
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {})
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


DARK = [{"name": "prefers-color-scheme", "value": "dark"}]
FILL = "return getComputedStyle(document.querySelector('.picture text')).fill"


def rgb(colour: str) -> str:
    return f"rgb({', '.join(str(int(colour[place:place + 2], 16)) for place in (1, 3, 5))})"


def test_a_page_is_readable_at_320_px(opened: Callable[..., webdriver.Chrome]) -> None:
    browser = opened(320)
    assert browser.execute_script("return document.documentElement.scrollWidth") == 320
    sizes = browser.execute_script(
        "return [...document.querySelectorAll('.picture text')].map(one => one.getBoundingClientRect())"
        ".map(box => Math.min(box.width, box.height)).filter(size => size > 0)")
    letters = browser.execute_script(
        "return [...document.querySelectorAll('.picture svg')].map(one => one.getBoundingClientRect().width / "
        "one.viewBox.baseVal.width)")
    assert len(sizes) > 100
    assert min(letters) == pytest.approx(1.0, abs=0.02)  # not shrunk: they scroll within the page
    assert browser.execute_script("return [...document.querySelectorAll('.picture')].every(one => one.tabIndex === 0)")


def test_the_dark_scheme_changes_page_and_pictures(opened: Callable[..., webdriver.Chrome]) -> None:
    light = opened().execute_script(FILL)
    assert light in {rgb(colour) for colour in (theme.INK, theme.MEASURED, theme.FAINT)}
    browser = opened(features=DARK)
    assert browser.execute_script(FILL) in {rgb(theme.DARK[colour]) for colour in (
        theme.INK, theme.MEASURED, theme.FAINT)}
    assert browser.execute_script("return getComputedStyle(document.body).backgroundColor") == rgb(theme.DARK["white"])


def test_paper_is_light_and_a_figure_is_never_cut(opened: Callable[..., webdriver.Chrome]) -> None:
    browser = opened(680, media="print", features=DARK)  # 680 px: A4 without margins
    assert browser.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.execute_script(FILL) in {rgb(colour) for colour in (theme.INK, theme.MEASURED, theme.FAINT)}
    heights = browser.execute_script(
        "return [...document.querySelectorAll('figure')].map(one => one.getBoundingClientRect().height)")
    assert max(heights) < 994  # 263 mm of a page
    assert browser.execute_script("return getComputedStyle(document.querySelector('figure')).breakInside") == "avoid"
    document = browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"]
    pdf = base64.b64decode(document)
    assert pdf.startswith(b"%PDF")
    boxes = {tuple(round(float(end)) for end in box.split()) for box in re.findall(rb"/MediaBox \[([^]]+)\]", pdf)}
    assert boxes == {(0, 0, 595, 842)}  # A4 in points


def test_on_paper_a_picture_in_parts_is_cut_between_them_and_begins_on_the_first_page(
        browser: webdriver.Chrome, opened: Callable[..., webdriver.Chrome], tmp_path: Path) -> None:
    opened(680, media="print")
    row = {"mean": 0.6, "std": 0.02, "error": 2e-4, "quantiles": [0.567, 0.633], "first_order": [0.7], "total": [0.8],
           "density": None, "density_time": None}
    answer = {"table": "mine", "table_digest": "a1b2", "axes": [{"name": "pressure_bias"}], "outside": "clip",
              "mass_outside": 0.2, "order": 4, "nodes": 25, "reached": True,
              "conditions": [{"condition": place, **row} for place in range(12)]}
    request = {"inputs": {"mean": [1.0], "std": [0.3], "families": None}, "output_std": 0.0, "quantiles": [0.05, 0.95],
               "tolerance": 0.001}
    (tmp_path / "propagation.html").write_text(propagation_page(answer, request, {"load_inertia": [6.0] * 12}))
    browser.get((tmp_path / "propagation.html").as_uri())
    assert browser.execute_script("return getComputedStyle(document.querySelector('figure')).breakInside") == "auto"
    ends = browser.execute_script(
        "return [...document.querySelectorAll('figure svg')].map(part => part.getBoundingClientRect().bottom)")
    assert len(ends) == 3
    assert ends[0] < 994  # 263 mm of a page
