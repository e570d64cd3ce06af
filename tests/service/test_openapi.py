"""The OpenAPI document is complete, its examples work, and the answers are what it says they are."""

import time
from pathlib import Path
from typing import Any

import httpx
import jsonschema
import pytest

from service.problem_details import MEDIA_TYPE

METHODS = ("get", "post", "put", "patch", "delete")


@pytest.fixture(scope="module")
def client(brief: tuple[Path, httpx.Client]) -> httpx.Client:
    return brief[1]


@pytest.fixture(scope="module")
def document(client: httpx.Client) -> dict[str, Any]:
    found: dict[str, Any] = client.get("/openapi.json").json()
    return found


@pytest.fixture(scope="module")
def operations(document: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    found = [(method, path, operation) for path, methods in document["paths"].items()
             for method, operation in methods.items() if method in METHODS]
    assert len(found) >= 14
    # What is posted can be got after, and what is cancelled cannot.
    return sorted(found, key=lambda entry: (entry[1].endswith("/cancel"), entry[0] != "post"))


def test_every_operation_is_described(operations: list[tuple[str, str, dict[str, Any]]]) -> None:
    for method, path, operation in operations:
        where = f"{method} {path}"
        assert operation["summary"], where
        assert len(operation["description"]) > 40, where
        for parameter in operation.get("parameters", ()):
            assert parameter.get("description"), f"{where}: {parameter['name']}"
        refusals = {status: answer for status, answer in operation["responses"].items() if status >= "400"}
        assert {"422", "500"} <= set(refusals), where
        for answer in refusals.values():
            assert list(answer["content"]) == [MEDIA_TYPE], where
        assert operation["responses"].keys() & {"200", "201", "202"}, where


def test_every_field_is_described(document: dict[str, Any]) -> None:
    bodies = [content["schema"] for methods in document["paths"].values() for operation in methods.values()
              for content in operation.get("requestBody", {"content": {}})["content"].values()]
    for schema in [*document["components"]["schemas"].values(), *bodies]:
        for name, field in schema.get("properties", {}).items():
            assert field.get("description") or "$ref" in field, f"{schema.get('title')}.{name}"


def test_every_example_works_and_its_answer_fits_its_schema(
        client: httpx.Client, document: dict[str, Any], operations: list[tuple[str, str, dict[str, Any]]]) -> None:
    for method, path, operation in operations:
        if path.endswith(("/result", "/report", "/model")) or "/pictures" in path:
            _await_example(client, path)
        parts: dict[str, dict[str, Any]] = {"path": {}, "query": {}, "header": {}}
        for parameter in operation.get("parameters", ()):
            if "examples" in parameter:
                parts[parameter["in"]][parameter["name"]] = next(iter(parameter["examples"].values()))["value"]
            else:
                assert not parameter["required"], f"{method} {path}: {parameter['name']} has no example"
        body = operation.get("requestBody")
        kept: dict[str, Any] = {}
        if body:
            media, content = next(iter(body["content"].items()))
            example = content.get("example") or _resolve(document, content["schema"])["examples"][0]
            kept = {"json": example} if media == "application/json" else {
                "content": example, "headers": {"Content-Type": media}}
        kept["headers"] = {**kept.get("headers", {}), **parts["header"]}
        answer = client.request(method, path.format(**parts["path"]), params=parts["query"], **kept)
        assert answer.is_success, f"{method} {path}: {answer.text}"
        media = answer.headers["Content-Type"].partition(";")[0]
        schema = operation["responses"][str(answer.status_code)]["content"][media]["schema"]
        if media != "application/json":
            assert schema == {"type": "string"}
            continue
        jsonschema.validate(answer.json(), {**schema, "components": document["components"]},
                            cls=jsonschema.Draft202012Validator)


def test_the_names_of_operations_are_those_of_the_functions(
        operations: list[tuple[str, str, dict[str, Any]]]) -> None:
    names = [operation["operationId"] for _, _, operation in operations]
    assert len(set(names)) == len(names)


def _resolve(document: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    if "$ref" not in schema:
        return schema
    found: dict[str, Any] = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    return found | schema


def _await_example(client: httpx.Client, path: str) -> None:
    address = "/v1/fits/first-fit" if path.startswith("/v1/fits") else "/v1/studies/first-study"
    while (job := client.get(address).json())["status"] in ("queued", "running"):
        time.sleep(0.1)
    assert job["status"] == "done", job
