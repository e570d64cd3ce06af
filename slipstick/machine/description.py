"""What a machine declares, as data without its equations: for programs that must not run the file of a machine."""

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Command, Condition, Curve, Machine, Output, Parameter, Quantity, Sensor
from slipstick.machine.experiments import has_experiments
from slipstick.machine.kinds import Kind

if TYPE_CHECKING:
    from pydantic import TypeAdapter

LARGEST = 1_000_000
"""Characters of a description as JSON."""
AS_JSON: dict[str, Any] = {"ser_json_inf_nan": "strings"}
"""Configuration of dataclasses that are written as JSON, which has no number for infinity."""
_T = TypeVar("_T")


@dataclass(frozen=True)
class BlockDescription:
    """A block: what it `reads` and `gives`, and the names of its states and of further own variables (`derived`).

    States among `switches` have a surface at 0 where their rate may jump.
    """

    name: str
    gives: tuple[str, ...]
    reads: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    switches: tuple[str, ...] = ()
    derived: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    curves: tuple[Curve, ...] = ()


@dataclass(frozen=True)
class EffectDescription:
    """An effect: a law of the `kind` with this name, of `quantity` over `on`."""

    name: str
    quantity: str
    on: str
    kind: str


@dataclass(frozen=True)
class SignalRange:
    """The `lowest` and the `highest` value of a `signal` in the machine's own experiments, in its unit."""

    signal: str
    lowest: float
    highest: float


@dataclass(frozen=True)
class MachineDescription:
    """What a `Machine` declares, with the names in the place of functions.

    `experiments` is the number of the machine's own ones, 0 where it does not say how it is run; each takes `duration`
    s with a sample every `step` s. `ranges` are those of the signals that were simulated.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = AS_JSON

    name: str
    blocks: tuple[BlockDescription, ...]
    sensors: tuple[Sensor, ...]
    commands: tuple[Command, ...] = ()
    conditions: tuple[Condition, ...] = ()
    signals: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    duration: float = 0.0
    step: float = 0.0
    outputs: tuple[Output, ...] = ()
    effects: tuple[EffectDescription, ...] = ()
    experiments: int = 0
    ranges: tuple[SignalRange, ...] = ()

    @classmethod
    def from_json(cls, text: str | bytes) -> "MachineDescription":
        """Return the description that `to_json` wrote; raises `InvalidValue` for any other text."""
        return read_json(cls, text)

    def to_json(self) -> str:
        """Return the description as JSON; raises `InvalidValue` where it is too large."""
        return write_json(self)


def describe_machine(machine: Machine, ranges: tuple[SignalRange, ...] = ()) -> MachineDescription:
    """Return what a machine declares, with the `ranges` of its signals that were simulated."""
    blocks = tuple(BlockDescription(
        each.name, each.signals, each.reads, each.states, each.switches, tuple(each.derived), each.parameters,
        each.quantities, each.curves) for each in machine.blocks)
    effects = tuple(EffectDescription(each.name, each.quantity, each.on,
                                      each.kind.name if isinstance(each.kind, Kind) else each.kind)
                    for each in machine.effects)
    choices = [*(len(each.profiles) for each in machine.commands), *(len(each.levels) for each in machine.conditions)]
    return MachineDescription(
        machine.name, blocks, machine.sensors, machine.commands, machine.conditions, tuple(machine.signals),
        machine.inputs, machine.duration, machine.step, machine.outputs, effects,
        math.prod(choices) if has_experiments(machine) else 0, ranges)


def channels_of(description: MachineDescription) -> Machine:
    """Return a machine without blocks, which has all that the import of runs needs of it.

    Its further signals have names, and functions that fail. Raises `InvalidValue` for names that do not fit.
    """
    return Machine(description.name, (), description.sensors, description.commands, description.conditions,
                   dict.fromkeys(description.signals, _fail), description.inputs, description.duration,
                   description.step, description.outputs)


def _fail(measured: Any) -> Any:
    raise InvalidValue("The description of a machine has no equations", "Open the file that declares the machine")


def read_json(kind: type[_T], text: str | bytes) -> _T:
    """Return the dataclass of a `kind` that `write_json` wrote; raises `InvalidValue` for any other text."""
    if len(text) > LARGEST:
        raise _too_large(len(text))
    try:
        described: _T = _adapter(kind).validate_json(text)  # type: ignore[arg-type]
    except ValueError as error:
        raise InvalidValue(f"The description of the machine cannot be read: {str(error)[:300]}",
                           "Write it with the same version of Slipstick") from error
    return described


def write_json(value: Any) -> str:
    """Return a dataclass as JSON; raises `InvalidValue` where it is too large, or not text and numbers."""
    try:
        # A file may declare numbers and arrays of numpy.
        text: str = _adapter(type(value)).dump_json(  # type: ignore[arg-type]
            value, warnings=False, fallback=lambda each: np.asarray(each).tolist()).decode()
    except ValueError as error:
        raise InvalidValue(f"The description of the machine cannot be written: {str(error)[:300]}",
                           "Declare names as texts, and values as numbers") from error
    if len(text) > LARGEST:
        raise _too_large(len(text))
    return text


def _too_large(size: int) -> InvalidValue:
    return InvalidValue(f"The description of the machine has {size:,} characters; the limit is {LARGEST:,}",
                        "Declare profiles with fewer corners")


@cache
def _adapter(kind: Any) -> "TypeAdapter[Any]":
    from pydantic import TypeAdapter  # an extra, which declarations need not

    return TypeAdapter(kind)
