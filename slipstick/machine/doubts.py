"""Whether recorded runs may have another unit or sign than the machine says."""

from collections.abc import Iterator, Sequence

import numpy as np

from slipstick.machine.declaration import Command, Condition, Machine
from slipstick.machine.description import SignalRange
from slipstick.machine.runs import Runs
from slipstick.numerics.quantities import raised

_OTHER_ORDER = 10.0
"""Factor between what is recorded and the experiments of the machine from which a unit may be wrong."""
_OPPOSITE = 0.1
"""Share of what a signal reaches on one side of 0 below which it is on that side alone."""


def list_doubts(runs: Runs, machine: Machine, ranges: Sequence[SignalRange]) -> list[str]:
    """Return what is of another order, or of the other sign, in the runs than in the machine's own experiments.

    `ranges` are those of the signals there.
    """
    return [*_doubt_clock(runs, machine), *_doubt_sizes(runs, machine), *_doubt_signals(runs, ranges)]


def describe_span(values: np.ndarray, unit: str) -> str:
    """Return the least and the largest of values in words."""
    return f"{np.min(values):.4g} to {np.max(values):.4g} {raised(unit)}".rstrip()


def _doubt_clock(runs: Runs, machine: Machine) -> Iterator[str]:
    """A clock whose step and length both are of another order than those of the machine's experiments, to one side."""
    length, duration = float(runs.time[-1] - runs.time[0]), machine.duration
    if (_is_other_order(length, duration) and _is_other_order(runs.step, machine.step)
            and (length > duration) == (runs.step > machine.step)):
        yield (f"The runs last {length:.4g} s in steps of {runs.step:.4g} s, and experiments of the machine "
               f"{duration:.4g} s in steps of {machine.step:.4g} s. Check the unit of time, which is s in "
               "`duration`, `step` and rates of the machine")


def _doubt_sizes(runs: Runs, machine: Machine) -> Iterator[str]:
    """What is of another order in the runs than in the experiments that the machine declares."""
    declared: list[tuple[Condition | Command, np.ndarray, np.ndarray]] = [
        (each, runs.conditions[each.name], np.array(each.levels)) for each in machine.conditions if each.levels]
    declared += [(each, runs.commands[each.name].value, np.array([value for corners in each.profiles
                                                                  for _, value in corners]))
                 for each in machine.commands if each.profiles]
    for each, recorded, expected in declared:
        size, usual = np.abs(recorded).max(), np.abs(expected).max()
        if _is_other_order(size, usual):
            yield (f"{each.name} is {describe_span(recorded, each.unit)} in the runs, and "
                   f"{describe_span(expected, each.unit)} in the experiments that the machine declares. Check its unit")


def _doubt_signals(runs: Runs, ranges: Sequence[SignalRange]) -> Iterator[str]:
    """Signals that are of another order, or on the other side of 0, in the runs than in the machine's experiments."""
    for each in ranges:
        if each.signal not in runs.signals:
            continue
        recorded = runs.signals[each.signal]
        sides = _side_of(float(np.nanmin(recorded)), float(np.nanmax(recorded))), _side_of(each.lowest, each.highest)
        if sides[0] * sides[1] < 0:
            words = {-1: "negative", 1: "positive"}
            yield (f"{each.signal} is {words[sides[0]]} in the runs, and {words[sides[1]]} in the experiments that the "
                   "machine declares. Check its sign and its unit")
        size, usual = float(np.nanmax(np.abs(recorded))), max(abs(each.lowest), abs(each.highest))
        if _is_other_order(size, usual):
            unit = raised(runs.units.get(each.signal, ""))
            reached, expected = (f"{value:.5g} {unit}".rstrip() for value in (size, usual))
            yield (f"{each.signal} reaches {reached} in the runs, and {expected} in the experiments that the machine "
                   "declares. Check its unit")


def _side_of(lowest: float, highest: float) -> int:
    """Return 1 for values that are positive but for noise, -1 for negative ones, 0 for others."""
    return int(-lowest < _OPPOSITE * highest) - int(highest < -_OPPOSITE * lowest)


def _is_other_order(size: float, usual: float) -> bool:
    return usual > 0 and not usual / _OTHER_ORDER < size < usual * _OTHER_ORDER
