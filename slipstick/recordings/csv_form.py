"""Recordings as CSV: a file with one row per condition, and optionally a second file with the signals.

The first row names the columns with their units, any unit of the right dimension: `current_profile` (from 0, one of the
current profiles that are given beside the file), `motor_speed [rad/s]`, `load_inertia [kg m^2]`, `brake_torque [N m]`,
`shifting_time [s]` and optionally `run_order`. The signals file has one row per sample: `condition` (row index in the
first file, from 0), `time [s]`, and those of `pressure [bar]`, `input_speed [rad/s]`, `output_speed [rad/s]` and
`output_torque [N m]` that were measured, sorted by condition, with the same times for every condition. Lines starting
with # before the column names are the description of the recordings. Row numbers in error messages are line numbers of
the file, from 1.
"""

import numpy as np

from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS, Conditions
from slipstick.errors import BadRecording, InvalidValue
from slipstick.recordings.hdf5_form import Fields
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.storage.sheet import Sheet

Profiles = tuple[np.ndarray, ...]
"""Times in s, currents in A and, where it is given, input torques in N m of the current profiles: (p, k) each."""
_OPTIONAL = {"run_order": "1", **INPUT_UNITS}


def read(content: bytes, signals: bytes | None, profiles: Profiles) -> Fields:
    """Read recordings from the bytes of the conditions file and of the `signals` file; raises `BadRecording`."""
    sheet = Sheet.read(content, "recordings", {**CONDITION_UNITS, "shifting_time": "s"}, _OPTIONAL, BadRecording)
    conditions = _conditions(sheet, profiles)
    measured_time = _shifting_times(sheet, conditions)
    sampled = None if signals is None else _signals(signals, len(measured_time))
    return conditions, measured_time, sampled, conditions.run_order, sheet.remarks, {}


def read_conditions(content: bytes, profiles: Profiles) -> Conditions:
    """Read only the conditions, from a CSV with or without shifting times; raises `BadRecording`."""
    optional = {"shifting_time": "s", **_OPTIONAL}
    return _conditions(Sheet.read(content, "conditions", CONDITION_UNITS, optional, BadRecording), profiles)


def _conditions(sheet: Sheet, profiles: Profiles) -> Conditions:
    time, current, *given = profiles
    profile = sheet.whole("current_profile")
    unknown = np.flatnonzero(profile >= len(time))
    if len(unknown):
        raise sheet.refusal("current_profile", int(unknown[0]), "is not the number of a current profile of the bench",
                            f"Enter 0 to {len(time) - 1}, or give a bench or a profiles file with this profile")
    columns = {name: sheet.columns[name] for name in INPUT_UNITS if name in sheet.columns}
    order = sheet.whole("run_order") if "run_order" in sheet.columns else None
    try:
        return Conditions(profile, sheet.positive("motor_speed"), sheet.positive("load_inertia"),
                          sheet.positive("brake_torque", zero=True), time, current, order, **columns,
                          profile_input_torque=given[0] if given else None)
    except InvalidValue as error:
        raise BadRecording(error.cause, error.remedy) from error


def _shifting_times(sheet: Sheet, conditions: Conditions) -> np.ndarray:
    column = sheet.positive("shifting_time")
    end = conditions.profile_time[conditions.current_profile, -1]
    too_late = np.flatnonzero(column > end)
    if len(too_late):
        row = int(too_late[0])
        raise sheet.refusal("shifting_time", row, f"exceeds the {end[row]:g} s of the current profile",
                            "Enter the time from the shift command in the unit of the column, and leave out engage"
                            "ments that never locked")
    return column


def _signals(content: bytes, n: int) -> Signals:
    sheet = Sheet.read(content, "signals", {"condition": "1", "time": "s"}, SIGNAL_UNITS, BadRecording)
    condition, time = sheet.whole("condition"), sheet.columns["time"]
    k = int(np.count_nonzero(condition == 0))
    if k == 0 or len(time) != n * k:
        raise BadRecording(f"The signals file has {len(time)} rows, {k} of them of condition 0, for {n} conditions",
                           "Give every condition the same number of samples, counting conditions from 0")
    for name, expected in (("condition", np.repeat(np.arange(n), k)), ("time", np.tile(time[:k], n))):
        mismatch = np.flatnonzero(sheet.columns[name] != expected)
        if len(mismatch):
            row = int(mismatch[0])
            raise sheet.refusal(name, row, f"instead of {expected[row]:g}",
                                "Sort the rows by condition, counted from 0, and give all conditions the same times")
    return Signals(time[:k], **{name: sheet.columns[name].reshape(n, k) for name in SIGNAL_UNITS
                                if name in sheet.columns})
