"""The OpenAPI document is complete, its examples work, and the responses match their schemas."""

import base64
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import jsonschema
import pytest

from service.problem_details import MEDIA_TYPE

METHODS = ("get", "post", "put", "patch", "delete")


@pytest.fixture(scope="module")
def client(quick_service: tuple[Path, httpx.Client]) -> httpx.Client:
    return quick_service[1]


@pytest.fixture
def files(quick_service: tuple[Path, httpx.Client]) -> Iterator[None]:
    """Restore the files that the examples of DELETE delete."""
    content = {path: path.read_bytes() for path in quick_service[0].glob("*.h5")}
    yield
    for path, before in content.items():
        path.write_bytes(before)


@pytest.fixture(scope="module")
def document(client: httpx.Client) -> dict[str, Any]:
    document: dict[str, Any] = client.get("/openapi.json").json()
    return document


@pytest.fixture(scope="module")
def operations(document: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    operations = [(method, path, operation) for path, methods in document["paths"].items()
                  for method, operation in methods.items() if method in METHODS]
    assert len(operations) >= 14
    # POST first, because it creates the resources of the other examples; cancellation and deletion last.
    return sorted(operations, key=lambda entry: (entry[0] == "delete", entry[1].endswith("/cancel"),
                                                 entry[0] != "post"))


def test_every_operation_is_described(operations: list[tuple[str, str, dict[str, Any]]]) -> None:
    for method, path, operation in operations:
        address = f"{method} {path}"
        assert operation["summary"], address
        assert len(operation["description"]) > 40, address
        for parameter in operation.get("parameters", ()):
            assert parameter.get("description"), f"{address}: {parameter['name']}"
        # Clients of UM-Bridge expect errors of another form, all of one status.
        invalid, media_type = ("400", "application/json") if path.startswith("/umbridge") else ("422", MEDIA_TYPE)
        errors = {status: response for status, response in operation["responses"].items() if status >= "400"}
        assert {invalid, "500"} <= set(errors), address
        for response in errors.values():
            assert list(response["content"]) == [media_type], address
        assert operation["responses"].keys() & {"200", "201", "202", "204"}, address


def test_every_field_is_described(document: dict[str, Any]) -> None:
    bodies = [content["schema"] for methods in document["paths"].values() for operation in methods.values()
              for content in operation.get("requestBody", {"content": {}})["content"].values()]
    for schema in [*document["components"]["schemas"].values(), *bodies]:
        for name, field in schema.get("properties", {}).items():
            assert field.get("description") or _resolve(document, field).get("description"), (schema.get("title"), name)


def test_every_example_works_and_its_response_matches_its_schema(
        client: httpx.Client, document: dict[str, Any], operations: list[tuple[str, str, dict[str, Any]]],
        files: None) -> None:
    for method, path, operation in operations:
        if path.endswith(("/result", "/report", "/model")) or "/pictures" in path or "/laws" in path:
            _await_example(client, path)
        parameters: dict[str, dict[str, Any]] = {"path": {}, "query": {}, "header": {}}
        for parameter in operation.get("parameters", ()):
            if "examples" in parameter:
                example = next(iter(parameter["examples"].values()))["value"]
                parameters[parameter["in"]][parameter["name"]] = example
            else:
                assert not parameter["required"], f"{method} {path}: {parameter['name']} has no example"
        body = operation.get("requestBody")
        options: dict[str, Any] = {}
        if body:
            media_type, content = next(iter(body["content"].items()))
            if media_type == "application/x-hdf5":
                continue  # an HDF5 file is no readable example; test_table_upload.py uploads those of the documentation
            example = content.get("example") or _resolve(document, content["schema"])["examples"][0]
            if content["schema"].get("contentEncoding") == "base64":
                example = base64.b64decode(example)
            options = {"json": example} if media_type == "application/json" else {
                "content": example, "headers": {"Content-Type": media_type}}
        options["headers"] = {**options.get("headers", {}), **parameters["header"]}
        response = client.request(method, path.format(**parameters["path"]), params=parameters["query"], **options)
        assert response.is_success, f"{method} {path}: {response.text}"
        if "304" in operation["responses"]:
            known = {**options["headers"], "If-None-Match": response.headers["ETag"]}
            assert client.get(path.format(**parameters["path"]), params=parameters["query"],
                              headers=known).status_code == 304, path
        if response.status_code == 204:
            assert response.content == b""
            continue
        media_type = response.headers["Content-Type"].partition(";")[0]
        schema = operation["responses"][str(response.status_code)]["content"][media_type]["schema"]
        if media_type != "application/json":
            assert schema == {"type": "string"}
            continue
        jsonschema.validate(response.json(), {**schema, "components": document["components"]},
                            cls=jsonschema.Draft202012Validator)


def test_operation_ids_are_unique(
        operations: list[tuple[str, str, dict[str, Any]]]) -> None:
    names = [operation["operationId"] for _, _, operation in operations]
    assert len(set(names)) == len(names)


def _resolve(document: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    if "$ref" not in schema:
        return schema
    component: dict[str, Any] = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    return component | schema


def _await_example(client: httpx.Client, path: str) -> None:
    address = "/v1/fits/first-fit" if path.startswith("/v1/fits") else "/v1/studies/first-study"
    while (job := client.get(address).json())["status"] in ("queued", "running"):
        time.sleep(0.1)
    assert job["status"] == "done", job
