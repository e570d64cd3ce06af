"""Where to start, and whether the service is well."""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.problem_details import StoreUnavailable, responses
from service.routes.fits import TheFits
from service.routes.studies import TheStudies
from service.schemas import SIMULATED, TheLibrary
from slipstick import __version__

router = APIRouter(prefix="/v1", tags=["start"], route_class=JsonRoute)


class Index(BaseModel):
    """What there is."""

    name: str = Field(description="Name of the service.")
    version: str = Field(description="Version of the program.")
    about: str = Field(description="Where the numbers come from.")
    links: dict[str, str] = Field(description="What there is -> its address.")


class Health(BaseModel):
    """How the service is."""

    status: str = Field(description="`ok`; anything else is a problem answer.")
    version: str = Field(description="Version of the program.")
    tables: int = Field(description="Tables in the folder.")
    recordings: int = Field(description="Recordings in the folder.")
    fits_waiting: int = Field(description="Fits that wait for a worker; where it stays above 0, is one running?")
    fits_running: int = Field(description="Fits that run.")
    studies_waiting: int = Field(description="Studies that wait for a worker.")
    studies_running: int = Field(description="Studies that run.")


@router.get("", summary="Start here", responses=responses())
def index() -> Index:
    """The addresses of everything else, the version, and where the numbers come from."""
    names = ("tables", "recordings", "evaluate", "propagate", "likelihood", "fits", "studies", "health")
    return Index(
        name="Slipstick", version=__version__,
        about="The parameters of the clutch are plausible for a heavy-vehicle test bench; the paper publishes none. "
              + SIMULATED,
        links={**{name: f"/v1/{name}" for name in names}, "documentation": "/docs", "openapi": "/openapi.json"})


@router.get("/health", summary="Is the service well?", responses=responses(503))
def health(library: TheLibrary, fits: TheFits, studies: TheStudies) -> Health:
    """Look into the folder of the tables and into the database of the jobs; 503 where that does not answer."""
    if not library.folder.is_dir():
        raise StoreUnavailable(f"There is no folder '{library.folder}'",
                               "Set SLIPSTICK_TABLES to the folder of the tables")
    waiting, running = fits.counts()
    studies_waiting, studies_running = studies.counts()
    return Health(status="ok", version=__version__, tables=len(library.tables()), recordings=len(library.recordings()),
                  fits_waiting=waiting, fits_running=running, studies_waiting=studies_waiting,
                  studies_running=studies_running)
