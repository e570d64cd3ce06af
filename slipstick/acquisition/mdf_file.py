"""Files in the Measurement Data Format, MDF 2 to 4.2, read by asammdf (an extra: `pip install slipstick[mdf]`)."""

import io
import logging
import traceback
from collections import Counter
from functools import cached_property
from typing import Any, BinaryIO, cast

import numpy as np

from slipstick.acquisition.channel import LARGEST, Channel, Listed, unreadable
from slipstick.acquisition.names import Names
from slipstick.acquisition.units import spelled
from slipstick.errors import BadRecording
from slipstick.numerics.quantities import NotAQuantity, convert

_UNFINISHED = b"UnFinMF "
SIGNATURES = (b"MDF     ", _UNFINISHED)
"""The first eight bytes of a file, finished or not."""

_TIME, _KINDS = 1, {2: "an angle", 3: "a distance", 4: "an index"}
"""Codes of MDF 4 for what a master channel states."""
_REMOTE_MASTER = 1 << 3
"""Flag of a group whose master is in another group."""
_BUS_FRAMES = ("CAN_DataFrame", "CAN_RemoteFrame", "LIN_Frame", "FLX_Frame", "ETH_Frame")
_TRANSLATED = "the file translates its numbers to text, and the numbers are used"


class MdfFile:
    """An MDF file.

    A name that several groups share is listed with the number of its group, such as `speed@2`, and one that a group has
    more than once with the number in the group as well, such as `speed@2.5`.
    """

    def __init__(self, name: str, file: BinaryIO) -> None:
        self.name = name
        try:
            import asammdf
        except ImportError:
            raise BadRecording(f"{name} is an MDF file, and the package asammdf is not installed",
                               "Install it: pip install 'slipstick[mdf]'") from None
        # asammdf logs what it then raises; the error below says it once.
        logging.getLogger("asammdf").setLevel(logging.CRITICAL)
        if file.read(8) == _UNFINISHED:
            file.seek(0)
            file = io.BytesIO(file.read())  # asammdf finishes the file in place
        file.seek(0)
        try:
            self._mdf: Any = asammdf.MDF(cast(Any, file))
        except Exception as error:  # asammdf raises its own, struct, key and value errors on damaged files
            _close_half_open(error)
            raise unreadable(self.name, "MDF", error) from None
        groups: list[Any] = self._mdf.groups
        arrays = [str(channel.name) for group in groups for index, channel in enumerate(group.channels)
                  if self._is_array(group, index)]
        self.remarks: tuple[str, ...] = (f"MDF {self._mdf.version}", *(
            f"arrays are left out: {', '.join(arrays[:10])}; export their elements as channels" for _ in arrays[:1]))

    def listed(self) -> tuple[Listed, ...]:
        """The channels of numbers, without the time of each group."""
        return tuple(Listed(name, self._unit(*self._places[position]), self._samples(self._places[position][0]))
                     for name, position in self._names.positions.items())

    def channel(self, name: str) -> Channel:
        """Read one channel; a sample that the file marks as invalid is NaN.

        Of values that the file translates to text, the numbers are read. `time` is None, with the reason, where the
        master of the group is missing or is no time.
        """
        known = self._names.positions
        if name not in (*known, *self._names.aliases) and any(other.startswith(_BUS_FRAMES) for other in known):
            raise BadRecording(f"{self.name} has no channel '{name}': it is a log of bus messages that are not decoded",
                               "Decode it with the DBC or ARXML file of the bus first, such as by extract_bus_logging "
                               "of asammdf")
        group, index = self._places[self._names.position(name)]
        if (samples := self._samples(group)) > LARGEST:
            raise BadRecording(f"The channel '{name}' of {self.name} has {samples:,} samples, more than {LARGEST:,}",
                               "Split the file")
        note = ""
        try:
            read = self._mdf.get(group=group, index=index, ignore_invalidation_bits=True)
            values, unit, invalid = np.asarray(read.samples), str(read.unit or ""), read.invalidation_bits
            if values.dtype.kind in "SUO":
                read = self._mdf.get(group=group, index=index, raw=True, ignore_invalidation_bits=True)
                values, note = np.asarray(read.samples), _TRANSLATED
            factor, reason = self._seconds[group]
        except Exception as error:
            raise unreadable(self.name, "MDF", error) from error
        if values.ndim != 1 or values.dtype.kind not in "fiub":
            raise BadRecording(f"The channel '{name}' of {self.name} has values of the type {values.dtype}",
                               "Map a channel of numbers")
        if len(values) != samples:
            raise BadRecording(f"The channel '{name}' of {self.name} has {len(values)} of its {samples} samples: the "
                               "file is cut off, or damaged", "Export it again, or leave it out")
        time = None if factor is None else factor * np.asarray(read.timestamps, float)
        values = values.astype(float)
        if invalid is not None:
            values[np.asarray(invalid, bool)] = np.nan
        return Channel(name, unit, values, time, reason, note)

    @cached_property
    def _places(self) -> list[tuple[int, int]]:
        """Group and index of each channel of numbers, and of masters that are no times."""
        return [(group, index) for group, content in enumerate(self._mdf.groups)
                for index, channel in enumerate(content.channels)
                if self._is_number(channel) and not self._is_array(content, index)
                and (index != self._mdf.masters_db.get(group) or self._seconds[group][0] is None)]

    @cached_property
    def _names(self) -> Names:
        names = [(str(self._mdf.groups[group].channels[index].name), group) for group, index in self._places]
        twice = Counter(names)
        return Names.plain(self.name, [name for name, _ in names], [
            f"{group}" if twice[name, group] == 1 else f"{group}.{index}"
            for (name, _), (group, index) in zip(names, self._places, strict=True)])

    @cached_property
    def _seconds(self) -> list[tuple[float | None, str]]:
        """For each group the factor from its master to s, or None and the reason why it has no times."""
        return [self._master_seconds(group) for group in range(len(self._mdf.groups))]

    def _master_seconds(self, group: int) -> tuple[float | None, str]:
        number, seen = group, set[int]()
        while number not in seen and getattr(self._mdf.groups[number].channel_group, "flags", 0) & _REMOTE_MASTER and \
                self._mdf.version >= "4":
            seen.add(number)
            number = self._mdf.groups[number].channel_group.cg_master_index
            if not isinstance(number, int) or not 0 <= number < len(self._mdf.groups):
                return None, f"its group {group} refers to a master that the file does not have"
        index = self._mdf.masters_db.get(number)
        if index is None:
            return None, f"its group {group} has no master channel"
        master = self._mdf.groups[number].channels[index]
        kind = getattr(master, "sync_type", _TIME) if self._mdf.version >= "4" else _TIME
        if kind != _TIME:
            return None, f"the master '{master.name}' of its group {group} is {_KINDS.get(kind, 'of an unknown kind')}"
        unit = spelled(self._unit(number, index))
        try:
            return float(convert(np.array(1.0), unit or "s", "s")), ""
        except NotAQuantity:
            return None, f"the master '{master.name}' of its group {group} is in {unit}, which is no unit of time"

    def _samples(self, group: int) -> int:
        return int(self._mdf.groups[group].channel_group.cycles_nr)

    def _is_number(self, channel: Any) -> bool:
        """Whether the file declares integers or floating-point numbers, by the codes of MDF 3 and 4."""
        is_text = channel.data_type in (7, 8) if self._mdf.version < "4" else channel.data_type > 5
        return not is_text and not getattr(channel, "component_addr", 0)

    def _is_array(self, group: Any, index: int) -> bool:
        """Whether a sample has several numbers, which asammdf gives in one row."""
        dependencies = getattr(group, "channel_dependencies", None)
        return bool(dependencies and dependencies[index])

    def _unit(self, group: int, index: int) -> str:
        channel = self._mdf.groups[group].channels[index]
        unit = getattr(channel, "unit", "") or getattr(channel.conversion, "unit", "")
        return str(unit.decode("latin-1") if isinstance(unit, bytes) else unit or "").strip("\0 ")


def _close_half_open(error: Exception) -> None:
    """Mark the objects of asammdf that `error` left half open as closed: deleting them would print a traceback."""
    for frame, _ in traceback.walk_tb(error.__traceback__):
        half_open = frame.f_locals.get("self")
        if half_open is not None and type(half_open).__module__.startswith("asammdf") and hasattr(half_open, "_closed"):
            half_open._closed = True
