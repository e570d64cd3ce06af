"""The entry point and the health check of the service."""

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from slipstick import __version__
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..error_responses import error_responses
from ..heartbeats import Heartbeats
from ..job_store import KINDS
from ..job_table import JobTable
from ..recent import Recent
from ..schemas import SIMULATED, SettingsDependency

router = APIRouter(prefix="/v1", tags=["start"], route_class=JsonRoute)


class Index(BaseModel):
    """Entry point of the service."""

    name: str = Field(description="Name of the service.")
    version: str = Field(description="Version of Slipstick.")
    about: str = Field(description="Origin of the parameters and of the recordings.")
    links: dict[str, str] = Field(description="Addresses of the resources, by name.")
    limits: dict[str, float] = Field(
        description="Limits of the service by the name of their setting (docs/settings.md): `json_bytes` is "
                    "SLIPSTICK_JSON_BYTES. Requests beyond a limit are rejected with 413, 408 or 503.")


class Health(BaseModel):
    """State of the service."""

    status: str = Field(description="Always `ok`; a service that is not healthy returns 503.")
    version: str = Field(description="Version of Slipstick.")
    benches: int = Field(description="Number of benches.")
    tables: int = Field(description="Number of tables.")
    recordings: int = Field(description="Number of recordings.")
    workers: int = Field(description="Number of workers that are alive. If it is 0, no job runs: start one with "
                                     "`slipstick work`.")
    fits_waiting: int = Field(description="Number of fits in the queue.")
    fits_running: int = Field(description="Number of running fits.")
    studies_waiting: int = Field(description="Number of studies in the queue.")
    studies_running: int = Field(description="Number of running studies.")
    calibrations_waiting: int = Field(description="Number of calibrations in the queue.")
    calibrations_running: int = Field(description="Number of running calibrations.")
    builds_waiting: int = Field(description="Number of builds in the queue.")
    builds_running: int = Field(description="Number of running builds.")


@router.get("", summary="List the resources", responses=error_responses())
def index(settings: SettingsDependency) -> Index:
    """Return the addresses of all resources, the limits, the version, and the origin of the numbers."""
    names = ("benches", "machines", "tables", "recordings", "evaluate", "propagate", "likelihood",
             *(address.removeprefix("/v1/") for address in KINDS.values()), "health")
    return Index(
        name="Slipstick", version=__version__,
        about="The nominal parameters of the clutch are plausible values for a heavy-vehicle test bench; the paper "
              "does not publish its parameters. " + SIMULATED,
        limits={name: value for name, value in settings if name != "port" and isinstance(value, int | float)},
        links={**{name: f"/v1/{name}" for name in names}, "umbridge": "/umbridge/Info", "documentation": "/docs",
               "openapi": "/openapi.json"})


@router.get("/health", summary="Check the health of the service", responses=error_responses(503))
async def health(request: Request) -> Health:
    """Check that the folder of the tables exists and that the job database responds; return 503 if not.

    The answer is at most a second old, and comes at once also while the service is busy.
    """
    recent: Recent[Health] = request.app.state.health
    return await recent.value()


def health_of(library: Library, table: JobTable, heartbeats: Heartbeats) -> Health:
    """Read the folder and the job database; raises `NoFolder` and errors of the database."""
    library.require_folder()
    jobs = table.states("ENQUEUED", "PENDING")

    def count(workflow: str, wanted: str) -> int:
        return sum(number for kind, state, _, number in jobs if (kind, state) == (workflow, wanted))

    return Health(status="ok", version=__version__, benches=len(library.benches()), tables=len(library.tables()),
                  recordings=len(library.recordings()), workers=heartbeats.alive(),
                  **{f"{address.rpartition('/')[2]}_{name}": count(kind, state) for kind, address in KINDS.items()
                     for name, state in (("waiting", "ENQUEUED"), ("running", "PENDING"))})
