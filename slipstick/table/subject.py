"""What a table is about: a clutch on a bench, or any other machine."""

from dataclasses import replace
from typing import Any

import h5py

from slipstick.bench import parameters
from slipstick.bench.conditions import CONDITION_UNITS, Conditions
from slipstick.black_box import BlackBoxDescription, Cases, Quantity
from slipstick.clutch.model import Model
from slipstick.storage.condition_layout import read_conditions, write_conditions
from slipstick.storage.hdf5 import Source

Subject = Model | BlackBoxDescription
"""What was simulated."""
Setting = Conditions | Cases
"""Under which conditions."""


def subject_of(spec: dict[str, Any]) -> Subject:
    """The model or machine of a spec; raises `InvalidValue`, `UnknownName`."""
    is_black_box = isinstance(spec, dict) and "machine" in spec
    return BlackBoxDescription.from_spec(spec) if is_black_box else Model.from_spec(spec)


def input_of(subject: Subject, name: str) -> tuple[str, float]:
    """Unit and nominal value of an input, a parameter of a clutch; raises `UnknownName`."""
    if isinstance(subject, BlackBoxDescription):
        quantity = subject.input(name)
        return quantity.unit, quantity.nominal
    row = parameters.index(name)
    return parameters.PARAMETERS[row].unit, float(subject.parameters[row])


def output_of(subject: Subject) -> Quantity:
    """Name and unit of the values of a table."""
    return subject.output if isinstance(subject, BlackBoxDescription) else Quantity("shifting_time", "s")


def write_setting(file: h5py.File, setting: Setting, subject: Subject) -> None:
    """Write the conditions, with the run order only if the model depends on it."""
    if isinstance(setting, Cases):
        setting.write(file)
    else:
        write_conditions(file, setting if subject.uses_run_order else replace(setting, run_order=None))


def read_setting(source: Source, subject: Subject) -> Setting:
    """Read the conditions; raises `source.error`."""
    if not isinstance(subject, BlackBoxDescription):
        return read_conditions(source)
    cases = Cases.read(source)
    if cases.quantities != subject.columns:
        raise source.error("The conditions are not the columns of the machine", "Build the table again")
    return cases


def keys(setting: Setting, with_run_order: bool) -> list[str]:
    """Keys that identify conditions by their values to five digits, the precision of a file written by hand.

    If `with_run_order`, the position in the run order is part of the key.
    """
    if isinstance(setting, Cases):
        return setting.keys
    profiles = [" ".join(f"{value:.5g}" for value in (*time, *current))
                for time, current in zip(setting.profile_time, setting.profile_current, strict=True)]
    order = setting.run_order if with_run_order else None
    positions = [""] * len(setting) if order is None else [f"{position:.0f}" for position in order]
    rows = zip(setting.current_profile, setting.motor_speed, setting.load_inertia, setting.brake_torque, positions,
               strict=True)
    return [f"{speed:.5g} {inertia:.5g} {brake:.5g} {profiles[profile]} {position}"
            for profile, speed, inertia, brake, position in rows]


def columns(setting: Setting) -> dict[str, list[float]]:
    """The columns of the conditions for pictures, which describe them in words (slipstick/pictures/conditions.py).

    Those of another machine have their units in the name, as in "voltage [V]".
    """
    if isinstance(setting, Cases):
        return {f"{quantity.name} [{quantity.unit}]": column.tolist()
                for quantity, column in zip(setting.quantities, setting.values.T, strict=True)}
    return {name: getattr(setting, name).tolist() for name in CONDITION_UNITS}


def described(setting: Setting, row: int) -> str:
    """A condition in words."""
    if isinstance(setting, Cases):
        return setting.described(row)
    return (f"{setting.motor_speed[row]:g} rad/s, {setting.load_inertia[row]:g} kg m², "
            f"{setting.brake_torque[row]:g} N m")
