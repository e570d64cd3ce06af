"""What a program that runs the files of machines tells others of them: declarations and simulated outputs, as data."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from slipstick.black_box.description import BlackBoxDescription
from slipstick.black_box.reader import BlackBox
from slipstick.errors import InvalidValue
from slipstick.machine import Machine, MachineDescription, describe_machine
from slipstick.machine.description import AS_JSON, read_json, write_json

LONGEST_NAME = 200


@dataclass(frozen=True)
class SimulatedOutput:
    """An output of a machine: what tables of it are about, by default under so many `conditions`, and with so many
    `points` of each input."""

    about: BlackBoxDescription
    conditions: int
    points: tuple[int, ...]


@dataclass(frozen=True)
class KnownMachine:
    """A machine by the `name` that jobs give it.

    `declared` is None for one whose equations are elsewhere. `outputs` are empty where it is not simulated.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = AS_JSON

    name: str
    declared: MachineDescription | None
    outputs: tuple[SimulatedOutput, ...]

    @property
    def experiments(self) -> int:
        """The number of experiments that the machine declares, or of the conditions that are simulated."""
        return self.declared.experiments if self.declared is not None else max(
            (each.conditions for each in self.outputs), default=0)

    @classmethod
    def from_json(cls, text: str) -> "KnownMachine":
        """Return the machine that `to_json` wrote; raises `InvalidValue` for any other text."""
        return read_json(cls, text)

    def to_json(self) -> str:
        """Return the machine as JSON; raises `InvalidValue` where it is too large, or its name no line of text, or one
        that no address can have."""
        if not (0 < len(self.name) <= LONGEST_NAME and self.name.isprintable()):
            raise InvalidValue(f"'{self.name[:60]}' cannot be the name of a machine for others",
                               f"Give 1 to {LONGEST_NAME} characters in one line")
        if {".", ".."} & set(self.name.split("/")):
            raise InvalidValue(f"'{self.name[:60]}' cannot be part of an address, in which '.' and '..' are folders",
                               "Give a name without '.' and '..' between slashes")
        return write_json(self)


def list_known(machines: Sequence[Machine], files: Sequence[BlackBox]) -> list[KnownMachine]:
    """Return declared machines and what is simulated of these and others, in the order of their names."""
    declared = {each.name: describe_machine(each) for each in machines}
    names = {*declared, *(each.description.title for each in files)}
    return [KnownMachine(name, declared.get(name), tuple(
        SimulatedOutput(each.description, len(each.cases), each.points) for each in files
        if each.description.title == name)) for name in sorted(names)]
