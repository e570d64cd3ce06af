"""Open a file of a data-acquisition system by what it begins with, whatever its extension."""

from pathlib import PurePath
from typing import BinaryIO

from slipstick.acquisition import mdf_file
from slipstick.acquisition.channel import Source
from slipstick.acquisition.csv_file import CsvFile, wide_encoding
from slipstick.acquisition.csv_layout import CsvOptions
from slipstick.acquisition.matlab_file import MatlabFile
from slipstick.acquisition.parquet_file import ParquetFile
from slipstick.errors import BadRecording
from slipstick.storage.hdf5 import SIGNATURE

_USER_BLOCK = 512  # bytes before the HDF5 content of a MATLAB file
_TEXT = (".csv", ".txt", ".asc", ".tsv", ".dat", ".lvm")
FORMATS = (".mf4", ".mdf", ".mat", ".parquet", ".pq", *_TEXT)
"""What names of measurement files end in."""


def is_measurement(path: PurePath) -> bool:
    """Whether a file in a folder or archive is one by its name."""
    return path.suffix.lower() in FORMATS and not is_hidden(path)


def is_hidden(path: PurePath) -> bool:
    """Whether a file is one of those that macOS and other systems put beside the files of a user."""
    return any(part.startswith((".", "__MACOSX")) for part in path.parts)


def open_source(name: str, file: BinaryIO, options: CsvOptions | None = None) -> Source:
    """Open `file`, called `name` in errors; `file` must stay open while channels are read.

    MDF, MATLAB and Parquet are known by their first bytes, everything else is read as text. Raises `BadRecording`.
    """
    start = file.read(_USER_BLOCK + len(SIGNATURE))
    file.seek(0)
    if not start:
        raise BadRecording(f"{name} is empty", "Leave it out, or export it again")
    if start.startswith(mdf_file.SIGNATURES):
        return mdf_file.MdfFile(name, file)
    if start.startswith(SIGNATURE) or start[_USER_BLOCK:] == SIGNATURE:
        return MatlabFile(name, file, is_hdf5=True)
    if start.startswith(b"PAR1"):
        return ParquetFile(name, file)
    if start.startswith(b"MATLAB 5.0 MAT-file") or name.lower().endswith(".mat"):
        return MatlabFile(name, file, is_hdf5=False)
    options = options or CsvOptions()
    if b"\0" in start and not options.encoding and not wide_encoding(start):
        raise BadRecording(f"{name} is none of MDF, MATLAB, Parquet and text",
                           f"Export it in one of these formats; text is named {', '.join(_TEXT)}")
    return CsvFile(name, file, options)
