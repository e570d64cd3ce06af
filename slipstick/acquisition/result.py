"""What an import makes of files: recordings, and all that must be known about how they came about."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slipstick.machine import Runs
from slipstick.recordings import Recordings


@dataclass(frozen=True)
class SetAside:
    """An experiment that is not among the recordings, and why."""

    label: str
    reason: str


@dataclass(frozen=True)
class MappedChannel:
    """A signal or further channel: from which channel, in which unit of the file (`stated`), and how often sampled.

    `step` is in s, `sign` is 1 or -1, and `lowest` and `highest` are over all experiments in `unit`. `note` says what
    was assumed about its values and times.
    """

    name: str
    channel: str
    stated: str
    unit: str
    sign: float
    step: float
    lowest: float
    highest: float
    note: str


@dataclass(frozen=True, eq=False)
class LeadIn:
    """What comes before t = 0 of the first n experiments: `signals` (n, k) by name, at `time` (k,) in s below 0.

    A value is NaN where a file has no sample.
    """

    time: np.ndarray
    signals: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False, kw_only=True)
class ImportedFiles:
    """What is known of n experiments, called `labels`, on a clock of `step` s.

    `remarks` are found out or assumed without being told, `doubts` are what looks wrong in the recordings, and
    `open_questions` what cannot be answered without the signals that were not mapped.
    """

    labels: tuple[str, ...]
    step: float
    channels: tuple[MappedChannel, ...]
    set_aside: tuple[SetAside, ...]
    remarks: tuple[str, ...]
    doubts: tuple[str, ...]
    open_questions: tuple[str, ...] = ()
    experiment: ClassVar[str]


@dataclass(frozen=True, eq=False, kw_only=True)
class Imported(ImportedFiles):
    """`recordings` of n engagements, the first of which are `led_in` by what precedes their shift command.

    `located` (n,) are the shifting times by the speeds in s with their standard errors `error` (n,), NaN where the
    speeds do not show one; `computed` says whether the recordings have these, or recorded ones.
    """

    recordings: Recordings
    located: np.ndarray
    error: np.ndarray
    computed: bool
    led_in: LeadIn
    experiment: ClassVar[str] = "engagement"


@dataclass(frozen=True, eq=False, kw_only=True)
class ImportedRuns(ImportedFiles):
    """`runs` of a machine, which begin at `begins` (n,) in s on the clocks of their files."""

    runs: Runs
    begins: np.ndarray
    experiment: ClassVar[str] = "run"
