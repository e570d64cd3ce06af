"""The experiments of a machine: all combinations of the profiles of its commands and the levels of its conditions."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Corners, Machine, Output
from slipstick.machine.runs import Profile


@dataclass(frozen=True, eq=False)
class Experiments:
    """n experiments of k samples at `time` (k,) in s: `commands`, the `numbers` (n,) of their profiles by command, and
    the levels (n,) of `conditions`."""

    time: np.ndarray
    commands: Mapping[str, Profile]
    numbers: Mapping[str, np.ndarray]
    conditions: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        return len(next(iter({**self.numbers, **self.conditions}.values()), [0]))

    def take(self, rows: np.ndarray) -> "Experiments":
        """Return the experiments `rows`, in this order."""
        return Experiments(
            self.time, {name: Profile(each.time[rows], each.value[rows]) for name, each in self.commands.items()},
            {name: each[rows] for name, each in self.numbers.items()},
            {name: each[rows] for name, each in self.conditions.items()})


def has_experiments(machine: Machine) -> bool:
    """Whether a machine says how it is run: one that is not simulated may have recorded runs."""
    return machine.duration > 0 and not machine.driving and all(each.profiles for each in machine.commands) and all(
        each.levels for each in machine.conditions)


def require_simulated(machine: Machine) -> None:
    """Raise `InvalidValue` for a machine that is driven by a measured signal, which a simulation does not have."""
    for name in machine.driving:
        raise InvalidValue(f"The machine '{machine.name}' cannot be simulated: it reads '{name}', which no block gives",
                           "To simulate it, declare a Command of this name in the place of the Sensor. Recorded runs "
                           "can be studied and calibrated as it is")


def list_experiments(machine: Machine) -> Experiments:
    """Return the experiments of a machine; raises `InvalidValue` where it does not declare them."""
    place, remedy = f"The machine '{machine.name}' does not say how it is run", "Give the machine"
    if not (machine.duration > 0 and 0 < machine.step <= machine.duration / 2):
        raise InvalidValue(f"{place}: it has no duration, or no step of at most half of it",
                           f"{remedy} `duration` and `step` in s, such as Machine(..., duration=2.0, step=0.01)")
    require_simulated(machine)
    for command in machine.commands:
        if not command.profiles:
            raise InvalidValue(f"{place}: the command '{command.name}' has no profile",
                               f'Give it, such as Command("{command.name}", "{command.unit}", '
                               "profiles=(((0, 0), (0.1, 12)),)), with times in s and values")
    for condition in machine.conditions:
        if not condition.levels:
            raise InvalidValue(f"{place}: the condition '{condition.name}' has no levels",
                               f'Give them, such as Condition("{condition.name}", "{condition.unit}", '
                               "levels=(0.5, 1.0))")
    choices = [*(range(len(each.profiles)) for each in machine.commands), *(each.levels for each in machine.conditions)]
    table = np.array(list(itertools.product(*choices)), float).reshape(math.prod(map(len, choices)), len(choices))
    numbers = {each.name: table[:, place].astype(int) for place, each in enumerate(machine.commands)}
    levels = {each.name: table[:, len(numbers) + place] for place, each in enumerate(machine.conditions)}
    count = round(machine.duration / machine.step) + 1
    return Experiments(np.arange(count) * machine.step,
                       {each.name: select_profiles(each.profiles, numbers[each.name]) for each in machine.commands},
                       numbers, levels)


def evaluate_output(output: Output, time: np.ndarray, signals: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return an output (n,) of signals (n, k); NaN where a level is not reached."""
    signal = signals[output.of]
    if output.above is not None or output.below is not None:
        level = output.above if output.above is not None else output.below
        return find_time(time, signal, float(level or 0.0), rising=output.above is not None)
    if output.take == "end":
        return np.asarray(signal[:, -1])
    if output.take == "mean":
        return np.asarray(signal.mean(axis=1))
    return np.asarray(signal.max(axis=1) if output.take == "largest" else signal.min(axis=1))


def find_time(time: np.ndarray, signal: np.ndarray, level: float, rising: bool = True) -> np.ndarray:
    """Return when signals (n, k) first rise above a `level`, or fall below it, (n,) in s, linear between samples.

    It is NaN where they do not.
    """
    side = signal >= level if rising else signal <= level
    crossed = side[:, 1:] & ~side[:, :-1]
    first, rows = np.argmax(crossed, axis=1), np.arange(len(signal))
    before, after = signal[rows, first], signal[rows, first + 1]
    share = (level - before) / np.where(after == before, 1.0, after - before)
    return np.where(crossed.any(axis=1), time[first] + share * (time[first + 1] - time[first]), np.nan)


def select_profiles(profiles: tuple[Corners, ...], numbers: np.ndarray) -> Profile:
    """Return profiles by number, all with as many corners as the longest one."""
    longest = max(len(corners) for corners in profiles)
    padded = np.array([[*corners, *(corners[-1],) * (longest - len(corners))] for corners in profiles], float)
    return Profile(padded[numbers, :, 0], padded[numbers, :, 1])
