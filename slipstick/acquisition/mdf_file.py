"""Files in the Measurement Data Format, MDF 2 to 4.2, read by asammdf (an extra: `pip install slipstick[mdf]`)."""

import io
import logging
import traceback
from collections import Counter
from functools import cached_property
from typing import Any, BinaryIO, cast

import numpy as np

from slipstick.acquisition.channel import LARGEST, Channel, Listed, unknown_channel, unreadable
from slipstick.errors import BadRecording

_UNFINISHED = b"UnFinMF "
SIGNATURES = (b"MDF     ", _UNFINISHED)
"""The first eight bytes of a file, finished or not."""


class MdfFile:
    """An MDF file. A name that several groups share is listed with the number of its group, such as `speed@2`."""

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
        self.remarks: tuple[str, ...] = (f"MDF {self._mdf.version}",)

    def listed(self) -> tuple[Listed, ...]:
        """The channels of numbers, without the time of each group."""
        return tuple(Listed(name, self._unit(*place), int(self._mdf.groups[place[0]].channel_group.cycles_nr))
                     for name, place in self._places.items())

    def channel(self, name: str) -> Channel:
        """Read one channel; samples that the file marks as invalid are left out."""
        if name not in self._places:
            raise unknown_channel(self.name, name, self._places)
        group, index = self._places[name]
        if (samples := int(self._mdf.groups[group].channel_group.cycles_nr)) > LARGEST:
            raise BadRecording(f"The channel '{name}' of {self.name} has {samples:,} samples, more than {LARGEST:,}",
                               "Split the file")
        try:
            read = self._mdf.get(group=group, index=index)
        except Exception as error:
            raise unreadable(self.name, "MDF", error) from error
        values = np.asarray(read.samples)
        if values.ndim != 1 or values.dtype.kind not in "fiub":
            raise BadRecording(f"The channel '{name}' of {self.name} has values of the type {values.dtype}",
                               "Map a channel of numbers")
        return Channel(name, str(read.unit or ""), values.astype(float), np.asarray(read.timestamps, float))

    @cached_property
    def _places(self) -> dict[str, tuple[int, int]]:
        """Name -> (group, index)."""
        found = [(channel.name, group, index) for group, content in enumerate(self._mdf.groups)
                 for index, channel in enumerate(content.channels)
                 if index != self._mdf.masters_db.get(group) and self._is_number(channel)]
        count = Counter(name for name, *_ in found)
        return {name if count[name] == 1 else f"{name}@{group}": (group, index) for name, group, index in found}

    def _is_number(self, channel: Any) -> bool:
        """Whether the file declares integers or floating-point numbers, by the codes of MDF 3 and 4."""
        is_text = channel.data_type in (7, 8) if self._mdf.version < "4" else channel.data_type > 5
        return not is_text and not getattr(channel, "component_addr", 0)

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
