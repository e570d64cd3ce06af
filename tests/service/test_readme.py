"""The README's curl examples, executed in order and as written against a real service and worker."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

README = (Path(__file__).parents[2] / "README.md").read_text()
BLOCKS = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
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
    assert "Failed to connect" in README
