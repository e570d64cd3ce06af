"""UM-Bridge 1.0 over the wire: the checks of its conformance suite, its own client, and a sampler of others."""

import asyncio
import logging
import re
from pathlib import Path
from typing import Any

import emcee
import httpx
import jsonschema
import numpy as np
import pytest
import umbridge

from service.app import create_app
from service.settings import Settings
from service.umbridge.models import LOWEST
from slipstick.inference.problems import table_problem
from slipstick.storage.library import Library
from slipstick.table import Table
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood import Candidate, exact

TABLE, LIKELIHOOD = "nominal", "nominal/measured"
POINTS = {TABLE: [1.02, 0.97], LIKELIHOOD: [1.02, 0.97, 0.06, 0.09, 0.02]}
NUMBERS = {"type": "array", "items": {"type": "number"}, "minItems": 1}
SIZES = {"type": "array", "items": {"type": "integer"}, "minItems": 1}
FLAGS = {name: {"type": "boolean"} for name in ("Evaluate", "Gradient", "ApplyJacobian", "ApplyHessian")}


def only(name: str, schema: dict[str, Any]) -> dict[str, Any]:
    """The schema of an object with one member and no other."""
    return {"type": "object", "properties": {name: schema}, "required": [name], "additionalProperties": False}


ERROR = only("error", {"type": "object", "properties": {"type": {"type": "string"}, "message": {"type": "string"}},
                       "required": ["type", "message"], "additionalProperties": False})


@pytest.fixture(autouse=True)
def _quiet() -> None:
    logging.getLogger("urllib3").setLevel(logging.WARNING)  # the client opens a connection for every request


@pytest.fixture(scope="module")
def bridge(client: httpx.Client) -> httpx.Client:
    return httpx.Client(base_url=f"{client.base_url}/umbridge", timeout=30)


@pytest.fixture(scope="module")
def url(address: str) -> str:
    return f"{address}/umbridge"


def refused(response: httpx.Response, kind: str, status: int = 400) -> str:
    """The message of an error in the form of the protocol."""
    assert response.status_code == status, response.text
    jsonschema.validate(response.json(), ERROR)
    assert response.json()["error"]["type"] == kind
    message: str = response.json()["error"]["message"]
    return message


def sizes(bridge: httpx.Client, name: str) -> tuple[int, int]:
    answers = [bridge.post(f"/{operation}", json={"name": name}).json() for operation in ("InputSizes", "OutputSizes")]
    return answers[0]["inputSizes"][0], answers[1]["outputSizes"][0]


def requests(bridge: httpx.Client, name: str) -> dict[str, dict[str, Any]]:
    """A valid request of each operation that takes a point."""
    inputs, outputs = sizes(bridge, name)
    body = {"name": name, "input": [POINTS[name]], "config": {}}
    sens, vec = {"sens": [0.0] * outputs}, {"vec": [0.0] * inputs}
    return {"Evaluate": body, "Gradient": {**body, "outWrt": 0, "inWrt": 0, **sens},
            "ApplyJacobian": {**body, "outWrt": 0, "inWrt": 0, **vec},
            "ApplyHessian": {**body, "outWrt": 0, "inWrt1": 0, "inWrt2": 0, **sens, **vec}}


def test_the_models_are_listed_and_described(bridge: httpx.Client) -> None:
    info = bridge.get("/Info")
    assert info.status_code == 200
    assert info.json()["protocolVersion"] == 1.0
    assert set(info.json()) == {"protocolVersion", "models"}
    assert info.json()["models"][0] == TABLE  # tables come first
    assert LIKELIHOOD in info.json()["models"]  # other tests upload further recordings
    for name in (TABLE, LIKELIHOOD):
        described = bridge.post("/ModelInfo", json={"name": name})
        flags = {"type": "object", "properties": FLAGS, "additionalProperties": False}
        jsonschema.validate(described.json(), only("support", flags))
        for operation, member in (("InputSizes", "inputSizes"), ("OutputSizes", "outputSizes")):
            jsonschema.validate(bridge.post(f"/{operation}", json={"name": name}).json(), only(member, SIZES))
    assert sizes(bridge, TABLE) == (2, 216)
    assert sizes(bridge, LIKELIHOOD) == (5, 1)


