"""Tables from elsewhere: verified, and written anew, so that no byte of an untrusted file is stored.

Two forms are read: a table as `Table.write` writes it, which has to match its digests, and a plain table, which any
HDF5 library writes (docs/your_table.md) and which gets its digests here. Without digests, only checksums can tell that
the file is damaged, so all numbers must have them, and no text may be in a heap, which has none.
"""

import io
import json
import re

import h5py
import numpy as np

from slipstick.bench import parameters
from slipstick.clutch.model import Model
from slipstick.errors import CorruptTable, InvalidValue, RefusedTable, WrongLayout
from slipstick.storage.condition_layout import read_conditions
from slipstick.storage.hdf5 import Source, reading
from slipstick.storage.isolated import isolated
from slipstick.table import store
from slipstick.table.axis import Axis
from slipstick.table.foreign import ForeignModel
from slipstick.table.grid import Grid
from slipstick.table.table import Table

PLAIN = "slipstick plain table"
"""The attribute `layout` of a plain table."""

_SECONDS = 30  # of processor time
_FAILED = "The table cannot be read: the HDF5 library hangs or crashes, or needs more than 30 s or 4 GB"
_LARGEST = 1 << 30  # bytes of one dataset
_LONGEST_UNIT = 64
_MOST_AXES = 20  # as many as the service takes inputs
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_DIMENSION_SCALES = ("DIMENSION_LIST", "REFERENCE_LIST", "DIMENSION_LABELS")
"""Attributes of the HDF5 library itself, which are not read."""
_REMEDY = "Compare the file with docs/your_table.md"


def verified(content: bytes) -> tuple[str, bytes]:
    """Return the digest of an uploaded table, and the bytes to store; both are made in a limited child process.

    Raises `RefusedTable`.
    """
    digest, _, written = isolated(content, "slipstick.table.upload:rewritten", RefusedTable, _SECONDS, _FAILED
                                  ).partition(b"\n")
    return digest.decode(), written


def rewritten(content: bytes) -> bytes:
    """In the child process: a line with the digest, and the table as `Table.write` writes it."""
    table, file = read(content), io.BytesIO()
    table.write_to(file)
    return table.digest.encode() + b"\n" + file.getvalue()


def read(content: bytes) -> Table:
    """Read and verify the bytes of a table of either form; raises `BadTable`."""
    with reading(content, CorruptTable, _LARGEST) as source:
        layout = source.attribute("", "layout")
        try:
            table = _plain(source) if layout == PLAIN else Table.of(source)
        except InvalidValue as error:
            raise CorruptTable(error.cause, error.remedy) from error
    _require_names([axis.name for axis in table.axes])
    if not isinstance(table.model, ForeignModel):
        _require_parameters(table.axes, table.model)
    return table


def _plain(source: Source) -> Grid:
    version = source.number("", "layout_version")
    if version != store.LAYOUT_VERSION:
        raise WrongLayout(f"The table has layout version {version:g}, not {store.LAYOUT_VERSION}", _REMEDY)
    _require_checksums("", source.file)
    source.file.visititems(_require_checksums)
    names = json.loads(source.attribute("axes", "order"))
    if not isinstance(names, list):
        raise CorruptTable("The attribute 'order' of 'axes' is no JSON array of names", _REMEDY)
    _require_names(names)
    axes = tuple(_axis(source, name) for name in names)
    conditions = read_conditions(source)
    times = source.array("times", "f", (*(len(axis.values) for axis in axes), len(conditions)), "s").astype(np.float64)
    if np.isinf(times).any() or np.any(times <= 0):
        raise CorruptTable("'times' has values that are infinite or not positive",
                           "Give positive times, and NaN where there is none")
    origin = source.attribute("", "origin") if "origin" in source.file.attrs else "uploaded as a plain table"
    return Grid(axes, times, np.isnan(times).astype(np.uint8), conditions, ForeignModel(source.attribute("", "model")),
                origin)


def _axis(source: Source, name: str) -> Axis:
    path = f"axes/{name}"
    unit = source.attribute(path, "nominal_units")
    if not 1 <= len(unit) <= _LONGEST_UNIT or not unit.isprintable():
        raise CorruptTable(f"The attribute 'nominal_units' of '{path}' is no unit", "Give a unit, or 1 if it has none")
    return Axis(name, source.array(path, "fiu", (None,), "1").astype(np.float64), source.number(path, "nominal"), unit)


def _require_names(names: list[str]) -> None:
    if not 1 <= len(names) <= _MOST_AXES:
        raise CorruptTable(f"The table has {len(names)} axes", f"Give 1 to {_MOST_AXES}")
    for name in names:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise CorruptTable(f"{str(name)[:100]!r} is no name of an axis",
                               "Use up to 64 letters, digits and _, starting with a letter")


def _require_parameters(axes: tuple[Axis, ...], model: Model) -> None:
    """Raise unless the axes are parameters of the model, and their multiple 1 the value in it."""
    units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
    nominal = dict(zip(parameters.NAMES, model.parameters, strict=True))
    for axis in axes:
        if (nominal.get(axis.name), units.get(axis.name)) != (axis.nominal, axis.unit):
            raise CorruptTable(f"The axis '{axis.name}' is no parameter of the model, or differs from it in its value "
                               "or unit", "Build the table with Slipstick, or upload a plain table "
                                                "(docs/your_table.md)")


def _require_checksums(path: str, item: h5py.Group | h5py.Dataset) -> None:
    if isinstance(item, h5py.Dataset) and not item.fletcher32:
        raise CorruptTable(f"'{path}' has no checksums", "Create each dataset with fletcher32 (in h5py: "
                                                          "create_dataset(..., fletcher32=True))")
    for name in item.attrs:
        if item.attrs.get_id(name).dtype.kind == "O" and name not in _DIMENSION_SCALES:
            raise CorruptTable(f"The attribute '{name}' of '{path or '/'}' has no fixed length",
                               "Write texts with a fixed length (in h5py: numpy.bytes_(text))")
