"""MATLAB files: version 5 and 7 read by scipy, version 7.3 by h5py.

A vector is a channel of its name; a column of a matrix is `name(:,2)`, a field of a structure `name.field`, of an array
of structures `name(2).field`, and an element of a cell array `name{2}`, as in MATLAB.
"""

from collections.abc import Iterator
from typing import Any, BinaryIO, cast

import h5py
import numpy as np
import scipy

from slipstick.acquisition.channel import LARGEST, Channel, Listed, unknown_channel, unreadable
from slipstick.errors import BadRecording

_MOST_COLUMNS = 1000
_DEEPEST = 16
"""Levels of structures and cells: references of HDF5 may lead in circles."""
_Vectors = Iterator[tuple[str, np.ndarray | str]]
"""Names with the values (k,), or with the class of an object that cannot be read."""


class MatlabFile:
    """A MATLAB file, all of whose vectors are in memory."""

    def __init__(self, name: str, file: BinaryIO, is_hdf5: bool) -> None:
        self.name = name
        try:
            contents = dict(_of_hdf5(file) if is_hdf5 else _of_scipy(file))
        except Exception as error:  # scipy and h5py raise errors of many kinds on damaged files
            raise unreadable(name, "a MATLAB file", error, "Save it again in MATLAB, or leave it out") from error
        self._vectors = {channel: values for channel, values in contents.items() if isinstance(values, np.ndarray)}
        self._objects = {channel: kind for channel, kind in contents.items() if isinstance(kind, str)}
        self.remarks: tuple[str, ...] = (
            f"MATLAB {'7.3' if is_hdf5 else '5 to 7'}",
            *(f"'{channel}' is {_object(kind)}" for channel, kind in self._objects.items()))

    def listed(self) -> tuple[Listed, ...]:
        """The vectors of more than one number; the files state no units."""
        return tuple(Listed(name, "", len(values)) for name, values in self._vectors.items() if len(values) > 1)

    def channel(self, name: str) -> Channel:
        """One vector."""
        if name in self._vectors:
            return Channel(name, "", self._vectors[name].astype(float))
        whole = name.partition(".")[0].partition("(")[0]
        for channel in (name, whole):
            if channel in self._objects:
                raise BadRecording(f"'{channel}' of {self.name} is {_object(self._objects[channel])}",
                                   f"Save it so in MATLAB, such as {whole}_data = {whole}.Data; "
                                   f"{whole}_time = {whole}.Time of a timeseries, and map these")
        raise unknown_channel(self.name, name, self._vectors)


def _object(kind: str) -> str:
    if kind == "sparse":
        return "a sparse matrix, which is not read: save it as full(...)"
    return f"an object of the MATLAB class {kind}, which other programs cannot read: save its fields as arrays"


def _of_scipy(file: BinaryIO) -> _Vectors:
    for name, value in scipy.io.loadmat(cast(Any, file), squeeze_me=False, struct_as_record=True).items():
        if not name.startswith("__"):
            yield from _vectors(name, value)


def _vectors(name: str, value: Any) -> _Vectors:
    """Vectors in an array, in the fields of structures and in the elements of cells."""
    if not isinstance(value, np.ndarray) or isinstance(value, scipy.io.matlab.MatlabFunction):
        return
    elements = value.reshape(-1, order="F")
    if isinstance(value, scipy.io.matlab.MatlabObject):
        yield name, str(value.classname)
    elif isinstance(value, scipy.io.matlab.MatlabOpaque):
        for element in elements:  # its variable is named in the object, and nowhere else
            stated, kind = (text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
                            for text in (element["s0"], element["s2"]))
            yield stated or name, kind
    elif value.dtype.names:
        for position, element in enumerate(elements, 1):
            place = name if value.size == 1 else f"{name}({position})"
            for field in value.dtype.names:
                yield from _vectors(f"{place}.{field}", element[field])
    elif value.dtype.kind == "O":
        for position, element in enumerate(elements, 1):
            yield from _vectors(f"{name}{{{position}}}", element)
    elif value.dtype.kind in "fiub" and value.ndim <= 2:
        yield from _columns(name, value)


def _of_hdf5(file: BinaryIO) -> _Vectors:
    with h5py.File(file, "r") as content:
        yield from _of_group("", content, 0)


def _of_group(prefix: str, group: h5py.Group, depth: int) -> _Vectors:
    for name in group:
        # Names with # are MATLAB's own; links other than hard ones could lead to other files.
        if not name.startswith("#") and isinstance(group.get(name, getlink=True), h5py.HardLink):
            yield from _of_item(prefix, name, group[name], depth)


def _of_item(prefix: str, name: str, item: h5py.Group | h5py.Dataset, depth: int) -> _Vectors:
    """Vectors of a group or dataset `name`; the fields of an array of structures refer to a value for each element."""
    if depth > _DEEPEST:
        return
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if "MATLAB_object_decode" in item.attrs:
        yield f"{prefix}{name}", kind
    elif "MATLAB_sparse" in item.attrs:
        yield f"{prefix}{name}", "sparse"
    elif item.attrs.get("MATLAB_empty", 0):
        return  # its values are the dimensions of what is empty
    elif isinstance(item, h5py.Group):
        yield from _of_group(f"{prefix}{name}.", item, depth + 1)
    elif item.is_virtual or item.external is not None or item.ndim > 2 or kind == "char":
        return
    elif item.dtype == h5py.ref_dtype:
        if item.size > _MOST_COLUMNS:
            return
        for position, reference in enumerate(item[()].reshape(-1), 1):
            if reference:
                place = f"{prefix}{name}{{{position}}}" if kind == "cell" else f"{prefix[:-1]}({position}).{name}"
                yield from _of_item("", place, item.file[reference], depth + 1)
    elif item.dtype.kind in "fiub":
        if item.size > LARGEST:
            raise ValueError(f"'{prefix}{name}' has {item.size:,} values, more than {LARGEST:,}")
        yield from _columns(f"{prefix}{name}", item[()].T if item.ndim == 2 else item[()].reshape(-1, 1))


def _columns(name: str, values: np.ndarray) -> _Vectors:
    if values.ndim < 2 or 1 in values.shape:
        yield name, values.reshape(-1)
    elif values.shape[1] <= _MOST_COLUMNS:
        yield from ((f"{name}(:,{column + 1})", values[:, column]) for column in range(values.shape[1]))
