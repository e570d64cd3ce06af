"""The OpenAPI document: that of the routes, with problem details and with the role that each operation needs."""

from collections.abc import Sequence
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.routing import BaseRoute

from .error_responses import error_response
from .problem_details import ProblemDetails
from .tokens import required_role

_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "A token of this service."},
    "basic": {"type": "http", "scheme": "basic", "description": "Any user name, and a token as the password. Browsers "
                                                                "ask for both when a page is opened."}}


def openapi_document(app: FastAPI, routes: Sequence[BaseRoute], secured: bool) -> dict[str, Any]:
    """Return the document of the `routes` of an application; `secured` says whether the service requires tokens."""
    if app.openapi_schema is None:
        document = get_openapi(title=app.title, version=app.version, description=app.description, routes=routes)
        schema = ProblemDetails.model_json_schema(ref_template="#/components/schemas/{model}")
        document["components"]["schemas"] |= schema.pop("$defs") | {"ProblemDetails": schema}
        document["components"]["securitySchemes"] = _SCHEMES
        for path, methods in document["paths"].items():
            for method, operation in methods.items():
                _secure(operation, required_role(method.upper(), path), secured)
        app.openapi_schema = document
    return app.openapi_schema


def _secure(operation: dict[str, Any], role: str | None, secured: bool) -> None:
    if role is None:
        operation["security"] = []
        return
    # OpenAPI 3.1 has the roles in these lists; an empty alternative means that no token is needed.
    operation["security"] = [{scheme: [role]} for scheme in _SCHEMES] + ([] if secured else [{}])
    operation["description"] += f"\n\nRole: `{role}`."
    operation["responses"] |= {str(status): error_response(status) for status in (401, 403)}
