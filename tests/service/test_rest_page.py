"""The curl examples of docs/rest.md as written, and the extended model of a study, on a real service and worker."""

import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import httpx
import pytest

from worker.__main__ import main

PAGE = (Path(__file__).parents[2] / "docs" / "rest.md").read_text()
SECTION = PAGE[PAGE.index("## Try it"):PAGE.index("## Operations")]
BLOCKS = re.findall(r"```sh\n(.*?)```", SECTION, re.DOTALL)
LINES = [line for block in BLOCKS if "curl" in block for line in block.strip().splitlines()]


def test_there_are_examples_of_every_resource() -> None:
    text = "".join(LINES)
    for resource in ("tables", "recordings", "evaluate", "propagate", "likelihood", "fits", "studies"):
        assert f"/v1/{resource}" in text


def test_examples_need_no_recent_curl() -> None:
    assert not re.search(r"--json|--fail-with-body", "".join(LINES))  # curl 7.82 and 7.76


@pytest.mark.slow
def test_examples_work_as_written(quick_service: tuple[Path, httpx.Client], tmp_path: Path) -> None:
    tables, client = quick_service
    shutil.copy(tables / "measured.h5", tables / "sample.h5")
    shutil.copy(tables / "nominal.h5", tables / "calibrated.h5")  # the demo builds it; here its content does not matter
    for line in LINES:
        command = line.replace("http://127.0.0.1:8000", str(client.base_url).rstrip("/"))
        if command.startswith("export"):
            address = command.partition("=")[2]
            continue
        command = command.replace("python -c", f"{sys.executable} -c")
        done = subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=tmp_path, capture_output=True, text=True,
                              env={"PATH": "/usr/bin:/bin", "SLIPSTICK": address}, timeout=330, check=False)
        assert not done.stderr, (line, done.stderr)
        assert done.returncode == 0, line
        if "-o " in line or not line.startswith("curl"):
            continue
        answer = json.loads(done.stdout)
        if "-d" in line and "-H" not in line:  # the example of a wrong request
            assert answer["status"] == 415
            assert answer["remedy"]
        else:
            assert "detail" not in answer, (line, answer)
    assert client.get("/v1/fits/my-first-fit").json()["status"] == "done"
    assert client.get("/v1/studies/my-first-study").json()["status"] == "done"
    assert (tmp_path / "times.npy").read_bytes().startswith(b"\x93NUMPY")
    assert (tmp_path / "profiles.png").read_bytes().startswith(b"\x89PNG")
    for page in ("report.html", "study.html"):
        assert "<html" in (tmp_path / page).read_text()
    assert (tmp_path / "law.csv").read_text().startswith("slip [rad/s],friction_coefficient_relative_change [1]")
    assert "parameters" in json.loads((tmp_path / "extended.json").read_text())


def test_curl_says_when_the_service_is_down(tmp_path: Path) -> None:
    health = next(line for line in LINES if "/v1/health" in line)
    done = subprocess.run(["bash", "-c", health], env={"PATH": "/usr/bin:/bin", "SLIPSTICK": "http://127.0.0.1:9"},
                          cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 7
    assert "Failed to connect" in done.stderr
    assert "Failed to connect" in SECTION


# The extended model of a study: tables of both models are built by the worker, and the same fit is run on both.


QUICK = {"population": 8, "generations": 2, "intervals": False}


@pytest.mark.slow
def test_the_extended_model_is_built_fitted_and_reported(
        quick_service: tuple[Path, httpx.Client], tmp_path: Path) -> None:
    tables, client = quick_service
    content = client.get("/openapi.json").json()["paths"]["/v1/studies"]["post"]["requestBody"]["content"]
    # With the key of test_openapi.py: if that test has run, the study is finished already.
    study = client.post("/v1/studies", json=content["application/json"]["schema"]["examples"][0],
                        headers={"Idempotency-Key": "first-study"}).json()["links"]
    await_result(client, study["self"])
    fits, results = {}, {}
    for which in ("before", "after"):
        (tmp_path / "model.json").write_text(client.get(study["model"], params={"which": which}).text)
        out = tables / f"study-{which}.h5"
        build = ["build", "--model", str(tmp_path / "model.json"), "--out", str(out)]
        assert main([*build, "--axis", "pressure_bias=0.7:1.3:5", "--axis", "initial_position=0.7:1.3:5"]) == 0
        fit = client.post("/v1/fits", json={"table": out.stem, "settings": QUICK}).json()
        fits[which], results[which] = fit["id"], await_result(client, fit["links"]["self"])["result"]
    report = client.get(study["report"], params=fits)
    assert report.status_code == 200, report.text
    assert results["after"]["log10_likelihood"] > results["before"]["log10_likelihood"] + 1
    for which, id in fits.items():
        assert f"fit {id}, table study-{which}" in report.text
        assert f"{results[which]['log10_likelihood']:.2f}".replace("-", "−") in report.text
    listed = client.get(study["pictures"], params=fits).json()["pictures"]
    spec = client.get(listed[-1]["href"]).json()
    assert (listed[-1]["name"], spec["title"]["text"]) == ("surfaces", listed[-1]["title"])
    # Without names, the newest fits of both models are compared.
    assert client.get(study["report"]).text == report.text
    assert client.get(study["pictures"]).json()["pictures"] == listed


def await_result(client: httpx.Client, address: str) -> dict[str, Any]:
    while (job := client.get(address).json())["status"] in ("queued", "running"):
        time.sleep(0.1)
    assert job["status"] == "done", job
    result: dict[str, Any] = client.get(job["links"]["result"]).json()
    return result
