"""The description of a machine: what its tables, measurements and answers are about."""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from slipstick.errors import InvalidValue, UnknownName

_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


@dataclass(frozen=True)
class Quantity:
    """A name, and the unit of its values."""

    name: str
    unit: str


@dataclass(frozen=True)
class Input:
    """An uncertain input: its value `nominal` in `unit`, and the range of its multiples that the simulator accepts."""

    name: str
    unit: str
    nominal: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Machine:
    """A machine with d uncertain inputs, conditions of k columns, and one output.

    `simulator` says in words which simulator computes the output. Raises `InvalidValue`.
    """

    title: str
    inputs: tuple[Input, ...]
    columns: tuple[Quantity, ...]
    output: Quantity
    simulator: str

    uses_run_order = False

    def __post_init__(self) -> None:
        """Check names and ranges."""
        names = [*(entry.name for entry in self.inputs), *(column.name for column in self.columns), self.output.name]
        for name in names:
            if not _NAME.fullmatch(name):
                raise InvalidValue(f"'{name[:70]}' is not a valid name",
                                   "Use up to 64 lower-case letters, digits and _, starting with a letter")
        if len(set(names)) < len(names):
            raise InvalidValue(f"A name stands for more than one thing: {', '.join(names)}",
                               "Give inputs, conditions and output different names")
        if not (self.inputs and self.columns):
            raise InvalidValue("The machine has no inputs, or no conditions", "Describe at least one of each")
        for entry in self.inputs:
            if entry.nominal == 0 or not entry.lower < entry.upper:
                raise InvalidValue(f"The input '{entry.name}' is {entry.nominal:g} {entry.unit} times {entry.lower:g} "
                                   f"to {entry.upper:g}", "Give a nominal value other than 0, and an increasing range")

    def input(self, name: str) -> Input:
        """The input `name`; raises `UnknownName`."""
        for entry in self.inputs:
            if entry.name == name:
                return entry
        raise UnknownName.of("input", name, [entry.name for entry in self.inputs])

    def spec(self) -> dict[str, Any]:
        """The machine as JSON."""
        return {"machine": asdict(self)}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Machine":
        """The machine of a `spec()`; raises `InvalidValue`."""
        content = spec["machine"]
        try:
            return cls(content["title"], tuple(Input(**entry) for entry in content["inputs"]),
                       _quantities(content["columns"]), Quantity(**content["output"]), content["simulator"])
        except (KeyError, TypeError) as error:
            raise InvalidValue(f"The description of the machine is incomplete ({error})", "Build the table again") \
                from error

    @property
    def digest(self) -> str:
        """SHA-256 of the spec."""
        return hashlib.sha256(json.dumps(self.spec(), sort_keys=True).encode()).hexdigest()


def _quantities(entries: Sequence[Mapping[str, str]]) -> tuple[Quantity, ...]:
    return tuple(Quantity(**entry) for entry in entries)
