"""The application: routers, problem answers, limits and pages put together."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from service import pages, problem_details
from service.bodies import BodyLimits
from service.job_store import JobStore, connect
from service.routes import (
    evaluate,
    fits,
    index,
    likelihood,
    propagate,
    recordings,
    reports,
    studies,
    study_reports,
    tables,
)
from service.settings import Settings
from slipstick import __version__
from slipstick.storage.library import Library

_ABOUT = """
Find where a wet-clutch simulation and a test bench disagree, and by how much: shifting times from a lookup table,
uncertain inputs propagated by polynomial chaos, the likelihood of recordings, fits of the inputs to them, and
studies that name the physical effect which the simulation lacks.

Inputs are multiples of nominal values. Times are in s, densities per ms, logarithms to base 10. Beyond the edges of
a table the policy `outside` holds, and every answer says what lies there. Refusals are RFC 9457 problems that say
what to do.
"""


def create_app(settings: Settings | None = None) -> FastAPI:
    """Build the application; without `settings` they come from the environment."""
    chosen = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        jobs = connect(chosen.jobs)
        app.state.fits = JobStore(jobs, "fit", "/v1/fits")
        app.state.studies = JobStore(jobs, "study", "/v1/studies")
        yield
        jobs.destroy()

    app = FastAPI(title="Slipstick", version=__version__, description=_ABOUT, docs_url=None, redoc_url=None,
                  lifespan=lifespan, generate_unique_id_function=lambda route: route.name)
    app.state.settings, app.state.library = chosen, Library(chosen.tables)
    for resource in (index, tables, recordings, evaluate, propagate, likelihood, fits, reports, studies,
                     study_reports):
        app.include_router(resource.router)
    pages.install(app)
    problem_details.install(app)
    app.add_middleware(BodyLimits, size=chosen.body_bytes, seconds=chosen.body_seconds)
    app.openapi = lambda: _schema(app)  # type: ignore[method-assign]
    return app


def _schema(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document, with the schema of problems, which no route returns by itself."""
    if app.openapi_schema is None:
        schema = get_openapi(title=app.title, version=app.version, description=app.description, routes=app.routes)
        definition = problem_details.Problem.model_json_schema(ref_template="#/components/schemas/{model}")
        schema["components"]["schemas"] |= definition.pop("$defs") | {"Problem": definition}
        app.openapi_schema = schema
    return app.openapi_schema
