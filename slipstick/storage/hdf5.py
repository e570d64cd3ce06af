"""Reading untrusted HDF5: hard links only, no data in other files, and sizes are checked before values are read."""

import io
import math
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from slipstick.errors import SlipstickError, quoted

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""The first eight bytes of every HDF5 file."""

_LARGEST_TEXT = 1 << 20  # bytes
_FILTERS = {h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_FLETCHER32}
_KINDS = {"f": "floating point", "i": "integer", "u": "unsigned integer"}
_STORED = {"f": "float64", "i": "int32", "u": "uint32"}
_REMEDY = "Write the file again from the original data"
_READ_ERRORS = (OSError, RuntimeError, ValueError, TypeError, KeyError, OverflowError, MemoryError, zlib.error)


@dataclass(frozen=True)
class Source:
    """An open, untrusted file; every failed check raises `error`.

    `length` is the size of the file in bytes, `largest` the maximum size in bytes of one dataset in memory.
    """

    file: h5py.File
    error: type[SlipstickError]
    length: int
    largest: int

    def has(self, path: str) -> bool:
        """Return whether there is a link at `path`, of any kind."""
        folder, _, name = path.rpartition("/")
        return (not folder or self.has(folder)) and self.group(folder).get(name, getlink=True) is not None

    def has_attribute(self, path: str, name: str) -> bool:
        """Return whether the object at `path` (the file itself for an empty path) has the attribute `name`."""
        return name in self._owner(path).attrs

    def group(self, path: str = "") -> h5py.Group:
        """Return the group at `path`."""
        return self.file if not path else self._member(path, h5py.Group)

    def text(self, path: str) -> str:
        """Return the text in the dataset at `path`, which holds a single one."""
        dataset = self._dataset(path)
        self._require_text(dataset.dtype, dataset.shape, quoted(path))
        return str(np.ravel(dataset.asstr()[()])[0])

    def texts(self, path: str, count: int) -> tuple[str, ...]:
        """Return the texts (`count`) in the dataset at `path`, as the function `texts` makes them."""
        dataset = self._dataset(path)
        if dataset.dtype.kind != "S" or dataset.shape != (count,):
            raise self.error(f"{quoted(path)} does not have {count} texts of fixed length",
                             "Store them as UTF-8 of fixed length, or leave them out")
        self._require_bounded_size(dataset, path)
        return tuple(value.decode() for value in dataset[()].tolist())

    def attribute(self, path: str, name: str) -> str:
        """Return the text attribute `name` of the object at `path` (of the file itself for an empty path)."""
        attributes = self._attributes(path, name)
        stored = attributes.get_id(name)
        self._require_text(stored.dtype, stored.shape, f"the attribute {quoted(name)} of {quoted(path or '/')}")
        value = np.ravel(attributes[name])[0]
        decoded = value.decode() if isinstance(value, bytes) else str(value)
        decoded.encode()  # h5py turns bytes that are no UTF-8 into lone surrogates, which no response can hold
        return decoded

    def number(self, path: str, name: str) -> float:
        """Return the number in the attribute `name` of the object at `path`."""
        attributes = self._attributes(path, name)
        stored = attributes.get_id(name)
        if not _is_single(stored.shape) or stored.dtype.kind not in _KINDS:
            raise self.error(f"The attribute {quoted(name)} of {quoted(path or '/')} is not a single number",
                             "Write it as one integer or floating-point number")
        return float(np.ravel(attributes[name])[0])

    def shape(self, path: str) -> tuple[int, ...]:
        """Return the shape of the dataset at `path`."""
        return tuple(self._dataset(path).shape)

    def array(self, path: str, kind: str, shape: tuple[int | None, ...], unit: str) -> np.ndarray:
        """Return the dataset at `path` in native byte order; its type and size are checked before it is read.

        `kind` lists the allowed numpy kinds ("f", "iu"). An entry None of `shape` allows any length. The attribute
        `units` of the dataset must be `unit`.
        """
        dataset = self._dataset(path)
        if dataset.dtype.kind not in kind or dataset.dtype.itemsize > 8:
            allowed = " or ".join(_KINDS[letter] for letter in kind)
            raise self.error(f"{quoted(path)} is of type {dataset.dtype.name}, not {allowed}",
                             f"Store it as {' or '.join(_STORED[letter] for letter in kind)}")
        # MATLAB has no vectors, but rows and columns.
        is_vector = len(shape) == 1 and dataset.ndim == 2 and 1 in dataset.shape
        stored = (dataset.size,) if is_vector else dataset.shape
        matches = len(shape) == len(stored) and all(
            expected in (None, length) for expected, length in zip(shape, stored, strict=True))
        if not matches:
            expected_shape = "(" + ", ".join("any" if length is None else str(length) for length in shape) + ")"
            raise self.error(f"{quoted(path)} has shape {dataset.shape}, not {expected_shape}",
                             "Store it in this shape")
        stored_unit = self.attribute(path, "units")
        if stored_unit != unit:
            raise self.error(f"{quoted(path)} is in {quoted(stored_unit)}, not in {quoted(unit)}",
                             f"Convert the values and set the attribute 'units' to {quoted(unit)}")
        self._require_bounded_size(dataset, path)
        values: np.ndarray = dataset[()].reshape(stored)
        return values.astype(values.dtype.newbyteorder("="), copy=False)

    def _dataset(self, path: str) -> h5py.Dataset:
        dataset = self._member(path, h5py.Dataset)
        if dataset.is_virtual or dataset.external is not None:
            raise self.error(f"The values of {quoted(path)} are stored in another file or dataset",
                             "Copy them into the dataset itself")
        return dataset

    def _member(self, path: str, kind: type | tuple[type, ...]) -> h5py.Group | h5py.Dataset:
        folder, _, name = path.rpartition("/")
        group = self.group(folder)
        link = group.get(name, getlink=True)
        if link is None:
            raise self.error(f"{quoted(path)} is missing", "Add it to the file, or write the file again from the "
                                                           "original data")
        if not isinstance(link, h5py.HardLink):
            raise self.error(f"{quoted(path)} is a link to another path or file",
                             "Replace the link by a copy of its target")
        member = group[name]
        if not isinstance(member, kind):
            raise self.error(f"{quoted(path)} is a {type(member).__name__.lower()}, which is not allowed here", _REMEDY)
        return member

    def _attributes(self, path: str, name: str) -> h5py.AttributeManager:
        if not self.has_attribute(path, name):
            raise self.error(f"The attribute {quoted(name)} of {quoted(path or '/')} is missing", _REMEDY)
        return self._owner(path).attrs

    def _owner(self, path: str) -> h5py.Group | h5py.Dataset:
        return self._member(path, (h5py.Group, h5py.Dataset)) if path else self.file

    def _require_text(self, dtype: np.dtype, shape: tuple[int, ...], item: str) -> None:
        if h5py.check_string_dtype(dtype) is None or not _is_single(shape) or dtype.itemsize > _LARGEST_TEXT:
            raise self.error(f"{item[0].upper()}{item[1:]} is not a single text of at most 1 MiB", _REMEDY)

    def _require_bounded_size(self, dataset: h5py.Dataset, path: str) -> None:
        """Raise `error` if a dataset would take more than `largest` bytes, or if values are missing."""
        chunk_size = math.prod(dataset.chunks or ()) * dataset.dtype.itemsize
        required = max(dataset.nbytes, chunk_size)
        if required > self.largest:
            raise self.error(f"{quoted(path)} requires {required:,} bytes, more than the limit of {self.largest:,}",
                             "Split the file, or reduce the sampling rate of the signals")
        properties = dataset.id.get_create_plist()
        filters = [properties.get_filter(position)[0] for position in range(properties.get_nfilters())]
        if not _FILTERS.issuperset(filters) or len(set(filters)) < len(filters):
            raise self.error(f"{quoted(path)} uses filters other than shuffle, gzip and fletcher32, or one of them "
                             "twice", "Write the dataset with these filters only, each at most once")
        if h5py.h5z.FILTER_DEFLATE in filters:
            self._require_bounded_chunks(dataset, path, chunk_size, filters)
        elif dataset.id.get_storage_size() < dataset.nbytes or dataset.nbytes > self.length:
            raise self.error(f"{quoted(path)} contains fewer values than its shape {dataset.shape} requires", _REMEDY)

    def _require_bounded_chunks(
        self, dataset: h5py.Dataset, path: str, chunk_size: int, filters: list[int]
    ) -> None:
        # The HDF5 library decompresses a chunk without a size limit: 2 MB on disk can fill 2 GB of memory.
        stored: list[h5py.h5d.StoreInfo] = []
        dataset.id.chunk_iter(stored.append)
        expected = math.prod(-(-n // part) for n, part in zip(dataset.shape, dataset.chunks, strict=True))
        if len(stored) < expected:
            raise self.error(f"{quoted(path)} contains fewer values than its shape {dataset.shape} requires", _REMEDY)
        outer_checksum = 4 if filters.index(h5py.h5z.FILTER_DEFLATE) < len(filters) - 1 else 0
        inner_checksum = 4 if h5py.h5z.FILTER_FLETCHER32 in filters and not outer_checksum else 0
        largest = chunk_size + inner_checksum
        for info in stored:
            if info.filter_mask or info.size > self.length:
                raise self.error(f"{quoted(path)} has a chunk that skips a filter or is larger than the file", _REMEDY)
            compressed = dataset.id.read_direct_chunk(info.chunk_offset)[1]
            compressed = compressed[: len(compressed) - outer_checksum]
            if len(zlib.decompressobj().decompress(compressed, largest + 1)) > largest:
                raise self.error(f"{quoted(path)} has a chunk that decompresses to more than {chunk_size:,} bytes",
                                 _REMEDY)


def _is_single(shape: tuple[int, ...] | None) -> bool:
    """Whether values of this shape are a single value: some programs write it as an array of length 1."""
    return shape is not None and math.prod(shape) == 1


def text(value: str) -> np.ndarray:
    """Return `value` as HDF5 text of fixed length.

    HDF5 stores variable-length text in a heap without checksums, where one flipped bit can make the library hang.
    """
    encoded = value.encode()
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", len(encoded) or 1))


def texts(values: Sequence[str]) -> np.ndarray:
    """Return `values` as HDF5 texts (n,) of fixed length."""
    encoded = [value.encode() for value in values]
    return np.array(encoded, h5py.string_dtype("utf-8", max(map(len, encoded)) or 1))


@contextmanager
def reading(content: Path | bytes, error: type[SlipstickError], largest: int) -> Iterator[Source]:
    """Open a file, or the bytes of one, for reading; errors of the HDF5 library are raised as `error`."""
    length = len(content) if isinstance(content, bytes) else content.stat().st_size
    try:
        with h5py.File(io.BytesIO(content) if isinstance(content, bytes) else content, "r") as file:
            yield Source(file, error, length, largest)
    except _READ_ERRORS as reason:
        message = " ".join(str(reason).split())
        raise error(f"The file is damaged ({message})", "Restore it from a backup or create it again") from reason
