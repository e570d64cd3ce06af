"""Upload of tables, those of this project and those that another program computed."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from ..bodies import JsonRoute, upload_of
from ..computations import reads_upload
from ..error_responses import error_responses
from ..problem_details import Conflict
from ..routes.tables import TableDescription, describe
from ..schemas import LibraryDependency

router = APIRouter(prefix="/v1/tables", tags=["tables"], route_class=JsonRoute)

MEDIA_TYPE = "application/x-hdf5"
_UPLOAD_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {MEDIA_TYPE: {
    "schema": {"type": "string", "format": "binary"}}}}}

NewTableName = Annotated[str, Query(
    description="Name of the new table: up to 64 letters, digits, - and _, starting with a letter or digit.",
    openapi_examples={"mine": {"summary": "A new name", "value": "my-table"}})]


@router.post("", summary="Upload a table", status_code=201, openapi_extra=_UPLOAD_BODY,
             responses=error_responses(408, 409, 413, 415, 503) | {200: {
                 "description": "The same table already existed under this name", "model": TableDescription}})
@reads_upload
def upload_table(name: NewTableName, content: Annotated[bytes, upload_of(MEDIA_TYPE)], library: LibraryDependency,
                 response: Response) -> TableDescription:
    """Verify a table of any axes and store it.

    The request body is an HDF5 file (Content-Type application/x-hdf5): a table that the worker built, or a plain table
    that another program computed, of another machine for example. `docs/your_table.md` describes its layout. Send it by
    `curl --data-binary @table.h5 --header 'Content-Type: application/x-hdf5'`. The file is read in a child process with
    limited time and memory, and written anew. An existing file is never replaced: another table under an existing name
    is rejected with 409.
    """
    try:
        is_new = library.add_table(name, content)
    except FileExistsError:
        raise Conflict(f"A different file named '{name}' already exists", "Choose another name") from None
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"/v1/tables/{name}"
    return describe(name, library.table(name))
