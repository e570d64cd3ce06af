"""The files of the folder as they are, to be kept elsewhere or read by other programs."""

from collections.abc import Callable
from typing import Any

from fastapi import APIRouter
from fastapi.responses import FileResponse

from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..error_responses import error_responses
from ..routes.benches import BenchNamePath
from ..routes.recordings import RecordingsNamePath
from ..routes.tables import TableNamePath
from ..schemas import LibraryDependency

router = APIRouter(prefix="/v1", route_class=JsonRoute)

_TYPES = {"h5": "application/x-hdf5", "toml": "application/toml"}


def _file_response(extension: str) -> dict[int | str, dict[str, Any]]:
    content = {_TYPES[extension]: {"schema": {"type": "string", "format": "binary"}}}
    return {200: {"description": "The file", "content": content}, **error_responses(404, 503)}


@router.get("/tables/{name}/file", summary="Download a table", tags=["tables"], response_class=FileResponse,
            responses=_file_response("h5"))
def download_table(name: TableNamePath, library: LibraryDependency) -> FileResponse:
    """Return the HDF5 file of a table, valid or not, as it is stored."""
    return _send(library, name, "h5", library.has_table, library.table)


@router.get("/recordings/{name}/file", summary="Download recordings", tags=["recordings"], response_class=FileResponse,
            responses=_file_response("h5"))
def download_recordings(name: RecordingsNamePath, library: LibraryDependency) -> FileResponse:
    """Return the HDF5 file of recordings, valid or not, as it is stored; MATLAB, h5py and others read it."""
    return _send(library, name, "h5", library.has_recordings, library.recorded)


@router.get("/benches/{name}/file", summary="Download a bench", tags=["benches"], response_class=FileResponse,
            responses=_file_response("toml"))
def download_bench(name: BenchNamePath, library: LibraryDependency) -> FileResponse:
    """Return the TOML file of a bench, valid or not, as it is stored."""
    return _send(library, name, "toml", library.has_bench, library.bench)


def _send(library: Library, name: str, extension: str, exists: Callable[[str], bool],
          open_file: Callable[[str], object]) -> FileResponse:
    if not exists(name):
        open_file(name)  # raises the error with similar names
    return FileResponse(library.folder / f"{name}.{extension}", media_type=_TYPES[extension],
                        filename=f"{name}.{extension}")
