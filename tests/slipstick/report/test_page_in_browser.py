"""The reports in a browser, from disk: every picture is drawn, without any network request."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

from slipstick.pictures import CAPTIONS, study
from slipstick.report import page
from slipstick.report.study.page import study_page
from slipstick.study import StudyResult, StudySettings
from slipstick.study.figures import Figures

FIT = {"id": "first-fit", "table": "nominal", "table_digest": "a1b2", "recordings": "<b>mine</b>",
       "recordings_digest": "c3d4", "simulate": False, "outside": "clip",
       "settings": {"seed": 7}, "submitted": None, "ended": None}
STUDY = {"id": "first-study", "recordings": "<b>mine</b>", "recordings_digest": "c3d4",
         "settings": asdict(StudySettings()), "submitted": None, "ended": None}
HOSTILE = ("</script><script>window.taken = true</script>", "<img src=x onerror=\"window.taken = true\">")
Shows = Callable[[str, int, int], None]
SEVEN = tuple(f"input_{number}" for number in range(7))


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


@pytest.mark.parametrize(("axes", "n"), [(HOSTILE, 216), (("pressure_bias",), 20), (SEVEN, 20)],
                         ids=["hostile", "one", "seven"])
def test_every_picture_of_a_fit_is_drawn_without_a_network(
        shows: Shows, made: Callable[..., dict[str, Any]], axes: tuple[str, ...], n: int) -> None:
    shows(page(FIT, made(axes, n)), len(CAPTIONS), 200)


@pytest.mark.parametrize(("name", "hostile", "omitted"), [
    ("friction", False, 0), ("friction", True, 0), ("nothing", False, 3)])
def test_every_picture_of_a_study_is_drawn_without_a_network(
        shows: Shows, studied: Callable[[str], tuple[StudyResult, Figures]],
        both_fits: dict[str, dict[str, Any]], name: str, hostile: bool, omitted: int) -> None:
    result, figures = studied(name)
    if hostile:
        named = dict.fromkeys(("title", "quantity", "depends_on"), HOSTILE[1])
        result = replace(result, sentence=HOSTILE[0], findings=[replace(one, **named) for one in result.findings])
    output = {"result": asdict(result), "figure_data": asdict(figures), "seconds": {}, "processor_seconds": {}}
    shows(study_page(STUDY, output, None if name == "nothing" else both_fits), len(study.CAPTIONS) - omitted, 140)