@pytest.mark.parametrize("name", [TABLE, LIKELIHOOD])
def test_operations_answer_with_vectors_of_the_right_size(bridge: httpx.Client, name: str) -> None:
    inputs, outputs = sizes(bridge, name)
    expected = {"Evaluate": outputs, "Gradient": inputs, "ApplyJacobian": outputs, "ApplyHessian": inputs}
    for operation, body in requests(bridge, name).items():
        text = str(body).replace("'", '"')
        answer = bridge.post(f"/{operation}", content=text)  # without Content-Type, as the suite sends it
        assert answer.status_code == 200, answer.text
        vector = {"type": "array", "items": NUMBERS, "minItems": 1} if operation == "Evaluate" else NUMBERS
        jsonschema.validate(answer.json(), only("output", vector))
        numbers = answer.json()["output"]
        assert len(numbers[0] if operation == "Evaluate" else numbers) == expected[operation]


@pytest.mark.parametrize("name", [TABLE, LIKELIHOOD])
def test_invalid_requests_are_errors_of_the_protocol(bridge: httpx.Client, name: str) -> None:
    for operation, body in requests(bridge, name).items():
        refused(bridge.post(f"/{operation}", json={"name": "wrong"}), "ModelNotFound")
        changes: list[dict[str, Any]] = [{"input": [[*POINTS[name], 1.0]]}, {"input": [POINTS[name]] * 2},
                                         {"input": []}, {"input": None}, {"input": [["1.0", True]]},
                                         {"config": {"conditons": [0]}}, {"config": [1]}]
        changes += [{index: 1} for index in body if index.startswith(("inWrt", "outWrt"))]
        changes += [{vector: [*body[vector], 0.0]} for vector in ("sens", "vec") if vector in body]
        for change in changes:
            refused(bridge.post(f"/{operation}", json={**body, **change}), "InvalidInput")
        for missing in set(body) - {"config", "name"}:
            short = {key: value for key, value in body.items() if key != missing}
            assert missing in refused(bridge.post(f"/{operation}", json=short), "InvalidInput")
    for operation in ("ModelInfo", "InputSizes", "OutputSizes"):
        message = refused(bridge.post(f"/{operation}", json={"name": "nominl"}), "ModelNotFound")
        assert "Did you mean 'nominal'?" in message
    refused(bridge.post("/ModelInfo", content="{"), "InvalidInput")
    assert refused(bridge.post("/ModelInfo", json={"name": 5}), "InvalidInput") == (
        "The request has 1 invalid field. Correct name: Input should be a valid string.")
    assert refused(bridge.post("/ModelInfo", json=[]), "InvalidInput") == (
        "The request has 1 invalid field. Correct body: Input should be a JSON object.")
    assert "gzip" in bridge.headers["accept-encoding"]
    assert len(refused(bridge.post("/Evaluate", json={"name": TABLE, "input": [["a"] * 60]}), "InvalidInput")) > 900
    refused(bridge.get("/Evaluate"), "MethodNotAllowed", 405)
    refused(bridge.get("/Elsewhere"), "NotFound", 404)
    refused(bridge.post("/Evaluate", content=b" " * (3 << 20)), "TooLarge", 413)
    refused(bridge.get("/Info", headers={"Host": "elsewhere.example"}), "WrongHost", 421)


def test_only_this_machine_is_answered(settings: Settings) -> None:
    async def statuses(path: str) -> list[int]:
        application, found = create_app(settings), []
        for host in ("127.0.0.1", "::1", "::ffff:127.0.0.1", "192.0.2.7", "::ffff:192.0.2.7", "2001:db8::7"):
            transport = httpx.ASGITransport(application, client=(host, 4321))
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as remote:
                found.append((await remote.get(path)).status_code)
        return found

    assert asyncio.run(statuses("/umbridge/Info")) == [200] * 3 + [403] * 3
    assert asyncio.run(statuses("/v1/tables")) == [200] * 6


