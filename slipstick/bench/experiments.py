"""The experiments of a bench file: current profiles and conditions, written inline or as CSV files beside it."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS, PROFILE_UNITS, Conditions
from slipstick.bench.document import Section
from slipstick.errors import BadBench, InvalidValue, SlipstickError
from slipstick.storage.sheet import LARGEST, Sheet

_FACTOR_UNITS = {name: unit for name, unit in CONDITION_UNITS.items() if name != "current_profile"}
_LARGEST = 64 << 20  # bytes of a CSV file
_MOST_CONDITIONS = 100_000  # a short upload could otherwise combine to more than the memory holds

PROFILE_TORQUE = {"input_torque": "N m"}
"""Further column of the profiles of a bench without a converter, where the input torque varies."""

Profiles = tuple[np.ndarray, ...]
"""Times in s, currents in A and, where it is given, input torques in N m: (p, k) each."""


def read_experiments(root: Section, without_converter: bool) -> Conditions:
    """The conditions of a bench file with their current profiles; raises `BadBench`."""
    profiles = _profiles(root, without_converter)
    section, varying = root.section("conditions"), len(profiles) > 2
    units = {**_FACTOR_UNITS, **(INPUT_UNITS if without_converter else {})}
    if varying and "file" not in section.values and "input_torque" not in section.values:
        del units["input_torque"]  # that of the profiles is all there is
    if "file" in section.values:
        section.keys(("file",))
        columns = _condition_file(section, units)
    else:
        section.keys(tuple(units))
        factors = [np.arange(len(profiles[0])), *(section.numbers(name, unit) for name, unit in units.items())]
        if math.prod(map(len, factors)) > _MOST_CONDITIONS:
            raise root.error("conditions", f"these values combine to more than {_MOST_CONDITIONS:,} conditions",
                             "Give fewer values, or only the conditions of the design, as a CSV file")
        grid = [column.ravel() for column in np.meshgrid(*factors, indexing="ij")]
        columns = dict(zip(("current_profile", *units), grid, strict=True))
    if varying:
        columns.setdefault("input_torque", np.zeros(len(columns["motor_speed"])))
    try:
        return Conditions(columns.pop("current_profile"), profile_time=profiles[0], profile_current=profiles[1],
                          profile_input_torque=profiles[2] if varying else None, **columns)
    except InvalidValue as error:
        raise root.error("conditions", error.cause, error.remedy) from None


def read_profiles(content: bytes, optional: Mapping[str, str]) -> Profiles:
    """The current profiles of a CSV file with columns `profile`, `time [s]` and `current [A]`; raises `BadBench`."""
    sheet = Sheet.read(content, "profiles", {"profile": "1", **PROFILE_UNITS}, optional, BadBench)
    number = sheet.whole("profile")
    if not np.array_equal(np.unique(number), np.arange(number.max() + 1)):
        raise BadBench("The profiles are not numbered 0, 1, 2 and so on", "Number them from 0 without gaps")
    names = [name for name in (*PROFILE_UNITS, *optional) if name in sheet.columns]
    return stacked([tuple(sheet.columns[name][number == p] for name in names) for p in range(number.max() + 1)])


def stacked(profiles: Sequence[Profiles]) -> Profiles:
    """Profiles of different lengths as arrays (p, k): the last line of a shorter one is divided into equal parts.

    This does not change the current. Raises `InvalidValue` on a profile of fewer than two breakpoints.
    """
    if any(len(profile[0]) < 2 or len({len(column) for column in profile}) > 1 for profile in profiles):
        raise InvalidValue("A current profile has fewer than two breakpoints, or unequal numbers of times and currents",
                           "Give a time and a current for each breakpoint")
    if len({len(profile) for profile in profiles}) > 1:
        raise InvalidValue("Some current profiles have an input torque and others have none",
                           "Give it for every profile, or for none")
    longest = max(len(profile[0]) for profile in profiles)
    if longest * len(profiles) > LARGEST:
        raise InvalidValue(f"{len(profiles)} current profiles of up to {longest:,} breakpoints are too many",
                           "Reduce the sampling rate of the currents")
    rows = []
    for time, *columns in profiles:
        extra = np.linspace(time[-2], time[-1], longest - len(time) + 2)[1:-1]
        whole = np.concatenate([time[:-1], extra, time[-1:]])
        rows.append((whole, *(np.interp(whole, time, column) for column in columns)))
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def _profiles(root: Section, without_converter: bool) -> Profiles:
    optional = PROFILE_TORQUE if without_converter else {}
    written = root.values.get("profiles")
    if isinstance(written, dict):
        section = root.section("profiles")
        section.keys(("file",))
        try:
            return read_profiles(_beside(section), optional)
        except (BadBench, InvalidValue) as error:
            raise section.error("file", f"{section.text('file')}: {error.cause}", error.remedy) from None
    if not isinstance(written, list) or not written:
        raise root.error("profiles", "current profiles are needed",
                         "Write one [[profiles]] table for each, or [profiles] with a `file`")
    profiles = []
    for number, values in enumerate(written):
        if not isinstance(values, dict):
            raise root.error("profiles", f"{values!r} is not a current profile",
                             "Write one [[profiles]] table for each")
        section = Section(values, f"profiles.{number}", root.document)
        section.keys((*PROFILE_UNITS, *optional))
        units = {**PROFILE_UNITS, **{name: unit for name, unit in optional.items() if name in section.values}}
        profile = tuple(section.numbers(name, unit) for name, unit in units.items())
        time = profile[0]
        if len({len(column) for column in profile}) > 1 or len(time) < 2 or time[0] != 0 or np.any(np.diff(time) <= 0):
            raise section.error("time", f"{len(time)} times and {len(profile[1])} currents are not a profile",
                                "Give two breakpoints or more: times that rise from 0, and a current for each")
        profiles.append(profile)
    try:
        return stacked(profiles)
    except InvalidValue as error:
        raise root.error("profiles", error.cause, error.remedy) from None


def _condition_file(section: Section, units: Mapping[str, str]) -> dict[str, np.ndarray]:
    try:
        sheet = Sheet.read(_beside(section), "conditions", {"current_profile": "1", **units}, {"run_order": "1"},
                           BadBench)
        return {**sheet.columns, "current_profile": sheet.whole("current_profile")}
    except SlipstickError as error:
        raise section.error("file", f"{section.text('file')}: {error.cause}", error.remedy) from None


def _beside(section: Section) -> bytes:
    """The bytes of the CSV file that a section names: it lies in the folder of the bench file, or below."""
    name, folder = section.text("file"), section.document.folder
    if folder is None:
        raise section.error("file", "an uploaded bench cannot refer to other files",
                            "Write profiles and conditions inline")
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise section.error("file", f"'{name[:80]}' lies outside the folder of the bench file",
                            "Put it beside the bench file")
    if not path.is_file():
        raise section.error("file", f"there is no file '{name[:80]}'", f"Put it into {folder}, beside the bench file")
    if path.stat().st_size > _LARGEST:
        raise section.error("file", f"'{name[:80]}' is larger than {_LARGEST:,} bytes", "Thin it out")
    return path.read_bytes()
