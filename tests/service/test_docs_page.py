"""The page /docs in a real browser that cannot reach the internet: it renders, and "Try it out" works."""

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.wait import WebDriverWait

SWITCHES = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            "--window-size=1200,1600", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[webdriver.Chrome]:
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and driver):
        said = "Chromium is missing: apt-get update && apt-get install -y chromium chromium-driver"
        pytest.fail(said) if os.environ.get("CI") == "true" else pytest.skip(said)
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for switch in (*SWITCHES, f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(switch)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    browser = webdriver.Chrome(options, webdriver.ChromeService(driver))
    yield browser
    browser.quit()


def test_the_page_works_without_the_internet(browser: webdriver.Chrome, address: str, worker: None,
                                             tmp_path: Path) -> None:
    browser.get(f"{address}/docs")
    wait = WebDriverWait(browser, 20)
    blocks = wait.until(lambda _: browser.find_elements(By.CSS_SELECTOR, ".opblock"))
    assert len(blocks) >= 14
    for operation in ("evaluate", "propagate", "likelihood", "upload_recordings", "submit_fit", "follow_fit"):
        block = browser.find_element(By.CSS_SELECTOR, f".opblock[id$='-{operation}']")
        assert _try(browser, block) in ("200", "201", "202"), f"{operation}: {block.text}"
    browser.save_screenshot(tmp_path / "docs.png")
    hosts = {urlsplit(url).netloc for url in _requested(browser)}
    assert hosts == {urlsplit(address).netloc}
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def _try(browser: webdriver.Chrome, block: WebElement) -> str:
    """Press what a reader would press, and return the status that the page then shows."""
    wait = WebDriverWait(block, 20)
    block.find_element(By.CSS_SELECTOR, ".opblock-summary-control").click()
    for button in (".try-out__btn", ".execute"):
        element = wait.until(lambda block, button=button: block.find_element(By.CSS_SELECTOR, button))
        browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()
    status = wait.until(lambda block: block.find_element(
        By.CSS_SELECTOR, ".live-responses-table tbody .response-col_status"))
    return status.text.split()[0]


def _requested(browser: webdriver.Chrome) -> list[str]:
    messages = (json.loads(entry["message"])["message"] for entry in browser.get_log("performance"))
    urls = [message["params"]["request"]["url"] for message in messages
            if message["method"] == "Network.requestWillBeSent"]
    return [url for url in urls if url.startswith(("http:", "https:", "ws:", "wss:"))]
