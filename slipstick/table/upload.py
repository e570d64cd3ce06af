"""Tables from elsewhere: verified, and written anew, so that no byte of an untrusted file is stored.

Two forms are read: a table as `Table.save` writes it, which has to match its digests, and a plain table, which any
HDF5 library writes (docs/your_table.md) and which gets its digests here. Without digests, only checksums can tell that
the file is damaged, so all numbers must have them, and no text may be in a heap, which has none.
"""

import io
import json

import h5py
import numpy as np

from slipstick.black_box import BlackBoxDescription, Cases, Input, Quantity
from slipstick.black_box.description import require_name
from slipstick.errors import CorruptTable, InvalidValue, RefusedTable, UnknownName, WrongLayout, quoted
from slipstick.storage.hdf5 import Source, reading
from slipstick.storage.isolated import isolated
from slipstick.table import store
from slipstick.table.axis import Axis
from slipstick.table.grid import Grid
from slipstick.table.subject import input_of
from slipstick.table.table import Table

PLAIN = "slipstick plain table"
"""The attribute `layout` of a plain table."""

_SECONDS = 30  # of processor time
_FAILED = "The table cannot be read: the HDF5 library hangs or crashes, or needs more than 30 s or 4 GB"
_LARGEST = 1 << 30  # bytes of one dataset
_MOST_AXES = 20  # as many as the service takes inputs
_DIMENSION_SCALES = ("DIMENSION_LIST", "REFERENCE_LIST", "DIMENSION_LABELS")
"""Attributes of the HDF5 library itself, which are not read."""
_ROW_MAJOR, _COLUMN_MAJOR = "row_major_order", "column_major_order"
"""Attributes of `times`, of which either names its dimensions as a program with such arrays sees them: C and NumPy, or
Fortran, MATLAB and Julia. HDF5 stores the latter in reverse."""
_CONDITION = "condition"
"""The name of the dimension of `times` along the conditions."""
_REMEDY = "Compare the file with docs/your_table.md"


def verify(content: bytes) -> tuple[str, bytes]:
    """Return the digest of an uploaded table, and the bytes to store; both are made in a limited child process.

    Raises `RefusedTable`.
    """
    digest, _, written = isolated(content, "slipstick.table.upload:rewritten", RefusedTable, _SECONDS, _FAILED
                                  ).partition(b"\n")
    return digest.decode(), written


def rewritten(content: bytes) -> bytes:
    """In the child process: a line with the digest, and the table as `Table.save` writes it."""
    table, file = read(content), io.BytesIO()
    table.write_to(file)
    return table.digest.encode() + b"\n" + file.getvalue()


def read(content: bytes) -> Table:
    """Read and verify the bytes of a table of either form; raises `BadTable`."""
    with reading(content, CorruptTable, _LARGEST) as source:
        layout = source.attribute("", "layout")
        try:
            table = _read_plain(source) if layout == PLAIN else Table.of(source)
        except InvalidValue as error:
            raise CorruptTable(error.cause, error.remedy) from error
    _require_inputs(table)
    return table


def _read_plain(source: Source) -> Grid:
    version = source.number("", "layout_version")
    if version != store.LAYOUT_VERSION:
        raise WrongLayout(f"The table has layout version {version:g}, not {store.LAYOUT_VERSION}", _REMEDY)
    _require_checksums("", source.file)
    source.file.visititems(_require_checksums)
    names = json.loads(source.attribute("axes", "order"))
    if not isinstance(names, list):
        raise CorruptTable("The attribute 'order' of 'axes' is no JSON array of names", _REMEDY)
    for name in names:
        require_name(name)
    axes = tuple(_axis(source, name) for name in names)
    cases = Cases.read(source)
    output = Quantity(source.attribute("", "output"), source.attribute("times", "units"))
    inputs = (Input(axis.name, axis.unit, axis.nominal, axis.lower, axis.upper) for axis in axes)
    machine = BlackBoxDescription(source.attribute("", "title"), tuple(inputs), cases.quantities, output, simulator="")
    times = _times(source, axes, len(cases), output.unit)
    if np.isinf(times).any():
        raise CorruptTable("'times' has values that are infinite", "Write NaN where there is no output")
    origin = source.attribute("", "origin") if "origin" in source.file.attrs else "uploaded as a plain table"
    return Grid(axes, times, np.isnan(times).astype(np.uint8), cases, machine, origin)


