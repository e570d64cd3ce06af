"""Deletion of tables and recordings, which is refused while a job uses them or, unless forced, a result is of them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

from fastapi import APIRouter, Query

from ..bodies import JsonRoute
from ..error_responses import error_responses
from ..job_filter import ACTIVE, JobFilter
from ..job_store import JobStore
from ..problem_details import Conflict
from ..routes.fits import FitStore
from ..routes.recordings import RecordingsNamePath
from ..routes.studies import StudyStore
from ..routes.tables import TableNamePath
from ..schemas import LibraryDependency

router = APIRouter(prefix="/v1", route_class=JsonRoute)

Force = Annotated[bool, Query(description="Delete it even if there are results of it.")]


@router.delete("/tables/{name}", summary="Delete a table", status_code=204, tags=["tables"],
               responses=error_responses(404, 409, 503))
def delete_table(name: TableNamePath, library: LibraryDependency, fits: FitStore, force: Force = False) -> None:
    """Delete the file of a table, valid or not; 409 while a queued or running fit uses it.

    Without `force` it is also 409 if there are finished fits with it. Their results stay available, but no report of
    a study can include them any more.
    """
    _require_unused(name, JobFilter(table=name), force, fits)
    library.remove_table(name)


@router.delete("/recordings/{name}", summary="Delete recordings", status_code=204, tags=["recordings"],
               responses=error_responses(404, 409, 503))
def delete_recordings(name: RecordingsNamePath, library: LibraryDependency, fits: FitStore,
                      studies: StudyStore, force: Force = False) -> None:
    """Delete a recordings file, valid or not; 409 while a queued or running fit or study uses it.

    Without `force` it is also 409 if there are finished fits or studies of it. Their results stay available.
    """
    _require_unused(name, JobFilter(recordings=name), force, fits, studies)
    library.remove_recordings(name)


def _require_unused(name: str, users: JobFilter, force: bool, *stores: JobStore) -> None:
    count, example = _count_users(replace(users, status=ACTIVE), stores)
    if count:
        raise Conflict(f"'{name}' is in use by {count} queued or running jobs, such as {example}",
                       "Cancel these jobs first, or wait until they have ended")
    count, example = _count_users(replace(users, status=["done"]), stores)
    if count and not force:
        raise Conflict(f"There are results of {count} finished jobs with '{name}', such as {example}",
                       f"Delete these jobs first (DELETE {example}), or repeat the request with ?force=true, which "
                       "keeps the results")


def _count_users(users: JobFilter, stores: Sequence[JobStore]) -> tuple[int, str]:
    """Return the number of jobs and the address of one of them, empty if there is none."""
    examples = (f"{store.address}/{job.workflow_id}" for store in stores for job in store.newest(1, 0, users))
    return sum(store.total(users) for store in stores), next(examples, "")
