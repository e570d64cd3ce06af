"""The blocks of a machine with what was recorded of them: what a fit is made of."""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy

from slipstick.engine.equations import Problem, refine
from slipstick.engine.noise import Noise
from slipstick.machine.declaration import Block, Machine, Namespace, identifier_of
from slipstick.machine.runs import Runs
from slipstick.machine.runs_file import units_of
from slipstick.machine.system import System

Pair = tuple[str, str]
"""The quantity that a law changes, and what it depends on."""
_SMOOTHING = 3.0
"""Standard deviation in samples of the kernel that smooths measured inputs, from which columns are computed: a column
that shares noise with the residual is biased."""
_LATEST = 4
"""Samples behind one that counts on which it may depend: a signal is read late or early by some, between samples."""
MEASURED = "measured: "
"""What the name of an input has before that of the state that is drawn to it: no identifier has this."""


@dataclass(frozen=True, eq=False)
class Term:
    """A change of a parameter, of the clock, or of an input, with one coefficient in units of `size`.

    It is multiplied by `values` (n,). If it `is_factor`, the parameter changes by the exponential of that: where
    parameters act in ratios alone, a change of all of them is then one of their means, at any scatter. Random
    coefficients differ between runs by at most `widest`; their mean, or the coefficient of a shared one, is `target`
    within `std`.
    """

    name: str
    kind: Literal["parameter", "clock"]
    place: str
    size: float
    values: np.ndarray
    std: float
    widest: float = 0.0
    target: float = 0.0
    is_factor: bool = False

    def change(self, parameter: np.ndarray, value: np.ndarray | float) -> np.ndarray:
        """Return a parameter (n, 1) with a coefficient, or with those (n,) of the runs."""
        change = (self.values * value)[:, None]
        return parameter * np.exp(change) if self.is_factor else parameter + self.size * change

    def take(self, rows: slice | np.ndarray) -> "Term":
        """Return the term of the runs `rows`."""
        return replace(self, values=self.values[rows])


