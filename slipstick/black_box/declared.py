"""A machine that is declared with `slipstick.machine` as simulator: one of its outputs, for many runs at once."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

import numpy as np

from slipstick.black_box.cases import Cases
from slipstick.black_box.description import BlackBoxDescription, Input, Quantity
from slipstick.black_box.function import NoResult
from slipstick.errors import InvalidValue, UnknownName
from slipstick.machine import (
    Machine,
    Output,
    Parameter,
    evaluate_output,
    list_experiments,
    open_machine,
    select_profiles,
)
from slipstick.machine.declaration import identifier_of
from slipstick.machine.digest import digest

_MOST_INSTANTS = 1_000_000
"""Instants of all runs of one call: a quarter of a gigabyte."""
_RANGE = 0.5, 1.5
_STDS = 4
"""An input accepts the multiples of `_RANGE`, and those within so many standard deviations of what is declared."""


@dataclass(frozen=True)
class Declared:
    """The `output` of the machine that the Python file at `path` declares; a run has no time limit."""

    path: str
    output: str

    timeout: ClassVar[float] = math.inf

    @property
    def machine(self) -> Machine:
        """The machine, which is declared again if its file has changed."""
        return _open(self.path, Path(self.path).stat().st_mtime_ns)

    @property
    def declared_output(self) -> Output:
        """The output as the machine declares it."""
        return next(each for each in self.machine.outputs if name_of(each.name) == self.output)

    @property
    def identity(self) -> str:
        """The machine and the digest of its declaration, whatever its comments and layout."""
        return f"declared machine {self.machine.name}, digest {digest(self.machine, self.declared_output)}"

    @property
    def most_runs(self) -> int:
        """Runs of one call."""
        from slipstick.engine.simulation import FINE  # with numba, which a description does not need

        return max(1, int(_MOST_INSTANTS * self.machine.step / self.machine.duration / FINE))

    def run(self, inputs: Mapping[str, float], cases: Cases) -> list[float | NoResult]:
        """The output under each of the n conditions, NaN where there is none."""
        try:
            return [*self.evaluate({name: np.array([value]) for name, value in inputs.items()}, cases)[0].tolist()]
        except InvalidValue as error:
            return [NoResult(error.cause)] * len(cases)

    def evaluate(self, inputs: Mapping[str, np.ndarray], cases: Cases) -> np.ndarray:
        """Outputs (m, n) for inputs (m,) under n conditions, NaN where there is none; raises `InvalidValue`."""
        count = len(next(iter(inputs.values())))
        size = max(1, self.most_runs // len(cases))
        parts = [self._simulate({name: values[first:first + size] for name, values in inputs.items()}, cases)
                 for first in range(0, count, size)]
        return np.concatenate(parts).reshape(count, len(cases))

    def _simulate(self, inputs: Mapping[str, np.ndarray], cases: Cases) -> np.ndarray:
        """Outputs (m n,) of one call."""
        from slipstick.engine.simulation import simulate  # with numba

        machine, n = self.machine, len(cases)
        count = len(next(iter(inputs.values())))
        columns = dict(zip((each.name for each in cases.quantities), np.tile(cases.values.T, count), strict=True))
        values = {each.name: np.repeat(inputs[name_of(each.name)], n) for each in list_factors(machine)}
        values |= {each.name: columns[name_of(each.name)] for each in machine.conditions}
        commands = {each.name: select_profiles(each.profiles, numbers_of(columns, each.name, len(each.profiles),
                                                                         count * n))
                    for each in machine.commands}
        time = list_experiments(machine).time
        try:
            with np.errstate(all="ignore"):
                signals = simulate(machine, time, commands, values)
                return evaluate_output(self.declared_output, time, signals)
        except InvalidValue:
            raise
        except Exception as error:
            raise InvalidValue(f"The equations of the machine '{machine.name}' fail: {type(error).__name__}: {error}",
                               "Correct them, or narrow the axes") from error


def name_of(declared: str) -> str:
    """The name of an input, a column or an output that a machine declares under this name."""
    return identifier_of(declared).lower()


def profile_column(command: str) -> str:
    """The column with the numbers of the profiles of a command."""
    return f"{name_of(command)}_profile"


def list_factors(machine: Machine) -> list[Parameter]:
    """The parameters that are factors; raises `InvalidValue` for one without a nominal value."""
    factors = [each for each in machine.parameters if each.is_factor(1.0 if each.value is None else each.value)]
    for each in factors:
        if each.value is None:
            raise InvalidValue(f"The parameter '{each.name}' of the machine '{machine.name}' has no nominal value",
                               f'Declare it, such as Parameter("{each.name}", "{each.unit}", value=1.0)')
    return factors


def numbers_of(columns: Mapping[str, np.ndarray], command: str, count: int, runs: int) -> np.ndarray:
    """The numbers of the profiles of a command (runs,), of which it has `count`; raises `InvalidValue`."""
    column = profile_column(command)
    numbers = columns.get(column, np.zeros(runs))
    if not np.isin(numbers, np.arange(count)).all():
        wrong = numbers[~np.isin(numbers, np.arange(count))][0]
        raise InvalidValue(f"There is no profile {wrong:g} in the column {column}",
                           f"The machine declares {count} of the command '{command}', numbered from 0")
    return numbers.astype(int)


def open_declared(path: Path, output: str | None) -> tuple[BlackBoxDescription, Cases, Declared]:
    """The description of the machine in a file, its conditions, and its simulator; by default of its first output.

    Raises what `open_machine` raises, `InvalidValue` for a machine without outputs, experiments or nominal values, and
    `UnknownName`.
    """
    machine = open_once(path)
    outputs = {name_of(each.name): each for each in machine.outputs}
    if not outputs:
        raise InvalidValue(f"The machine '{machine.name}' declares no output",
                           'Give it `outputs`, such as (Output("largest_speed", "rad/s", of="speed", take="largest"),)')
    if output is not None and output not in outputs:
        raise UnknownName.of("output", output, outputs)
    simulator = Declared(str(path.resolve()), output or next(iter(outputs)))
    chosen = outputs[simulator.output]
    cases = _list_cases(machine)
    return BlackBoxDescription(machine.name, tuple(map(_input, list_factors(machine))), cases.quantities,
                               Quantity(simulator.output, chosen.unit or "1"), simulator.identity), cases, simulator


def _input(parameter: Parameter) -> Input:
    known = parameter.within if math.isfinite(parameter.within) else 0.0
    widest = math.exp(_STDS * math.hypot(parameter.scatter, known))
    return Input(name_of(parameter.name), parameter.unit or "1", float(parameter.value or 0.0),
                 min(_RANGE[0], 1 / widest), max(_RANGE[1], widest))


def _list_cases(machine: Machine) -> Cases:
    """The experiments that a machine declares, as columns; a command with one profile has none beside others."""
    experiments = list_experiments(machine)
    choices = [each for each in machine.commands if len(each.profiles) > 1]
    columns = [(Quantity(profile_column(each.name), "1"), experiments.numbers[each.name].astype(float))
               for each in (choices if choices or machine.conditions else machine.commands)]
    columns += [(Quantity(name_of(each.name), each.unit or "1"), experiments.conditions[each.name])
                for each in machine.conditions]
    if not columns:
        raise InvalidValue(f"The machine '{machine.name}' has neither commands nor conditions",
                           "Declare what differs between its experiments")
    return Cases(tuple(quantity for quantity, _ in columns), np.column_stack([values for _, values in columns]))


def open_once(path: Path) -> Machine:
    """The machine that a file declares, which is run again only where it has changed; raises what `open_machine` does.
    """
    return _open(str(path.resolve()), path.stat().st_mtime_ns) if path.is_file() else open_machine(path)


@lru_cache(maxsize=16)
def _open(path: str, changed: int) -> Machine:
    return open_machine(path)
