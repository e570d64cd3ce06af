"""Deletion and renaming of files, which are refused while a job uses them; results keep a file from being deleted."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated

from fastapi import APIRouter, Body, Query, Response
from pydantic import Field

from slipstick.storage.library import FileKind, Library

from ..bodies import JsonRoute
from ..error_responses import error_responses
from ..front.elements import plural
from ..job_filter import ACTIVE, JobFilter
from ..job_store import JobStore
from ..jobs import JobStores
from ..problem_details import Conflict
from ..routes import benches, recordings, tables
from ..routes.benches import BenchNamePath
from ..routes.recordings import RecordingsNamePath
from ..routes.tables import TableNamePath
from ..schemas import LibraryDependency, StrictModel

router = APIRouter(prefix="/v1", route_class=JsonRoute)

Force = Annotated[bool, Query(description="Delete it even if there are results of it.")]


class NewName(StrictModel):
    """What a renaming changes."""

    name: str = Field(description="The new name: up to 64 letters, digits, - and _, starting with a letter or digit.")


Renaming = Annotated[NewName, Body(examples=[{"name": "new-name"}])]
_RESPONSES = error_responses(404, 408, 409, 413, 415, 503)


@router.patch("/tables/{name}", summary="Rename a table", tags=["tables"], responses=_RESPONSES)
def rename_table(name: TableNamePath, body: Renaming, library: LibraryDependency, stores: JobStores,
                 response: Response) -> tables.TableEntry:
    """Rename the file of a table, valid or not; 409 if a queued or running job uses it, or if the new name is taken.

    The new address is in the header Location. Finished fits of the table keep its former name, and its digest. The
    report of a study can compare them once the table has that name again.
    """
    _rename("table", name, body.name, JobFilter(table=name), library, stores)
    response.headers["Location"] = f"/v1/tables/{body.name}"
    return tables.entry(library, body.name)


@router.patch("/recordings/{name}", summary="Rename recordings", tags=["recordings"], responses=_RESPONSES)
def rename_recordings(name: RecordingsNamePath, body: Renaming, library: LibraryDependency, stores: JobStores,
                      response: Response) -> recordings.RecordingsEntry:
    """Rename a recordings file, valid or not; 409 if a queued or running job uses it, or if the new name is taken.

    The new address is in the header Location. Results of the recordings keep their former name, and their digest.
    """
    _rename("recordings file", name, body.name, JobFilter(recordings=name), library, stores)
    response.headers["Location"] = f"/v1/recordings/{body.name}"
    return recordings.entry(library, body.name)


@router.patch("/benches/{name}", summary="Rename a bench", tags=["benches"], responses=_RESPONSES)
def rename_bench(name: BenchNamePath, body: Renaming, library: LibraryDependency, stores: JobStores,
                 response: Response) -> benches.BenchEntry:
    """Rename a bench file, valid or not; 409 if a queued or running job uses it, or if the new name is taken.

    The new address is in the header Location. Results on the bench keep its former name, and its digests.
    """
    _rename("bench", name, body.name, JobFilter(bench=name), library, stores)
    response.headers["Location"] = f"/v1/benches/{body.name}"
    return benches.entry(library, body.name)


@router.delete("/tables/{name}", summary="Delete a table", status_code=204, tags=["tables"],
               responses=error_responses(404, 409, 503))
def delete_table(name: TableNamePath, library: LibraryDependency, stores: JobStores, force: Force = False) -> None:
    """Delete the file of a table, valid or not; 409 while a queued or running job uses it.

    Without `force` it is also 409 if there are finished fits with it. Their results stay available, but no report of
    a study can include them any more.
    """
    _delete("table", name, JobFilter(table=name), force, library, stores)


@router.delete("/recordings/{name}", summary="Delete recordings", status_code=204, tags=["recordings"],
               responses=error_responses(404, 409, 503))
def delete_recordings(name: RecordingsNamePath, library: LibraryDependency, stores: JobStores,
                      force: Force = False) -> None:
    """Delete a recordings file, valid or not; 409 while a queued or running job uses it.

    Without `force` it is also 409 if there are finished jobs of it. Their results stay available.
    """
    _delete("recordings file", name, JobFilter(recordings=name), force, library, stores)


@router.delete("/benches/{name}", summary="Delete a bench", status_code=204, tags=["benches"],
               responses=error_responses(404, 409, 503))
def delete_bench(name: BenchNamePath, library: LibraryDependency, stores: JobStores, force: Force = False) -> None:
    """Delete a bench file, valid or not; 409 while a queued or running job uses it.

    Without `force` it is also 409 if there are finished jobs on it. Their results and its tables stay available.
    """
    _delete("bench", name, JobFilter(bench=name), force, library, stores)


def _rename(kind: FileKind, name: str, new: str, users: JobFilter, library: Library,
            stores: Mapping[str, JobStore]) -> None:
    """Rename a file; raises `Conflict` if one of its `users` has not ended, or if the new name is taken."""
    _require_idle(name, users, stores)
    try:
        library.rename(kind, name, new)
    except FileExistsError:
        raise Conflict(f"A file named '{new}' already exists", "Choose another name") from None


def _delete(kind: FileKind, name: str, users: JobFilter, force: bool, library: Library,
            stores: Mapping[str, JobStore]) -> None:
    _require_idle(name, users, stores)
    count, example = _count_users(replace(users, status=["done"]), stores)
    if count and not force:
        raise Conflict(f"There are results of {plural(count, 'finished job')} with '{name}', such as {example}",
                       f"Delete these jobs first (DELETE {example}), or repeat the request with ?force=true, which "
                       "keeps the results")
    library.remove(kind, name)


def _require_idle(name: str, users: JobFilter, stores: Mapping[str, JobStore]) -> None:
    """Raise `Conflict` if a job that has not ended uses the file `name`."""
    count, example = _count_users(replace(users, status=ACTIVE), stores)
    if count:
        raise Conflict(f"'{name}' is in use by {plural(count, 'queued or running job')}, such as {example}",
                       "Cancel these jobs first, or wait until they have ended")


def _count_users(users: JobFilter, stores: Mapping[str, JobStore]) -> tuple[int, str]:
    """Return the number of jobs and the address of one of them, empty if there is none."""
    examples = (f"{store.address}/{job.workflow_id}" for store in stores.values() for job in store.newest(1, 0, users))
    return sum(store.total(users) for store in stores.values()), next(examples, "")
