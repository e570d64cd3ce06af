"""MATLAB files: version 5 and 7 read by scipy, version 7.3 by h5py.

A vector is a channel of its name; a column of a matrix is `name(:,2)` and a field of a structure `name.field`, as in
MATLAB.
"""

from collections.abc import Iterator
from typing import Any, BinaryIO, cast

import h5py
import numpy as np
import scipy

from slipstick.acquisition.channel import LARGEST, Channel, Listed, unknown_channel, unreadable

_MOST_COLUMNS = 1000


class MatlabFile:
    """A MATLAB file, all of whose vectors are in memory."""

    def __init__(self, name: str, file: BinaryIO, is_hdf5: bool) -> None:
        self.name = name
        try:
            self._vectors = dict(_of_hdf5(file) if is_hdf5 else _of_scipy(file))
            file.seek(0)
            objects = _objects_in_hdf5(file) if is_hdf5 else _objects_in_scipy(file)
        except Exception as error:  # scipy and h5py raise errors of many kinds on damaged files
            raise unreadable(name, "a MATLAB file", error, "Save it again in MATLAB, or leave it out") from error
        self.remarks: tuple[str, ...] = (
            f"MATLAB {'7.3' if is_hdf5 else '5 to 7'}",
            *(f"{one} is an object of a MATLAB class, such as a timeseries or a table, which other programs cannot "
              "read: save its fields as arrays" for one in objects))

    def listed(self) -> tuple[Listed, ...]:
        """The vectors of more than one number; the files state no units."""
        return tuple(Listed(name, "", len(values)) for name, values in self._vectors.items() if len(values) > 1)

    def channel(self, name: str) -> Channel:
        """One vector."""
        if name not in self._vectors:
            raise unknown_channel(self.name, name, self._vectors)
        return Channel(name, "", self._vectors[name].astype(float))


def _of_scipy(file: BinaryIO) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in scipy.io.loadmat(cast(Any, file), squeeze_me=False, struct_as_record=True).items():
        if not name.startswith("__"):
            yield from _vectors(name, value)


def _objects_in_scipy(file: BinaryIO) -> list[str]:
    """Variables that are objects; the format keeps no name of those of newer classes."""
    return [f"'{name}'" if kind == "object" else "a variable" for name, _, kind in scipy.io.whosmat(cast(Any, file))
            if kind in ("object", "opaque")]


def _objects_in_hdf5(file: BinaryIO) -> list[str]:
    with h5py.File(file, "r") as content:
        return [f"'{name}'" for name in content if isinstance(content.get(name, getlink=True), h5py.HardLink)
                and "MATLAB_object_decode" in content[name].attrs]


def _vectors(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Vectors in an array or in the fields of a structure."""
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            yield from _vectors(f"{name}.{field}", value.reshape(-1)[0][field])
    elif value.dtype.kind in "fiub" and value.ndim <= 2:
        yield from _columns(name, value)


def _of_hdf5(file: BinaryIO) -> Iterator[tuple[str, np.ndarray]]:
    with h5py.File(file, "r") as content:
        yield from _of_group("", content)


def _of_group(prefix: str, group: h5py.Group) -> Iterator[tuple[str, np.ndarray]]:
    for name in group:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue  # MATLAB's own references; other links could lead to other files
        item = group[name]
        if isinstance(item, h5py.Group):
            yield from _of_group(f"{prefix}{name}.", item)
        elif item.dtype.kind in "fiub" and item.ndim <= 2 and not item.is_virtual and item.external is None and \
                item.attrs.get("MATLAB_class", b"double") != b"char" and "MATLAB_object_decode" not in item.attrs:
            if item.size > LARGEST:
                raise ValueError(f"'{prefix}{name}' has {item.size:,} values, more than {LARGEST:,}")
            yield from _columns(f"{prefix}{name}", item[()].T if item.ndim == 2 else item[()].reshape(-1, 1))


def _columns(name: str, values: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    if values.ndim < 2 or 1 in values.shape:
        yield name, values.reshape(-1)
    elif values.shape[1] <= _MOST_COLUMNS:
        yield from ((f"{name}(:,{column + 1})", values[:, column]) for column in range(values.shape[1]))
