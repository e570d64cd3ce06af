"""Mappings of a bench or machine: which channel is which signal, in which unit and sign, and where conditions are.

docs/your_files.md describes the keys of the file, `channels.toml`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

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
"""Where a number of each experiment comes from; of a channel it is the mean over the experiment."""


@dataclass(frozen=True, kw_only=True)
class FileMap:
    """What the mapping of a bench and that of a machine say both.

    `signals` and `further` map names to channels; `conditions` maps the names of constants, and `run_order`, to
    numbers. `step` in s is that of the common clock, None: that of the slowest signal. `plan` is the name of the sheet
    of conditions. `experiment` is what its experiments are called, and `origin` their t = 0.
    """

    name: str
    signals: Mapping[str, ChannelRef]
    conditions: Mapping[str, NumberSource]
    time: TimeRef = field(default_factory=TimeRef)
    further: Mapping[str, ChannelRef] = field(default_factory=dict)
    pattern: re.Pattern[str] | None = None
    plan: str | None = None
    step: float | None = None
    csv: CsvOptions = field(default_factory=CsvOptions)
    description: str = ""
    experiment: ClassVar[str]
    origin: ClassVar[str]


@dataclass(frozen=True, kw_only=True)
class ChannelMap(FileMap):
    """What the mapping of a clutch says.

    `shift_command` is t = 0: a marker, or a time in s from the start of the file or engagement. Of many engagements in
    a file, each begins at a `trigger`. `shifting_time` is None where it is computed from the speeds. `end` in s is that
    of the common clock, None: the end of the shortest engagement.
    """

    shift_command: Marker | float
    trigger: Marker | None = None
    shifting_time: Marker | NumberSource | None = None
    end: float | None = None
    experiment: ClassVar[str] = "engagement"
    origin: ClassVar[str] = "shift command"


@dataclass(frozen=True)
class Standstills:
    """Runs from one standstill to the next: from its middle, or from its end (`at_end`).

    In a standstill of at least `least` s, the magnitude of the channel stays below `level`, or with `moving` the
    channel stays within a range of that size.
    """

    source: ChannelRef
    level: float
    least: float
    moving: bool = False
    at_end: bool = False


@dataclass(frozen=True)
class Reversals:
    """Runs from one reversal to the next: a turning point of the channel, or with `of_sign` a change of its sign.

    It is passed by more than `level` afterwards. `direction` is 1 or -1 where the channel must rise, or be positive, in
    a run, or the opposite, and 0 for both.
    """

    source: ChannelRef
    level: float
    of_sign: bool = False
    direction: int = 0


@dataclass(frozen=True)
class Parts:
    """Runs of equal `length` in s, from the begin of the recording on."""

    length: float


Cut = Standstills | Reversals | Marker | Parts
"""How runs are cut from a recording; from one marker to the next."""


@dataclass(frozen=True, kw_only=True)
class MachineMap(FileMap):
    """What the mapping of a declared machine says.

    `commands` maps names to channels, and `held` says of some of them whether a value is held until the next sample.
    `conditions` has the further constants of a run as well. `units` are those of signals, commands and constants by
    name. `cut` is None where each file is a run, and `start` is t = 0: a marker in the run, or a time in s from its
    begin. `length` in s is that of all runs, None: the shortest. `begin_as` is the name of the constant that has the
    time of the cut, "" for none. Samples that are more than `gap` s apart have a gap between them, None: more than 1.5
    usual steps.
    """

    commands: Mapping[str, ChannelRef]
    units: Mapping[str, str]
    held: Mapping[str, bool] = field(default_factory=dict)
    cut: Cut | None = None
    start: Marker | float = 0.0
    length: float | None = None
    begin_as: str = ""
    gap: float | None = None
    experiment: ClassVar[str] = "run"
    origin: ClassVar[str] = "begin of the run"