@dataclass(frozen=True, eq=False)
class Part:
    """A block with its recordings of n runs: K instants, `fine` for each of k samples.

    `inputs` (n, K) drive the equations: measured ones without their `noise`, which is `beyond` (n, k). `parameters` (n,
    1) are nominal. The o signals that are `measured` (n, o, k) count where `counted`, with the noise of their
    `sensors`. The noise of each run is `loudness` (n, o) times that, and `input_loudness` (n, r). What a part leaves
    beyond noise counts as noise as well: variances are `temper` (n,) times those of the noise. `disturbances` are the
    fluctuations of quantities, by identifier.
    """

    block: Block
    system: System
    step: float
    fine: int
    inputs: Mapping[str, np.ndarray]
    beyond: Mapping[str, np.ndarray]
    noise: Mapping[str, Noise]
    parameters: Mapping[str, np.ndarray]
    measured: np.ndarray
    counted: np.ndarray
    sensors: tuple[Noise, ...]
    loudness: np.ndarray
    input_loudness: np.ndarray
    temper: np.ndarray
    disturbances: Mapping[str, Noise] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The name of the block."""
        return self.block.name

    @property
    def instants(self) -> int:
        """The number K of instants: up to the last sample that counts in any run, and not to the end of recordings."""
        return self.fine * (int(self.measured.shape[2]) - 1) + 1

    @property
    def nearest(self) -> np.ndarray:
        """The samples (K,) that are next to the instants."""
        return np.rint(np.arange(self.instants) / self.fine).astype(int)

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that are measured."""
        return self.system.signals

    @property
    def drawn(self) -> dict[str, str]:
        """The signals to which states are drawn: the names of the inputs with their measured values."""
        inputs = {name: MEASURED + identifier_of(name) for name in self.signals}
        return {name: value for name, value in inputs.items() if value in self.inputs}

    @property
    def read(self) -> dict[str, str]:
        """The inputs that sensors read, by the name of what they read: measured inputs, and those of drawn states."""
        return {name: name for name in self.noise} | self.drawn

    @property
    def begins(self) -> dict[str, list[str]]:
        """The parameters that are nominally the first sample of a signal, by its name."""
        return {name: [identifier_of(each.name) for each in self.block.parameters if each.first_of == name]
                for name in self.signals}

    @property
    def quantities(self) -> dict[str, float]:
        """The quantities of the equations, unchanged."""
        return {identifier_of(each.name): 0.0 for each in self.block.quantities}

    def take(self, rows: slice | np.ndarray) -> "Part":
        """Return the part with the runs `rows`."""
        def chosen(values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
            return {name: value[rows] for name, value in values.items()}

        return replace(self, inputs=chosen(self.inputs), beyond=chosen(self.beyond), parameters=chosen(self.parameters),
                       measured=self.measured[rows], counted=self.counted[rows], loudness=self.loudness[rows],
                       input_loudness=self.input_loudness[rows], temper=self.temper[rows])

    def end(self) -> "Part":
        """Return the part up to the last sample that counts in any run: nothing behind it is compared."""
        counted, size = np.flatnonzero(self.counted.any(axis=(0, 1))), int(self.measured.shape[2])
        samples = min(int(counted[-1]) + 1 + _LATEST, size) if len(counted) else size
        instants = self.fine * (samples - 1) + 1
        return replace(self, inputs={name: np.ascontiguousarray(value[:, :instants])
                                     for name, value in self.inputs.items()},
                       beyond={name: value[:, :samples] for name, value in self.beyond.items()},
                       measured=np.ascontiguousarray(self.measured[:, :, :samples]),
                       counted=np.ascontiguousarray(self.counted[:, :, :samples]))


@dataclass(frozen=True, eq=False)
class Recorded:
    """A machine with n runs: its `parts`, the `random` and the `shared` terms, and `signals` that laws may depend on.

    `signals` are (n, k) within runs, without noise, and (n,) between runs. `rows` (n,) are the numbers of the runs
    among all. Those that are `set_aside` from the others may differ in what they leave, which then counts as the noise
    of each one. The `executor` computes with chunks of many runs, such as on other machines; None is here, in threads.
    """

    machine: Machine
    runs: Runs
    parts: tuple[Part, ...]
    random: tuple[Term, ...]
    shared: tuple[Term, ...]
    signals: Mapping[str, np.ndarray]
    rows: np.ndarray
    set_aside: bool = False
    executor: Executor | None = None

    def __len__(self) -> int:
        return len(self.runs)

    @property
    def terms(self) -> tuple[Term, ...]:
        """All terms, the random ones first, in the order of their coefficients."""
        return *self.random, *self.shared

    @property
    def widest(self) -> np.ndarray:
        """Largest standard deviations (r,) of the random terms between runs, as they are declared."""
        return np.array([term.widest for term in self.random])

    def take(self, rows: slice | np.ndarray) -> "Recorded":
        """Return the runs `rows`, without doing anything anew."""
        return replace(self, runs=self.runs.take(rows), parts=tuple(part.take(rows) for part in self.parts),
                       random=tuple(term.take(rows) for term in self.random),
                       shared=tuple(term.take(rows) for term in self.shared),
                       signals={name: value[rows] for name, value in self.signals.items()}, rows=self.rows[rows])

    def groups(self) -> list["Recorded"]:
        """Return the groups of parts that share no parameter, each with its terms."""
        groups = list[set[str]]()
        joining = {term.place for term in self.random} | {identifier_of(each.name) for each in self.machine.parameters}
        for part in self.parts:
            shared = {name for name, used in ((other.name, set(other.parameters)) for other in self.parts)
                      if name == part.name or used & set(part.parameters) & joining}
            joined = shared.union(*(group for group in groups if group & shared))
            groups = [group for group in groups if not group & joined] + [joined]
        return [self.select(group) for group in groups]

    def select(self, names: set[str]) -> "Recorded":
        """Return the machine with some of its parts, and the terms that act on them."""
        parts = tuple(part for part in self.parts if part.name in names)
        places = {name for part in parts for name in (
            *part.parameters, *(clock_of(part, signal) for signal in (*part.signals, *part.noise)))}
        return replace(self, parts=parts, random=tuple(term for term in self.random if term.place in places),
                       shared=tuple(term for term in self.shared if term.place in places))

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of what laws may depend on."""
        return {"time": "s", **self.runs.units, **units_of(self.machine)}

    def fine(self, name: str, part: Part) -> np.ndarray:
        """Return a signal at the instants (n, K) of a part, or constants of runs (n,); all who read it share it."""
        if identifier_of(name) in part.inputs:
            return part.inputs[identifier_of(name)]
        values, key = self.signals[name], (name, part.fine, part.instants)
        if values.ndim == 2 and key not in self._refined:
            self._refined[key] = refine(values, part.fine)[:, :part.instants]
        return values if values.ndim == 1 else self._refined[key]

    @cached_property
    def _refined(self) -> dict[tuple[str, int, int], np.ndarray]:
        return {}


def explain(recorded: Recorded, explained: Mapping[str, np.ndarray]) -> Recorded:
    """Return the machine with other signals without noise, as a fit explains them, by name.

    They are (n, K) at several instants a sample, so that parts that read them know how they bend between samples.
    """
    by_identifier = {identifier_of(name): signal for name, signal in explained.items()}
    measured = {identifier_of(name): signal for name, signal in recorded.runs.signals.items()}
    last = len(recorded.runs.time) - 1

    def known(part: Part) -> Part:
        inputs, beyond = dict(part.inputs), dict(part.beyond)
        for signal, name in part.read.items():
            if identifier_of(signal) in by_identifier:
                finer = by_identifier[identifier_of(signal)]
                more = part.fine * last // (finer.shape[1] - 1)
                whole = refine(finer, more) if more else finer[:, ::(finer.shape[1] - 1) // (part.fine * last)]
                inputs[name], samples = whole[:, :part.instants], part.measured.shape[2]
                beyond[name] = measured[identifier_of(signal)][:, :samples] - inputs[name][:, ::part.fine]
        return replace(part, inputs=inputs, beyond=beyond)

    smooth = {sensor.signal: recorded.signals[sensor.signal] for sensor in recorded.machine.sensors
              if sensor.signal in recorded.signals}
    sampled = {name: signal[:, ::(signal.shape[1] - 1) // last] for name, signal in explained.items()}
    return replace(recorded, parts=tuple(known(part) for part in recorded.parts),
                   signals=list_signals(recorded.machine, recorded.runs, {**smooth, **sampled}))


def smooth_signal(values: np.ndarray) -> np.ndarray:
    """Return a signal (n, k) without most of its noise.

    By a kernel applied twice (twicing: Tukey, Exploratory Data Analysis, 1977), which keeps curvature.
    """
    once = scipy.ndimage.gaussian_filter1d(values, _SMOOTHING, axis=1)
    return np.asarray(once + scipy.ndimage.gaussian_filter1d(values - once, _SMOOTHING, axis=1))


def pose_nominal(part: Part) -> Problem:
    """Return the equations of a part at nominal parameters, driven by inputs without noise."""
    return Problem(part.system, part.step, part.inputs, part.quantities, part.parameters)


def read_track(part: Part) -> np.ndarray | None:
    """Return states (n, d, K) that are measured, where all of them are, or else none."""
    if not set(part.block.states) <= set(part.signals):
        return None
    measured = [smooth_signal(part.measured[:, part.signals.index(name)]) for name in part.block.states]
    return np.stack([refine(signal, part.fine) for signal in measured], axis=1) if measured else None


def list_signals(machine: Machine, runs: Runs, smooth: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return all that laws may depend on beside own variables: (n, k) within runs, (n,) of runs."""
    shape = len(runs), len(runs.time)
    named = Namespace(**{identifier_of(name): value for name, value in {**smooth, **runs.channels}.items()},
                      time=runs.time)
    within = {"time": np.broadcast_to(runs.time - runs.time[0], shape),
              **{name: profile.at(runs.time) for name, profile in runs.commands.items()}, **smooth,
              **{name: np.broadcast_to(derive(named), shape) for name, derive in machine.signals.items()}}
    channels = {name: value for name, value in runs.channels.items() if name not in machine.inputs}
    constants = {**runs.conditions, **channels, **({} if runs.order is None else {"run order": runs.order})}
    return {name: np.asarray(value, float) for name, value in {**within, **constants}.items() if np.ptp(value) > 0}


def clock_of(part: Part, signal: str) -> str:
    """Return the place of the clock of a signal."""
    return f"{part.name}: {signal}"
