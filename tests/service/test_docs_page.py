"""The page /docs in a browser without internet access: it renders, and "Try it out" works."""

from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.wait import WebDriverWait


@pytest.mark.slow
def test_the_page_works_without_internet_access(browser: webdriver.Chrome, requested: Callable[[], list[str]],
                                                address: str, tmp_path: Path) -> None:
    browser.get(f"{address}/docs")
    wait = WebDriverWait(browser, 20)
    blocks = wait.until(lambda _: browser.find_elements(By.CSS_SELECTOR, ".opblock"))
    assert len(blocks) >= 14
    for operation in ("evaluate", "propagate", "likelihood", "upload_recordings", "submit_fit", "follow_fit"):
        block = browser.find_element(By.CSS_SELECTOR, f".opblock[id$='-{operation}']")
        assert _try(browser, block) in ("200", "201", "202"), f"{operation}: {block.text}"
    browser.save_screenshot(tmp_path / "docs.png")
    hosts = {urlsplit(url).netloc for url in requested()}
    assert hosts == {urlsplit(address).netloc}
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def _try(browser: webdriver.Chrome, block: WebElement) -> str:
    """Execute an operation with "Try it out", and return the status that the page displays."""
    wait = WebDriverWait(block, 20)
    block.find_element(By.CSS_SELECTOR, ".opblock-summary-control").click()
    for button in (".try-out__btn", ".execute"):
        element = wait.until(lambda block, button=button: block.find_element(By.CSS_SELECTOR, button))
        browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()
    status = wait.until(lambda block: block.find_element(
        By.CSS_SELECTOR, ".live-responses-table tbody .response-col_status"))
    return status.text.split()[0]
