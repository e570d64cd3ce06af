"""The keys that a JSON body may have at some place, from the OpenAPI document, for errors about unknown ones."""

from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any

from fastapi import Request

_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
"""Types of pydantic's errors about a key of a model and of a dataclass."""


def explain_unknown_key(request: Request, error: dict[str, Any]) -> str | None:
    """Return what is wrong with an unknown key of the body and the nearest known one; None for any other `error`."""
    if error["type"] not in _UNKNOWN or error["loc"][0] != "body":
        return None
    *place, key = error["loc"][1:]
    known = sorted(_keys(request, place))
    nearest = get_close_matches(str(key), known, n=1)
    hint = f"did you mean '{nearest[0]}'? " if nearest else ""
    elsewhere = [".".join((*other, str(key))) for other in _places(request) if key in _keys(request, other)]
    here = f"unknown here, but known as {' and '.join(elsewhere)}" if elsewhere else "unknown"
    return f"The key is {here}; {hint}Known: {', '.join(known)}"


def _places(request: Request) -> Iterator[tuple[str, ...]]:
    """Yield the places that may have keys of their own: the body, its keys, and those within them."""
    yield ()
    for outer in sorted(_keys(request, ())):
        yield (outer,)
        yield from ((outer, inner) for inner in sorted(_keys(request, (outer,))))


def _keys(request: Request, place: Sequence[str | int]) -> set[str]:
    document = request.app.openapi()
    operation = document["paths"].get(request.scope["route"].path, {}).get(request.method.lower(), {})
    body = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema", {})
    schemas = list(_alternatives(document, body))
    for part in place:
        # A part that names no property, such as the alternative that pydantic has tried, leaves the place as it is.
        inner = [schema["items"] if isinstance(part, int) else schema["properties"][part] for schema in schemas
                 if ("items" in schema if isinstance(part, int) else part in schema.get("properties", {}))]
        schemas = [alternative for schema in inner for alternative in _alternatives(document, schema)] or schemas
    return {key for schema in schemas for key in schema.get("properties", {})}


def _alternatives(document: dict[str, Any], schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the schemas of which a value may have one, with references followed."""
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    yield schema
    for alternative in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from _alternatives(document, alternative)
