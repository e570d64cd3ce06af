"""The extended model of a study: tables of both models are built by the worker, and the same fit is run on both."""

import json
import time
from pathlib import Path
from typing import Any

import httpx
import pytest

from worker.__main__ import main

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
    assert "surfaces" not in json.dumps(client.get(study["pictures"]).json())


def await_result(client: httpx.Client, address: str) -> dict[str, Any]:
    while (job := client.get(address).json())["status"] in ("queued", "running"):
        time.sleep(0.1)
    assert job["status"] == "done", job
    result: dict[str, Any] = client.get(job["links"]["result"]).json()
    return result
