"""The layout of a table in HDF5 (in words: tables/README.md), written whole and read without trust."""

import hashlib
import json
from dataclasses import fields
from pathlib import Path

import h5py
import numpy as np

from slipstick.clutch.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.condition_layout import read_conditions, write_conditions
from slipstick.errors import CorruptTable, InvalidValue, SlipstickError, UnknownName, WrongDigest, WrongLayout
from slipstick.hdf5 import SIGNATURE, Source, reading, text
from slipstick.table.axis import Axis

LAYOUT = "slipstick table"
LAYOUT_VERSION = 1
STATUS_MEANINGS = "locked never_locked failed"
"""What the statuses 0, 1, 2 say, after the CF convention `flag_meanings`."""

Content = tuple[tuple[Axis, ...], np.ndarray, np.ndarray, Conditions, Model]
"""Axes, times, status, conditions, model."""

_REBUILD = "Build the table again"
_LARGEST = 1 << 40  # a table is stored unpacked, so its file bounds it


def content_digest(content: Content) -> str:
    """SHA-256 over all that matters and nothing else: not the file's bytes, its name or who wrote it."""
    axes, times, status, conditions, model = content
    hashed = hashlib.sha256(f"{LAYOUT} {LAYOUT_VERSION} {model.digest} {conditions.digest}\n".encode())
    for axis in axes:
        hashed.update(f"{axis.name} {float(axis.nominal)!r} {axis.unit}\n".encode())
    columns = (getattr(conditions, column.name) for column in fields(conditions))
    for array in (*(axis.values for axis in axes), times, status, *columns):
        plain = np.ascontiguousarray(array, dtype=np.dtype(array.dtype).newbyteorder("<"))
        hashed.update(f"{plain.dtype.str} {plain.shape}\n".encode())
        hashed.update(plain.data)
    return hashed.hexdigest()


def save(path: Path, content: Content, digest: str, origin: str) -> None:
    """Write a table to `path`, over whatever is there; the caller replaces files atomically."""
    axes, times, status, conditions, model = content
    spec = json.dumps(model.spec(), sort_keys=True)
    chunk = (1,) * (len(axes) - 1) + times.shape[-2:]
    with h5py.File(path, "w", libver=("v110", "v110")) as file:  # from 1.10 on HDF5 checksums its metadata
        file.attrs["layout_version"] = LAYOUT_VERSION
        _describe(file, layout=LAYOUT, content_digest=digest, origin=origin)
        _describe(file.create_dataset("model", data=text(spec)), digest=model.digest)
        write_conditions(file, conditions)
        _describe(file["conditions"], digest=conditions.digest)
        _describe(file.create_group("axes"), order=json.dumps([axis.name for axis in axes]))
        times_set = file.create_dataset("times", data=times, dtype="<f8", chunks=chunk, fletcher32=True)
        _describe(times_set, units="s", long_name="shifting time")
        status_set = file.create_dataset("status", data=status, dtype="u1", chunks=chunk, fletcher32=True)
        _describe(status_set, units="1", long_name="how the engagement ended", flag_meanings=STATUS_MEANINGS)
        status_set.attrs["flag_values"] = np.arange(3, dtype="u1")
        for position, axis in enumerate(axes):
            scale = file.create_dataset(f"axes/{axis.name}", data=axis.values, dtype="<f8")
            scale.attrs["nominal"] = float(axis.nominal)
            _describe(scale, units="1", long_name=f"multiplier of {axis.name}", nominal_units=axis.unit)
            scale.make_scale(axis.name)
            for dataset in (times_set, status_set):
                dataset.dims[position].label = axis.name
                dataset.dims[position].attach_scale(scale)
        for dataset in (times_set, status_set):
            dataset.dims[len(axes)].label = "condition"


def load(path: Path) -> tuple[Content, str, str]:
    """Read the table at `path`: its content, the content digest it states, its origin.

    Raises `UnknownName` where there is no file, `WrongLayout`, `CorruptTable`, and `WrongDigest` for model
    and conditions; the content digest is the caller's to hold against the content.
    """
    if not path.is_file():
        raise UnknownName.of("table", path.name, [found.name for found in path.parent.glob("*.h5")])
    with path.open("rb") as opened:
        if opened.read(len(SIGNATURE)) != SIGNATURE:
            raise WrongLayout(f"'{path.name}' is not an HDF5 file", "Give a table that `worker build` wrote")
    with reading(path, CorruptTable, _LARGEST) as source:
        _require_layout(source)
        model = _model(source)
        conditions = read_conditions(source)
        if conditions.digest != source.attribute("conditions", "digest"):
            raise WrongDigest("The conditions of the table are not those it was built for", _REBUILD)
        axes = tuple(_axis(source, name) for name in json.loads(source.attribute("axes", "order")))
        shape = (*(len(axis.values) for axis in axes), len(conditions))
        times = source.array("times", "f", shape, "s")
        status = source.array("status", "u", shape, "1")
        if source.attribute("status", "flag_meanings") != STATUS_MEANINGS:
            raise WrongLayout("The statuses of the table have other meanings", _REBUILD)
        content = axes, times, status, conditions, model
        return content, source.attribute("", "content_digest"), source.attribute("", "origin")


def _describe(item: h5py.Group | h5py.Dataset, **attributes: str) -> None:
    for name, value in attributes.items():
        item.attrs[name] = text(value)


def _require_layout(source: Source) -> None:
    if "layout" not in source.file.attrs or source.attribute("", "layout") != LAYOUT:
        raise WrongLayout("The file is not a table", "Give a table that `worker build` wrote")
    version = source.number("", "layout_version")
    if version != LAYOUT_VERSION:
        raise WrongLayout(f"The table has layout version {version:g}, not {LAYOUT_VERSION}", _REBUILD)


def _model(source: Source) -> Model:
    spec, stated = source.text("model"), source.attribute("model", "digest")
    if hashlib.sha256(spec.encode()).hexdigest() != stated:
        raise WrongDigest("The model of the table is not the one it was built with", _REBUILD)
    try:
        model = Model.from_spec(json.loads(spec))
    except SlipstickError as error:
        raise WrongLayout(f"The table's model is unknown here: {error.cause}", _REBUILD) from error
    if model.digest != stated:
        raise WrongDigest("This version of the program gives the table's model another digest", _REBUILD)
    return model


def _axis(source: Source, name: str) -> Axis:
    path = f"axes/{name}"
    values = source.array(path, "f", (None,), "1")
    nominal = source.number(path, "nominal")
    try:
        return Axis(name, values, nominal, source.attribute(path, "nominal_units"))
    except InvalidValue as error:
        raise CorruptTable(error.cause, _REBUILD) from error
