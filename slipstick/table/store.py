"""The part of the HDF5 layout that all tables share (described in tables/README.md); files are not trusted."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TypedDict

import h5py
import numpy as np

from slipstick.errors import CorruptTable, InvalidValue, SlipstickError, UnknownName, WrongDigest, WrongLayout
from slipstick.storage.hdf5 import SIGNATURE, Source, reading, text
from slipstick.table.axis import Axis
from slipstick.table.subject import Setting, Subject, read_setting, subject_of, write_setting

LAYOUT_VERSION = 1
REBUILD = "Build the table again"
_LARGEST = 1 << 40  # bytes; tables are stored uncompressed, so the size of the file limits that of its datasets


class Header(TypedDict):
    """The fields that every table has besides its arrays."""

    axes: tuple[Axis, ...]
    conditions: Setting
    model: Subject
    origin: str


def content_digest(layout: str, axes: Sequence[Axis], arrays: Sequence[np.ndarray], conditions: Setting,
                   model: Subject) -> str:
    """SHA-256 of the content of a table, independent of the bytes, name and origin of its file.

    The run order is included if an effect of the model depends on it.
    """
    hashed = hashlib.sha256(f"{layout} {LAYOUT_VERSION} {model.digest} {conditions.digest}\n".encode())
    for axis in axes:
        hashed.update(f"{axis.name} {float(axis.nominal)!r} {axis.unit}\n".encode())
    for array in (*(axis.values for axis in axes), *arrays, *conditions.columns(model.uses_run_order)):
        little_endian = np.ascontiguousarray(array, dtype=np.dtype(array.dtype).newbyteorder("<"))
        hashed.update(f"{little_endian.dtype.str} {little_endian.shape}\n".encode())
        hashed.update(little_endian.data)
    return hashed.hexdigest()


def write_header(file: h5py.File, layout: str, digest: str, origin: str, axes: Sequence[Axis],
                 conditions: Setting, model: Subject) -> None:
    """Write layout, digest and origin as attributes of the file, and the model, conditions and axes."""
    file.attrs["layout_version"] = LAYOUT_VERSION
    describe(file, layout=layout, content_digest=digest, origin=origin)
    spec = json.dumps(model.spec(), sort_keys=True)
    describe(file.create_dataset("model", data=text(spec)), digest=model.digest)
    write_setting(file, conditions, model)
    describe(file["conditions"], digest=conditions.digest)
    describe(file.create_group("axes"), order=json.dumps([axis.name for axis in axes]))
    for axis in axes:
        scale = file.create_dataset(f"axes/{axis.name}", data=axis.values, dtype="<f8")
        scale.attrs["nominal"] = float(axis.nominal)
        describe(scale, units="1", long_name=f"multiplier of {axis.name}", nominal_units=axis.unit)
        scale.make_scale(axis.name)


@contextmanager
def open_source(path: Path) -> Iterator[Source]:
    """Open the file at `path`; raises `UnknownName` if it does not exist, `WrongLayout` if it is not HDF5."""
    if not path.is_file():
        raise UnknownName.of("table", path.name, [other.name for other in path.parent.glob("*.h5")])
    with path.open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise WrongLayout(f"'{path.name}' is not an HDF5 file",
                              "Give a table written by `slipstick build` or `slipstick surrogate`")
    with reading(path, CorruptTable, _LARGEST) as source:
        yield source


def read_header(source: Source) -> Header:
    """Read the header except the content digest, which the caller compares with the content.

    Raises `WrongLayout`, `CorruptTable`, and `WrongDigest` if the model or the conditions do not match their digests.
    """
    version = source.number("", "layout_version")
    if version != LAYOUT_VERSION:
        raise WrongLayout(f"The table has layout version {version:g}, not {LAYOUT_VERSION}", REBUILD)
    model = _model(source)
    conditions = read_setting(source, model)
    if conditions.digest != source.attribute("conditions", "digest"):
        raise WrongDigest("The conditions of the table do not match their digest", REBUILD)
    axes = tuple(_axis(source, name) for name in json.loads(source.attribute("axes", "order")))
    return {"axes": axes, "conditions": conditions, "model": model, "origin": source.attribute("", "origin")}


def describe(item: h5py.Group | h5py.Dataset, **attributes: str) -> None:
    """Set text attributes of `item`."""
    for name, value in attributes.items():
        item.attrs[name] = text(value)


def _model(source: Source) -> Subject:
    spec, stored_digest = source.text("model"), source.attribute("model", "digest")
    if hashlib.sha256(spec.encode()).hexdigest() != stored_digest:
        raise WrongDigest("The model of the table does not match its digest", REBUILD)
    try:
        model = subject_of(json.loads(spec))
    except SlipstickError as error:
        raise WrongLayout(f"This version of Slipstick cannot read the model of the table: {error.cause}",
                          REBUILD) from error
    if model.digest != stored_digest:
        raise WrongDigest("This version of Slipstick computes another digest of the model of the table", REBUILD)
    return model


def _axis(source: Source, name: str) -> Axis:
    path = f"axes/{name}"
    values = source.array(path, "f", (None,), "1")
    nominal = source.number(path, "nominal")
    try:
        return Axis(name, values, nominal, source.attribute(path, "nominal_units"))
    except InvalidValue as error:
        raise CorruptTable(error.cause, REBUILD) from error
