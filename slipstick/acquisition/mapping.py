"""The mapping of a bench: which channel is which signal, in which unit and with which sign, and where conditions are.

docs/your_files.md describes the keys of the file, `channels.toml`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from slipstick.acquisition.csv_layout import CsvOptions


@dataclass(frozen=True)
class TimeRef:
    """Sample times of channels: a `channel` in `unit`, "" for that of the file, or a `step` in s between samples."""

    channel: str = ""
    unit: str = ""
    step: float | None = None


@dataclass(frozen=True)
class ChannelRef:
    """A `channel` of a file, times `sign`, in `unit`, or in the unit that the file states where it is "".

    `time` states its sample times where they are not those of the mapping or of the file. `limits` are the least and
    largest values that the sensor or its amplifier can show, in the unit of the model; None: not known.
    """

    channel: str
    unit: str = ""
    sign: float = 1.0
    time: TimeRef | None = None
    limits: tuple[float, float] | None = None


@dataclass(frozen=True)
class Marker:
    """An instant: where a channel rises above or falls below `level`, in the unit of the file, or changes (None)."""

    source: ChannelRef
    level: float | None
    rising: bool = True


@dataclass(frozen=True)
class Constant:
    """A number that is the same in all files, in the unit of the model."""

    value: float


@dataclass(frozen=True)
class FromName:
    """A named `group` of the pattern of file names, a number in `unit`."""

    group: str
    unit: str


@dataclass(frozen=True)
class FromColumn:
    """A `column` of the sheet of conditions, in `unit` where its heading states none."""

    column: str
    unit: str


NumberSource = Constant | FromName | FromColumn | ChannelRef
"""Where a number of each engagement comes from; of a channel it is the mean over the engagement."""


@dataclass(frozen=True)
class ChannelMap:
    """What a mapping file says.

    `signals` and `further` map names to channels; `conditions` maps the columns of conditions, and `run_order`, to
    numbers. `shift_command` is t = 0: a marker, or a time in s from the start of the file or engagement. Of many
    engagements in a file, each begins at a `trigger`. `shifting_time` is None where it is computed from the speeds.
    `step` and `end` in s are those of the common clock, None: the slowest signal, and the end of the shortest
    engagement. `plan` is the name of the sheet of conditions.
    """

    name: str
    signals: Mapping[str, ChannelRef]
    conditions: Mapping[str, NumberSource]
    shift_command: Marker | float
    time: TimeRef = field(default_factory=TimeRef)
    trigger: Marker | None = None
    shifting_time: Marker | NumberSource | None = None
    further: Mapping[str, ChannelRef] = field(default_factory=dict)
    pattern: re.Pattern[str] | None = None
    plan: str | None = None
    step: float | None = None
    end: float | None = None
    csv: CsvOptions = field(default_factory=CsvOptions)
    description: str = ""
