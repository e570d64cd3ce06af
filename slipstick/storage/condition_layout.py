"""HDF5 layout of conditions: groups, names and units are the same in tables and in recordings."""

import h5py
import numpy as np

from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS, PROFILE_UNITS, Conditions
from slipstick.errors import InvalidValue
from slipstick.storage.hdf5 import Source, text

RUN_ORDER = "conditions/run_order"
"""Path of the optional dataset of the run order, unit 1."""


def read_conditions(source: Source) -> Conditions:
    """Read the groups `conditions`, with the run order if present, and `current_profiles`; raises `source.error`."""
    columns: list[np.ndarray] = []
    length: int | None = None
    for name, unit in CONDITION_UNITS.items():
        column = source.array(f"conditions/{name}", "iu" if unit == "1" else "fiu", (length,), unit)
        invalid = np.flatnonzero(~np.isfinite(column) | (column < 0))
        if len(invalid):
            raise source.error(f"'conditions/{name}' of condition {invalid[0]} is {column[invalid[0]]:g}",
                               "Give a finite, non-negative number; conditions are numbered from 0")
        columns.append(column.astype(np.int64 if unit == "1" else np.float64))
        length = len(column)
    order = source.array(RUN_ORDER, "iu", (length,), "1").astype(np.int64) if source.has(RUN_ORDER) else None
    given = {name: source.array(f"conditions/{name}", "fiu", (length,), unit).astype(np.float64)
             for name, unit in INPUT_UNITS.items() if source.has(f"conditions/{name}")}
    time, current = [source.array(f"current_profiles/{name}", "fiu", (None, None), unit).astype(np.float64)
                     for name, unit in PROFILE_UNITS.items()]
    path = "current_profiles/input_torque"
    varying = source.array(path, "fiu", time.shape, "N m").astype(np.float64) if source.has(path) else None
    try:
        profile, speed, inertia, brake = columns
        return Conditions(profile, speed, inertia, brake, time, current, order, **given,
                          profile_input_torque=varying)
    except InvalidValue as error:
        raise source.error(error.cause, error.remedy) from error


def write_conditions(file: h5py.File, conditions: Conditions) -> None:
    """Write the groups `conditions`, with the run order if it is known, and `current_profiles`."""
    for name, unit in CONDITION_UNITS.items():
        _write(file, f"conditions/{name}", getattr(conditions, name), unit)
    for name, unit in INPUT_UNITS.items():
        if (column := getattr(conditions, name)) is not None:
            _write(file, f"conditions/{name}", column, unit)
    if conditions.run_order is not None:
        _write(file, RUN_ORDER, conditions.run_order.astype(np.int64), "1")
    for name, unit in PROFILE_UNITS.items():
        _write(file, f"current_profiles/{name}", getattr(conditions, f"profile_{name}"), unit)
    if conditions.profile_input_torque is not None:
        _write(file, "current_profiles/input_torque", conditions.profile_input_torque, "N m")


def _write(file: h5py.File, path: str, values: np.ndarray, unit: str) -> None:
    file.create_dataset(path, data=values, chunks=values.shape, fletcher32=True).attrs["units"] = text(unit)
