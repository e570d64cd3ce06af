"""The OpenAPI document is complete, its examples work, and the responses match their schemas."""

import base64
import importlib
import io
import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_type_hints

import httpx
import jsonschema
import pytest
from openapi_python_client.strings import ClassName, PythonIdentifier, pascal_case

from service.job_store import KINDS
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
    # POST first, because it creates the resources of the other examples; cancellation, renaming and deletion last, and
    # those of files after those of the jobs which use them.
    return sorted(operations, key=lambda entry: (entry[0] == "delete", entry[0] == "patch",
                                                 entry[1].endswith("/cancel"),
                                                 entry[0] == "delete" and entry[1].endswith("/{name}"),
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


def test_no_two_schemas_give_one_class_of_a_client(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    names = [ClassName(name, "") for name in schemas]
    for parent, schema in schemas.items():
        for name, field in schema.get("properties", {}).items():
            names += _inline_classes(parent, name, field)
    assert [name for name, count in Counter(names).items() if count > 1] == []


def _inline_classes(parent: str, name: str, field: dict[str, Any]) -> list[str]:
    """The classes that openapi-python-client makes of objects and enumerations written inside a property."""
    own = f"{parent}{pascal_case(field.get('title', name))}"
    classes = [own] if "enum" in field or (field.get("type") == "object" and "$ref" not in field) else []
    for number, alternative in enumerate(field.get("anyOf", ())):
        classes += _inline_classes(own, f"Type{number}", alternative)
    return classes + (_inline_classes(own, "Item", field["items"]) if isinstance(field.get("items"), dict) else [])


@pytest.fixture(scope="module")
def generated(document: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Name of the package of a client that openapi-python-client generates without a warning."""
    folder, package = tmp_path_factory.mktemp("generated"), "generated_slipstick_client"
    (folder / "openapi.json").write_text(json.dumps(document))
    binary = {media_type for methods in document["paths"].values() for operation in methods.values()
              for media_type in operation.get("requestBody", {"content": {}})["content"]} - {"application/json"}
    # To the generator these are unknown; it sends them as they are if they are called bytes.
    (folder / "config.json").write_text(json.dumps({
        "content_type_overrides": dict.fromkeys(binary, "application/octet-stream"), "post_hooks": []}))
    done = subprocess.run([sys.executable, "-m", "openapi_python_client", "generate", "--fail-on-warning",
                           "--meta", "none", "--path", str(folder / "openapi.json"),
                           "--config", str(folder / "config.json"), "--output-path", str(folder / package)],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield package


def test_every_example_works_in_a_generated_client_and_its_response_matches_its_schema(
        quick_service: tuple[Path, httpx.Client], document: dict[str, Any],
        operations: list[tuple[str, str, dict[str, Any]]], generated: str, files: None) -> None:
    folder, client = quick_service
    generated_client = importlib.import_module(f"{generated}.client").Client(base_url=str(client.base_url), timeout=30)
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
        body: Any = None
        if "requestBody" in operation:
            media_type, content = next(iter(operation["requestBody"]["content"].items()))
            if media_type == "application/x-hdf5":  # a file is no readable example
                body = (folder / "nominal.h5").read_bytes()
            else:
                body = content.get("example") or _resolve(document, content["schema"])["examples"][0]
                body = base64.b64decode(body) if content["schema"].get("contentEncoding") == "base64" else body
        module = importlib.import_module(".".join((generated, "api", *(
            PythonIdentifier(name, "") for name in (operation["tags"][0], operation["operationId"])))))
        named = {PythonIdentifier(name, ""): value for values in parameters.values() for name, value in values.items()}
        response = module.sync_detailed(client=generated_client, **_arguments(module.sync_detailed, named, body))
        assert 200 <= response.status_code < 300, f"{method} {path}: {response.content!r}"
        if "304" in operation["responses"]:
            known = {**parameters["header"], "If-None-Match": response.headers["ETag"]}
            assert client.get(path.format(**parameters["path"]), params=parameters["query"],
                              headers=known).status_code == 304, path
        if response.status_code == 204:
            assert response.content == b""
            continue
        if method == "patch":  # the other examples have the former name
            assert client.patch(response.headers["Location"], json=parameters["path"]).is_success
        assert response.parsed is not None, f"{method} {path}"
        media_type = response.headers["Content-Type"].partition(";")[0]
        schema = operation["responses"][str(int(response.status_code))]["content"][media_type]["schema"]
        if media_type != "application/json":
            assert schema in ({"type": "string"}, {"type": "string", "format": "binary"})
            continue
        jsonschema.validate(json.loads(response.content), {**schema, "components": document["components"]},
                            cls=jsonschema.Draft202012Validator)


class _Text(str):
    """A body of text; the generated code takes the payload of a text, too, as if it were a file."""

    @property
    def payload(self) -> str:
        return str(self)


def _arguments(function: Callable[..., Any], named: dict[str, Any], body: Any) -> dict[str, Any]:
    """The arguments of a generated function: objects of its own classes for enumerations and bodies."""
    hints = get_type_hints(function)
    arguments = {}
    for name, value in {**named, **({} if body is None else {"body": body})}.items():
        classes = get_args(hints[name]) or (hints[name],)
        if name == "body" and isinstance(value, str) and str in classes:
            arguments[name] = _Text(value)
        elif name == "body" and isinstance(value, str | bytes):
            file = next(kind for kind in classes if kind.__name__ == "File")
            arguments[name] = file(payload=io.BytesIO(value if isinstance(value, bytes) else value.encode()))
        elif name == "body":
            arguments[name] = next(kind for kind in classes if hasattr(kind, "from_dict")).from_dict(value)
        else:
            made = next((kind for kind in classes if isinstance(kind, type) and issubclass(kind, Enum)), None)
            arguments[name] = made(value) if made else value
    return arguments


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
    kind = next(kind for kind, address in KINDS.items() if path.startswith(address))
    address = f"{KINDS[kind]}/first-{kind}"
    while (job := client.get(address).json())["status"] in ("queued", "running"):
        time.sleep(0.1)
    assert job["status"] == "done", job
