"""Every operation with requests generated from the OpenAPI document: valid and invalid, alone and in sequences.

No request may be answered by status 500, by a response that the document does not describe, or by success where its
parameters or body are invalid. The slow tests are the same with many more requests.
"""

import copy
import logging
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest
import schemathesis
from hypothesis import HealthCheck
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.openapi.checks import UndefinedStatusCode
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from service.app import create_app
from service.settings import Settings

CHECKS = [not_a_server_error, status_code_conformance, content_type_conformance, response_schema_conformance,
          response_headers_conformance, negative_data_rejection]
KNOWN = ("nominal", "measured", "heavy")
FEW, MANY = 2, 50
BOTH = pytest.mark.parametrize("examples", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])


@schemathesis.serializer("application/toml", "application/x-hdf5", "application/zip", "application/x-npy", "text/csv")
def as_bytes(context: schemathesis.SerializationContext, value: Any) -> bytes:
    return value if isinstance(value, bytes) else str(value).encode("utf-8", "surrogatepass")


def known_names(context: Any, parameters: dict[str, Any] | None) -> dict[str, Any] | None:
    """Names that exist for half of the generated ones: nearly all others lead to status 404."""
    name = (parameters or {}).get("name")
    if parameters and isinstance(name, str) and len(name) % 2 and context.operation.method.upper() in ("GET", "POST"):
        return {**parameters, "name": KNOWN[len(name) // 2 % len(KNOWN)]}
    return parameters


def known_model(context: Any, body: Any) -> Any:
    """The name of an UM-Bridge model that exists, for half of the generated ones."""
    if context.operation.path.startswith("/umbridge/") and isinstance(body, dict) and isinstance(
            body.get("name"), str) and len(body["name"]) % 2:
        return {**body, "name": "nominal"}
    return body


def no_workers(context: Any, query: Any) -> Any:
    """None are required: no worker runs here, and a service that is not ready answers 503."""
    return {**query, "workers": 0} if context.operation.path == "/v1/ready" and isinstance(
        (query or {}).get("workers"), int) else query


def on_this_machine(app: Any) -> Any:
    """The application with clients on its own machine, as UM-Bridge requires."""
    async def answered(scope: Any, receive: Any, send: Any) -> None:
        await app({**scope, "client": ("127.0.0.1", 50000)}, receive, send)

    return answered


def served(shelf: Path, folder: Path) -> schemathesis.schemas.BaseSchema:
    """The document of an application on a copy of the folder `shelf`, and the way to it."""
    shutil.copytree(shelf, folder / "tables")
    app = create_app(Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite", hosts="*",
                              answer_values=20_000, work_values=2_000_000, follow_seconds=0.1))
    schema = schemathesis.openapi.from_asgi("/openapi.json", on_this_machine(app))
    schema.config.analysis.constants.enabled = False  # drawn from modules, of which more are imported as tests run
    schema.hook("map_path_parameters")(known_names)
    schema.hook("map_body")(known_model)
    schema.hook("map_query")(no_workers)
    return schema


def options(examples: int) -> hypothesis.settings:
    return hypothesis.settings(max_examples=examples, deadline=None, database=None, derandomize=examples == FEW,
                               suppress_health_check=list(HealthCheck), stateful_step_count=8)


def run_alone(schema: schemathesis.schemas.BaseSchema, examples: int) -> Counter[str]:
    """Send generated requests to each operation; return how many responses had each status."""
    statuses: Counter[str] = Counter()
    for found in schema.get_all_operations():
        operation = found.ok()
        # Without body, query and pattern, no request is invalid: every name may exist.
        limited = operation.body or operation.query or any(
            "pattern" in parameter.definition["schema"] for parameter in operation.path_parameters)
        for mode in GenerationMode if limited else [GenerationMode.POSITIVE]:
            @hypothesis.given(case=operation.as_strategy(generation_mode=mode))
            @options(examples)
            def check(case: schemathesis.Case) -> None:
                statuses[str(case.call_and_validate(checks=CHECKS).status_code)] += 1

            check()
    return statuses


def run_in_sequences(schema: schemathesis.schemas.BaseSchema, examples: int) -> None:
    """Send sequences of requests, in which later ones use what earlier ones returned."""
    class Machine(schema.as_state_machine()):  # type: ignore[misc]
        def validate_response(self, response: Any, case: schemathesis.Case, **arguments: Any) -> None:
            case.validate_response(response, checks=CHECKS)

    Machine.run(settings=options(examples))


@pytest.fixture(scope="module")
def schema(shelf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[schemathesis.schemas.BaseSchema]:
    logging.disable(logging.DEBUG)
    yield served(shelf, tmp_path_factory.mktemp("schema"))
    logging.disable(logging.NOTSET)


@BOTH
def test_generated_requests_are_answered_as_described(schema: schemathesis.schemas.BaseSchema, examples: int) -> None:
    statuses = run_alone(schema, examples)
    assert {"200", "404", "422"} <= set(statuses), statuses


@BOTH
def test_generated_sequences_are_answered_as_described(schema: schemathesis.schemas.BaseSchema, examples: int) -> None:
    run_in_sequences(schema, examples)


def test_what_the_document_does_not_describe_is_found(schema: schemathesis.schemas.BaseSchema) -> None:
    document = copy.deepcopy(schema.raw_schema)
    del document["paths"]["/v1/tables/{name}"]["get"]["responses"]["404"]
    incomplete = schemathesis.openapi.from_dict(document)
    incomplete.app = schema.app
    operation = incomplete["/v1/tables/{name}"]["GET"]
    with pytest.raises(BaseExceptionGroup) as caught:
        operation.Case(path_parameters={"name": "nowhere"}).call_and_validate(checks=CHECKS)
    assert [type(error) for error in caught.value.exceptions] == [UndefinedStatusCode]
