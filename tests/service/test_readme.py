"""The README's curl examples, executed as written against a real service and worker."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

README = (Path(__file__).parents[2] / "README.md").read_text()
BLOCKS = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
CURL = [block for block in BLOCKS if "curl" in block]


def test_there_are_examples_of_every_resource() -> None:
    text = "".join(CURL)
    for resource in ("tables", "recordings", "evaluate", "propagate", "likelihood", "fits", "studies"):
        assert f"/v1/{resource}" in text


@pytest.fixture(scope="module", autouse=True)
def _no_job_is_left(address: str) -> Iterator[None]:
    yield
    for job in ("fits/my-first-fit", "studies/my-first-study"):
        httpx.post(f"{address}/v1/{job}/cancel")  # or the worker is busy with it while later tests run


@pytest.mark.usefixtures("worker")
@pytest.mark.parametrize("block", CURL, ids=lambda block: block.split("/v1/")[-1].split()[0])
def test_example_works_as_written(block: str, address: str, tmp_path: Path) -> None:
    block = block.replace("python -c", f"{sys.executable} -c")
    for line in block.strip().splitlines():
        done = subprocess.run(["bash", "-c", line], env={"PATH": "/usr/bin:/bin", "SLIPSTICK": address}, cwd=tmp_path,
                              capture_output=True, text=True, check="--fail" not in line)
        assert done.returncode in (0, 22)  # refused: there is no report yet of what has only just begun
        if not line.startswith("curl") or "--output" in line:
            continue
        answer = json.loads(done.stdout)
        if "--data '" in line:
            assert answer["status"] == 415
            assert "--json" in answer["remedy"]
        elif line.endswith("/result"):
            assert answer.get("status", 409) == 409  # it has only just begun
        else:
            assert "detail" not in answer, answer
    if "times.npy" in block:
        assert (tmp_path / "times.npy").read_bytes().startswith(b"\x93NUMPY")