def _times(source: Source, axes: tuple[Axis, ...], conditions: int, unit: str) -> np.ndarray:
    """The output (g1, ..., gd, n), whatever the order in which the file has the dimensions."""
    names, lengths = [*(axis.name for axis in axes), _CONDITION], (*(len(axis.values) for axis in axes), conditions)
    stored = _stated_order(source, names) or _order_by_length(source.shape("times"), lengths, names)
    values = source.array("times", "f", tuple(lengths[number] for number in stored), unit)
    return np.ascontiguousarray(values.transpose(np.argsort(stored)), np.float64)


def _stated_order(source: Source, names: list[str]) -> list[int] | None:
    """For each dimension of `times` as HDF5 stores it, its index among the `names`; None if the file names none."""
    stated = [name for name in (_ROW_MAJOR, _COLUMN_MAJOR) if source.has_attribute("times", name)]
    if not stated:
        return None
    dimensions = json.loads(source.attribute("times", stated[0]))
    if len(stated) > 1 or not isinstance(dimensions, list) or sorted(map(str, dimensions)) != sorted(names):
        raise CorruptTable(f"'times' has the attributes {' and '.join(stated)}, of which one would name its dimensions"
                           if len(stated) > 1 else
                           f"The attribute '{stated[0]}' of 'times' does not name the axes and the conditions",
                           f"Give one attribute, '{_ROW_MAJOR}' or '{_COLUMN_MAJOR}', with the names "
                           f"{json.dumps(names)} in the order of the dimensions")
    order = [names.index(name) for name in dimensions]
    return order if stated[0] == _ROW_MAJOR else order[::-1]


def _order_by_length(shape: tuple[int, ...], lengths: tuple[int, ...], names: list[str]) -> list[int]:
    """As `_stated_order`, of dimensions without names: the axes and then the conditions, or the reverse.

    Raises `CorruptTable` where the `shape` fits both.
    """
    order = list(range(len(lengths)))
    if shape != lengths[::-1]:
        return order
    if shape != lengths:
        return order[::-1]
    raise CorruptTable(
        f"The order of the dimensions of 'times' is not known: their lengths {shape} are the same in reverse, in which "
        "MATLAB, Julia and Fortran write them",
        f"Name the dimensions in the order in which your program sees them, {json.dumps(names)}, in the text attribute "
        f"'{_ROW_MAJOR}' (Python, C) or '{_COLUMN_MAJOR}' (MATLAB, Julia, Fortran) of 'times'")


def _axis(source: Source, name: str) -> Axis:
    path = f"axes/{name}"
    return Axis(name, source.array(path, "fiu", (None,), "1").astype(np.float64), source.number(path, "nominal"),
                source.attribute(path, "nominal_units"))


def _require_inputs(table: Table) -> None:
    """Raise unless the axes are inputs of the model or machine, and their multiple 1 the value in it."""
    if len(table.axes) > _MOST_AXES:
        raise CorruptTable(f"The table has {len(table.axes)} axes", f"Give 1 to {_MOST_AXES}")
    for axis in table.axes:
        try:
            differs = input_of(table.model, axis.name) != (axis.unit, axis.nominal)
        except UnknownName as error:
            raise CorruptTable(error.cause, "Build the table with Slipstick, or upload a plain table "
                                            "(docs/your_table.md)") from error
        if differs:
            raise CorruptTable(f"The axis {quoted(axis.name)} differs in its nominal value or unit from the "
                               "parameter of the model",
                               "Build the table with Slipstick, or upload a plain table (docs/your_table.md)")


def _require_checksums(path: str, item: h5py.Group | h5py.Dataset) -> None:
    if isinstance(item, h5py.Dataset) and not item.fletcher32:
        raise CorruptTable(f"{quoted(path)} has no checksums", "Create each dataset with fletcher32 (in h5py: "
                                                          "create_dataset(..., fletcher32=True))")
    for name in item.attrs:
        if item.attrs.get_id(name).dtype.kind == "O" and name not in _DIMENSION_SCALES:
            raise CorruptTable(f"The attribute {quoted(name)} of {quoted(path or '/')} has no fixed length",
                               "Write texts with a fixed length (in h5py: numpy.bytes_(text))")