def test_the_umbridge_client_evaluates_and_differentiates_a_table(url: str, table: Table) -> None:
    model, point = umbridge.HTTPModel(url, TABLE), np.array(POINTS[TABLE])
    sens, vec = np.random.default_rng(1).normal(size=216), np.array([0.3, -0.7])
    found = table.derivatives(point)
    assert model([point.tolist()]) == [table.interpolate(point[None])[0].tolist()]
    np.testing.assert_allclose(model.gradient(0, 0, [point.tolist()], sens.tolist()), sens @ found.jacobian)
    np.testing.assert_allclose(model.apply_jacobian(0, 0, [point.tolist()], vec.tolist()), found.jacobian @ vec)
    np.testing.assert_allclose(model.apply_hessian(0, 0, 0, [point.tolist()], sens.tolist(), vec.tolist()),
                               np.einsum("i,ijk,k", sens, found.hessian, vec))
    some = {"conditions": [100, 3]}
    assert model.get_output_sizes(some) == [2]
    assert model([point.tolist()], some) == [table.interpolate(point[None])[0, [100, 3]].tolist()]
    beyond = [[2.0, 1.0]]
    assert model(beyond, {"outside": "clip"}) == model([[1.5, 1.0]])
    for refused in ({}, {"outside": "error"}):
        with pytest.raises(Exception, match=r"InvalidInput.*pressure_bias = 2, outside the range of the table"):
            model(beyond, refused)
    with pytest.raises(Exception, match=r"InvalidInput.*outside the range of the table"):
        model.gradient(0, 0, beyond, [1.0] * 216)
    with pytest.raises(Exception, match=r"InvalidOutput.*216 of 216 outputs are undefined"):
        model(beyond, {"outside": "nan"})


def test_the_umbridge_client_evaluates_and_differentiates_a_likelihood(url: str, library: Library,
                                                                       table: Table) -> None:
    model, point = umbridge.HTTPModel(url, LIKELIHOOD), np.array(POINTS[LIKELIHOOD])
    problem = table_problem(table, library.recording("measured"), "clip")
    expected = exact(problem, Candidate(Inputs(point[:2], point[2:4]), point[4])).sum()
    assert model([point.tolist()]) == [[expected]]
    natural = model([point.tolist()], {"logarithm": "ln"})[0][0]
    assert natural == pytest.approx(expected * np.log(10), rel=1e-14)
    gradient = np.array(model.gradient(0, 0, [point.tolist()], [1.0]))
    step, vec = 1e-5, np.array([0.1, -0.2, 0.03, 0.01, 0.002])
    (ahead,), (behind,) = (model([(point + side * step * vec).tolist()])[0] for side in (1, -1))
    assert gradient @ vec == pytest.approx((ahead - behind) / (2 * step), rel=1e-5)
    assert model.apply_jacobian(0, 0, [point.tolist()], vec.tolist()) == [pytest.approx(gradient @ vec)]
    ahead, behind = (np.array(model.gradient(0, 0, [(point + side * step * vec).tolist()], [1.0])) for side in (1, -1))
    np.testing.assert_allclose(model.apply_hessian(0, 0, 0, [point.tolist()], [1.0], vec.tolist()),
                               (ahead - behind) / (2 * step), rtol=1e-3)
    impossible = [*POINTS[LIKELIHOOD][:4], -0.1]
    assert model([impossible]) == [[LOWEST]]
    with pytest.raises(Exception, match=r"InvalidInput.*no derivatives"):
        model.gradient(0, 0, [impossible], [1.0])


def test_the_example_of_the_page_works(url: str) -> None:
    text = (Path(__file__).parents[2] / "docs" / "umbridge.md").read_text()
    code, = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    found: dict[str, Any] = {}
    exec(code.replace("http://127.0.0.1:8000/umbridge", url), found)
    assert found["times"].get_input_sizes() == [2]
    assert found["likelihood"].get_input_sizes() == [5]


def test_emcee_samples_the_likelihood_of_the_service(url: str, library: Library, table: Table) -> None:
    model = umbridge.HTTPModel(url, LIKELIHOOD)
    problem = table_problem(table, library.recording("measured"), "clip")

    def log_density(vector: np.ndarray) -> float:
        if not np.all((vector[:2] > 0.5) & (vector[:2] < 1.5)):  # the prior: means inside the table
            return -np.inf
        return float(model([vector.tolist()], {"logarithm": "ln"})[0][0])

    scatter = np.random.default_rng(1).normal(size=(10, 5))
    sampler = emcee.EnsembleSampler(10, 5, log_density)
    sampler.random_state = np.random.RandomState(1).get_state()
    sampler.run_mcmc(np.array([0.8, 1.2, 0.1, 0.1, 0.1]) * (1 + 0.05 * scatter), 8)
    chain, densities = sampler.get_chain(), sampler.get_log_prob()
    assert np.median(densities[-1]) > np.median(densities[0]) + 10
    assert (chain[..., 2:] > 0).all()
    for walker in range(3):
        point = chain[-1, walker]
        expected = exact(problem, Candidate(Inputs(point[:2], point[2:4]), point[4])).sum()
        assert densities[-1, walker] == pytest.approx(np.log(10) * expected, rel=1e-12)
