"""The FastAPI application: routers, error handlers, body limits, documentation page."""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial

from fastapi import FastAPI
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware

from slipstick import __version__
from slipstick.storage.database import open_database
from slipstick.storage.library import Library

from . import npy, pages, problem_details
from .access import Access
from .bodies import BodyLimits
from .computations import Computations
from .drawings import Drawings
from .failures import HeadRequests, UnexpectedErrors
from .following import Following
from .heartbeats import Heartbeats
from .job_store import APPLICATION, connect, job_stores
from .job_table import JobTable
from .machines import Machines
from .metrics import RequestMetrics, StateMetrics
from .observation import Observed
from .openapi import openapi_document
from .recent import Recent
from .retention import remove_for_ever
from .revalidation import NotModified, not_modified
from .routes import (
    benches,
    builds,
    calibrations,
    downloads,
    evaluate,
    files,
    fits,
    front,
    imports,
    index,
    job_pages,
    likelihood,
    machines,
    operation,
    propagate,
    proposals,
    recordings,
    reports,
    residuals,
    studies,
    study_laws,
    study_reports,
    table_upload,
    tables,
)
from .settings import Settings
from .tokens import tokens_of
from .umbridge import routes as umbridge
from .umbridge.errors import BridgeErrors
from .warming import rehearse, warm

_NOT_COMPRESSED = (*DEFAULT_EXCLUDED_CONTENT_TYPES, npy.MEDIA_TYPE, "application/octet-stream")
"""Random digits of arrays hardly shrink, and events must not wait in a buffer."""
_HEALTH_SECONDS = 1.0
_QUIET_SECONDS = 0.2
"""Time after the start in which the first request, such as a health check, does not compete with preparations."""
_READING = 3
"""Number of requests that read at once. The interpreter runs one thread at a time: more threads only delay others."""
_DESCRIPTION = """
Slipstick compares a simulation model of a wet friction clutch with test-bench recordings. The service

* builds lookup tables of shifting times, and evaluates them,
* propagates uncertain inputs by polynomial chaos expansion,
* computes the likelihood of recordings,
* fits the distributions of the inputs to recordings,
* calibrates the parameters of a bench or machine to recordings, and
* runs studies that find, name and measure physical effects missing from the model.

**Terms.** In an engagement, the clutch closes after a shift command; the *shifting time* is the time until its plates
stop slipping (lock-up). A *condition* is the operating condition of an engagement: current profile, motor speed, load
inertia and brake torque. *Recordings* contain the measured shifting time of engagements and, optionally, signals over
time. A *table* contains simulated shifting times over multiples of some parameters of the model. An *effect* is a
physical effect that can be added to the model. *Scatter* is the variation of parameters from run to run.

**Conventions.** Inputs are multiples of nominal values. Times are in seconds, and probability densities are per
millisecond; the output of another machine is in its own unit, and its densities are per thousandth of it. A log10
likelihood is the sum of the base-10 logarithms of these densities; a difference of 1 is a decade. The parameter
`outside` defines the shifting time at points outside a table. Errors are returned as problem details with a `remedy`
(RFC 9457).

**Tokens.** If the service has a token file, requests need a token, as `Authorization: Bearer TOKEN` or as the password
of Basic authentication. Reading needs one of the role `read`; computations, uploads and jobs need `run`; the deletion
and renaming of files needs `admin`. Each role includes those before it. The health checks need no token. The
operations of UM-Bridge need none either, and answer only the machine of the service.

*The paper* is Tod et al., *Parametric Uncertainty Quantification Using Polynomial Chaos Expansions Applied to a Wet
Friction Clutch Model*.
"""


def create_app(settings: Settings | None = None) -> FastAPI:
    """Build the application; `settings` are read from the environment by default.

    Raises `BadTokens` if the service would be open to other machines.
    """
    configuration = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        client = connect(configuration.jobs)
        engine = open_database(configuration.jobs)
        table = JobTable(engine, APPLICATION)
        app.state.jobs = job_stores(client, table)
        app.state.heartbeats = heartbeats = Heartbeats(engine)
        app.state.machines = Machines(engine)
        app.state.health = Recent(
            partial(index.health_of, app.state.library, table, heartbeats), _HEALTH_SECONDS)
        state = StateMetrics(table, heartbeats, app.state.computations, app.state.following)
        metrics.registry.register(state)
        removal = asyncio.create_task(remove_for_ever(client, configuration))
        preparing = asyncio.get_running_loop().call_later(_QUIET_SECONDS, prepare)
        yield
        preparing.cancel()
        removal.cancel()
        metrics.registry.unregister(state)
        engine.dispose()
        client.destroy()

    def prepare() -> None:
        for early in (partial(_warm_up, app, asyncio.get_running_loop()), app.state.drawings.prepare):
            threading.Thread(target=early, daemon=True).start()

    app = FastAPI(title="Slipstick", version=__version__, description=_DESCRIPTION, docs_url=None, redoc_url=None,
                  lifespan=lifespan)
    app.state.settings = configuration
    metrics = app.state.metrics = RequestMetrics()
    app.state.computations = Computations(configuration.computations, configuration.waiting,
                                          configuration.waiting_seconds)
    app.state.uploads = Computations(configuration.uploads, configuration.waiting, configuration.waiting_seconds)
    app.state.reading = asyncio.Semaphore(_READING)
    app.state.drawings = Drawings()
    app.state.following = Following(configuration.followers, configuration.follow_seconds)
    app.state.library = Library(configuration.tables, configuration.folder_bytes, configuration.engagements)
    for module in (index, benches, machines, tables, table_upload, recordings, imports, proposals, files, downloads,
                   evaluate, propagate, likelihood, fits, reports, residuals, studies, study_laws, study_reports,
                   calibrations, builds, umbridge, front, job_pages, operation):
        # Not `include_router`, which builds each route again and looks for it through every router, twice.
        app.router.routes.extend(module.router.routes)
    documented = app.router.routes.copy()
    # Routes are tried one after the other, and most requests evaluate points.
    app.router.routes.sort(key=lambda route: route not in evaluate.router.routes)
    pages.install(app)
    problem_details.install(app)
    app.add_exception_handler(NotModified, not_modified)
    app.add_middleware(GZipMiddleware, minimum_size=1000, compresslevel=5, exclude_content_types=_NOT_COMPRESSED)
    app.add_middleware(BodyLimits, settings=configuration)
    app.add_middleware(HeadRequests)
    app.add_middleware(UnexpectedErrors)
    tokens = tokens_of(configuration)
    app.add_middleware(Access, hosts=_host_names(configuration), tokens=tokens)
    app.add_middleware(BridgeErrors)
    app.add_middleware(Observed, metrics=metrics)
    app.openapi = lambda: openapi_document(app, documented, tokens is not None)  # type: ignore[method-assign]
    return app


def _warm_up(app: FastAPI, loop: asyncio.AbstractEventLoop) -> None:
    def begin() -> None:
        app.state.rehearsal = loop.create_task(rehearse(app))  # kept, because the loop does not keep its tasks

    warm()
    with suppress(RuntimeError):  # the server has ended meanwhile
        loop.call_soon_threadsafe(begin)


def _host_names(settings: Settings) -> frozenset[str]:
    return frozenset(name.strip().strip("[]").lower() for name in (*settings.hosts.split(","), settings.host))
