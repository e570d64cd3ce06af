"""The report in a real browser, from disk, with no network: every picture is drawn and nothing is asked for."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

from slipstick.pictures import CAPTIONS
from slipstick.report import page

FIT = {"id": "first-fit", "table": "nominal", "table_digest": "a1b2", "recordings": "<b>mine</b>",
       "recordings_digest": "c3d4", "simulate": False, "outside": "clip",
       "settings": {"seed": 7}, "submitted": None, "ended": None}
HOSTILE = ("</script><script>window.taken = true</script>", "<img src=x onerror=\"window.taken = true\">")
SEVEN = tuple(f"input_{number}" for number in range(7))


@pytest.mark.parametrize(("axes", "n"), [(HOSTILE, 216), (("pressure_bias",), 20), (SEVEN, 20)],
                         ids=["hostile", "one", "seven"])
def test_every_picture_is_drawn_without_a_network(
        browser: webdriver.Chrome, requested: Callable[[], list[str]], made: Callable[..., dict[str, Any]],
        tmp_path: Path, axes: tuple[str, ...], n: int) -> None:
    requested()
    browser.get_log("browser")
    place = tmp_path / "report.html"
    place.write_text(page(FIT, made(axes, n)))
    browser.get(place.as_uri())
    drawn = WebDriverWait(browser, 20).until(
        lambda browser: len(found := browser.find_elements(By.CSS_SELECTOR, ".picture svg.marks")) == len(CAPTIONS)
        and found)
    for picture in drawn:
        assert picture.size["width"] <= 850
        assert picture.size["height"] > 200
        assert len(picture.find_elements(By.TAG_NAME, "path")) > 10
    assert not browser.execute_script("return window.taken")
    assert browser.find_elements(By.TAG_NAME, "img") == []
    assert requested() == []
    assert browser.get_log("browser") == []
    browser.set_window_size(900, 1600)
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    browser.set_window_size(1200, 1600)
