"""Deletion of tables and recordings, which is refused while a job uses them."""

from fastapi import APIRouter

from service.bodies import JsonRoute
from service.error_responses import error_responses
from service.job_filter import ACTIVE, JobFilter
from service.job_store import JobStore
from service.problem_details import Conflict
from service.routes.fits import FitStore
from service.routes.recordings import RecordingsNamePath
from service.routes.studies import StudyStore
from service.routes.tables import TableNamePath
from service.schemas import LibraryDependency

router = APIRouter(prefix="/v1", route_class=JsonRoute)


@router.delete("/tables/{name}", summary="Delete a table", status_code=204, tags=["tables"],
               responses=error_responses(404, 409, 503))
def delete_table(name: TableNamePath, library: LibraryDependency, fits: FitStore) -> None:
    """Delete the file of a table, valid or not; 409 while a queued or running fit uses it.

    Results of finished fits stay available.
    """
    _require_unused(name, JobFilter(ACTIVE, table=name), fits)
    library.remove_table(name)


@router.delete("/recordings/{name}", summary="Delete recordings", status_code=204, tags=["recordings"],
               responses=error_responses(404, 409, 503))
def delete_recordings(name: RecordingsNamePath, library: LibraryDependency, fits: FitStore,
                      studies: StudyStore) -> None:
    """Delete a recordings file, valid or not; 409 while a queued or running fit or study uses it.

    Results of finished jobs stay available.
    """
    _require_unused(name, JobFilter(ACTIVE, recordings=name), fits, studies)
    library.remove_recordings(name)


def _require_unused(name: str, users: JobFilter, *stores: JobStore) -> None:
    count = sum(store.total(users) for store in stores)
    if count:
        example = next(f"{store.address}/{job.workflow_id}" for store in stores for job in store.newest(1, 0, users))
        raise Conflict(f"'{name}' is in use by {count} queued or running jobs, such as {example}",
                       "Cancel these jobs first, or wait until they have ended")
