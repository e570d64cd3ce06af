"""HDF5 read without trust: hard links only, no data of other files, no claimed size taken on faith."""

import io
import math
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from slipstick.errors import SlipstickError

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""The first eight bytes of every HDF5 file."""

_LARGEST_TEXT = 1 << 20
_FILTERS = {h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_FLETCHER32}
_KINDS = {"f": "floating point", "i": "integer", "u": "unsigned"}
_REMEDY = "Write the file again from its source"
_STUMBLES = (OSError, RuntimeError, ValueError, TypeError, KeyError, OverflowError, MemoryError, zlib.error)


@dataclass(frozen=True)
class Source:
    """An open file that is not trusted; `error` is what every refusal raises.

    `length` is the size of the file in bytes, `largest` the most bytes one dataset may fill once read.
    """

    file: h5py.File
    error: type[SlipstickError]
    length: int
    largest: int

    def has(self, path: str) -> bool:
        """Say whether `path` leads anywhere, by a link of whatever kind."""
        folder, _, name = path.rpartition("/")
        return (not folder or self.has(folder)) and self.group(folder).get(name, getlink=True) is not None

    def group(self, path: str = "") -> h5py.Group:
        """Return the group at `path`."""
        return self.file if not path else self._member(path, h5py.Group)

    def text(self, path: str) -> str:
        """Return the text in the scalar dataset at `path`."""
        dataset = self._dataset(path)
        self._require_text(dataset.dtype, dataset.shape, f"'{path}'")
        return str(dataset.asstr()[()])

    def attribute(self, path: str, name: str) -> str:
        """Return the text attribute `name` of the object at `path` (of the file itself for an empty path)."""
        attributes = self._attributes(path, name)
        stored = attributes.get_id(name)
        self._require_text(stored.dtype, stored.shape, f"the attribute '{name}' of '{path or '/'}'")
        value = attributes[name]
        return value.decode() if isinstance(value, bytes) else str(value)

    def number(self, path: str, name: str) -> float:
        """Return the number in the attribute `name` of the object at `path`."""
        attributes = self._attributes(path, name)
        stored = attributes.get_id(name)
        if stored.shape != () or stored.dtype.kind not in _KINDS:
            raise self.error(f"The attribute '{name}' of '{path or '/'}' is not a number", _REMEDY)
        return float(attributes[name])

    def array(self, path: str, kind: str, shape: tuple[int | None, ...], unit: str) -> np.ndarray:
        """Return the dataset at `path` in native byte order, its size and kind checked before it is read.

        `kind` holds the numpy kinds allowed ("f", "iu"), `shape` None where any length will do, and the
        attribute `units` of the dataset must be `unit`.
        """
        dataset = self._dataset(path)
        if dataset.dtype.kind not in kind or dataset.dtype.itemsize > 8:
            wanted = " or ".join(_KINDS[letter] for letter in kind)
            raise self.error(f"'{path}' is of type {dataset.dtype}, not {wanted}", _REMEDY)
        fits = len(shape) == dataset.ndim and all(
            want in (None, have) for want, have in zip(shape, dataset.shape, strict=True))
        if not fits:
            wanted = "(" + ", ".join("any" if want is None else str(want) for want in shape) + ")"
            raise self.error(f"'{path}' has shape {dataset.shape}, not {wanted}", _REMEDY)
        found = self.attribute(path, "units")
        if found != unit:
            raise self.error(f"'{path}' is in '{found}', not in '{unit}'", "Convert the values")
        self._require_honest_size(dataset, path)
        values: np.ndarray = dataset[()]
        return values.astype(values.dtype.newbyteorder("="), copy=False)

    def _dataset(self, path: str) -> h5py.Dataset:
        dataset = self._member(path, h5py.Dataset)
        if dataset.is_virtual or dataset.external is not None:
            raise self.error(f"The values of '{path}' lie in another file", "Copy them into the file itself")
        return dataset

    def _member(self, path: str, kind: type | tuple[type, ...]) -> h5py.Group | h5py.Dataset:
        folder, _, name = path.rpartition("/")
        group = self.group(folder)
        link = group.get(name, getlink=True)
        if link is None:
            raise self.error(f"'{path}' is missing", _REMEDY)
        if not isinstance(link, h5py.HardLink):
            raise self.error(f"'{path}' is a link to somewhere else", "Copy its target into the file itself")
        member = group[name]
        if not isinstance(member, kind):
            raise self.error(f"'{path}' is a {type(member).__name__.lower()}, which is out of place", _REMEDY)
        return member

    def _attributes(self, path: str, name: str) -> h5py.AttributeManager:
        owner = self._member(path, (h5py.Group, h5py.Dataset)) if path else self.file
        if name not in owner.attrs:
            raise self.error(f"The attribute '{name}' of '{path or '/'}' is missing", _REMEDY)
        return owner.attrs

    def _require_text(self, dtype: np.dtype, shape: tuple[int, ...], where: str) -> None:
        if h5py.check_string_dtype(dtype) is None or shape != () or dtype.itemsize > _LARGEST_TEXT:
            raise self.error(f"{where[0].upper()}{where[1:]} is not a text", _REMEDY)

    def _require_honest_size(self, dataset: h5py.Dataset, path: str) -> None:
        """Refuse a dataset that would fill more memory than it may, or holds less than it claims."""
        chunk = math.prod(dataset.chunks or ()) * dataset.dtype.itemsize
        claimed = max(dataset.nbytes, chunk)
        if claimed > self.largest:
            raise self.error(f"'{path}' claims {claimed:,} bytes, more than {self.largest:,}",
                             "Split the file, or thin out its signals")
        properties = dataset.id.get_create_plist()
        filters = [properties.get_filter(position)[0] for position in range(properties.get_nfilters())]
        if not _FILTERS.issuperset(filters) or len(set(filters)) < len(filters):
            raise self.error(f"'{path}' is stored through filters other than shuffle, gzip and fletcher32",
                             "Write it with at most these, each once")
        if h5py.h5z.FILTER_DEFLATE in filters:
            self._require_honest_chunks(dataset, path, chunk, filters)
        elif dataset.id.get_storage_size() < dataset.nbytes or dataset.nbytes > self.length:
            raise self.error(f"'{path}' holds less than its shape {dataset.shape} claims", _REMEDY)

    def _require_honest_chunks(
        self, dataset: h5py.Dataset, path: str, chunk: int, filters: list[int]
    ) -> None:
        # HDF5 itself inflates a chunk without end: 2 MB on disk can fill 2 GB of memory.
        stored: list[h5py.h5d.StoreInfo] = []
        dataset.id.chunk_iter(stored.append)
        expected = math.prod(-(-n // part) for n, part in zip(dataset.shape, dataset.chunks, strict=True))
        if len(stored) < expected:
            raise self.error(f"'{path}' holds less than its shape {dataset.shape} claims", _REMEDY)
        checksum = 4 if filters.index(h5py.h5z.FILTER_DEFLATE) < len(filters) - 1 else 0
        inside = 4 if h5py.h5z.FILTER_FLETCHER32 in filters and not checksum else 0
        for info in stored:
            if info.filter_mask or info.size > self.length:
                raise self.error(f"'{path}' has a chunk that claims more than the file holds", _REMEDY)
            packed = dataset.id.read_direct_chunk(info.chunk_offset)[1]
            unpacker = zlib.decompressobj()
            inflated = unpacker.decompress(packed[: len(packed) - checksum], chunk + inside + 1)
            if len(inflated) > chunk + inside:
                raise self.error(f"'{path}' has a chunk that inflates to more than its shape claims", _REMEDY)


def text(value: str) -> np.ndarray:
    """`value` as HDF5 text of fixed length.

    Text of variable length lies in a heap without checksums, where one flipped bit can hang the HDF5 library.
    """
    encoded = value.encode()
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", len(encoded) or 1))


@contextmanager
def reading(content: Path | bytes, error: type[SlipstickError], largest: int) -> Iterator[Source]:
    """Open a file, or the bytes of one, for reading; whatever HDF5 stumbles over comes out as `error`."""
    length = len(content) if isinstance(content, bytes) else content.stat().st_size
    try:
        with h5py.File(io.BytesIO(content) if isinstance(content, bytes) else content, "r") as file:
            yield Source(file, error, length, largest)
    except _STUMBLES as reason:
        said = " ".join(str(reason).split())
        raise error(f"The file is damaged ({said})", "Restore it from a copy or make it again") from reason
