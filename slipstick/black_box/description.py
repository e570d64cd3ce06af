"""The description of a machine: what its tables, measurements and answers are about."""

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from slipstick.errors import InvalidValue, UnknownName

_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
_LONGEST_UNIT = 64


@dataclass(frozen=True)
class Quantity:
    """A name, and the unit of its values."""

    name: str
    unit: str

    def __post_init__(self) -> None:
        """Check name and unit."""
        _require_words(self.name, self.unit)


@dataclass(frozen=True)
class Input:
    """An uncertain input: its value `nominal` in `unit`, and the range of its multiples that the simulator accepts.

    Raises `InvalidValue`.
    """

    name: str
    unit: str
    nominal: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        """Check name, unit and range."""
        _require_words(self.name, self.unit)
        finite = all(_is_number(value) for value in (self.nominal, self.lower, self.upper))
        if not finite or self.nominal == 0 or not self.lower < self.upper:
            raise InvalidValue(f"The input '{self.name}' is {self.nominal} {self.unit} times {self.lower} to "
                               f"{self.upper}", "Give a nominal value other than 0, and an increasing range")


@dataclass(frozen=True)
class BlackBoxDescription:
    """A machine with d uncertain inputs, conditions of k columns, and one output: what a table of it is about.

    `simulator` says in words which simulator computes the output; it is empty if another program has computed a table
    (docs/your_table.md), which is then all that is known. Raises `InvalidValue`.
    """

    title: str
    inputs: tuple[Input, ...]
    columns: tuple[Quantity, ...]
    output: Quantity
    simulator: str

    uses_run_order = False

    def __post_init__(self) -> None:
        """Check that all things have different names."""
        if not (_is_text(self.title) and self.title and _is_text(self.simulator)):
            raise InvalidValue("The title or the simulator of the machine is not a text", "Describe both in one line")
        names = [*(entry.name for entry in self.inputs), *(column.name for column in self.columns), self.output.name]
        if len(set(names)) < len(names):
            raise InvalidValue(f"A name stands for more than one thing: {', '.join(names)}",
                               "Give inputs, conditions and output different names")
        if not (self.inputs and self.columns):
            raise InvalidValue("The machine has no inputs, or no conditions", "Describe at least one of each")

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
    def from_spec(cls, spec: Mapping[str, Any]) -> "BlackBoxDescription":
        """The machine of a `spec()`; raises `InvalidValue`."""
        try:
            content = spec["machine"]
            return cls(content["title"], tuple(Input(**entry) for entry in content["inputs"]),
                       _quantities(content["columns"]), Quantity(**content["output"]), content["simulator"])
        except (KeyError, TypeError) as error:
            raise InvalidValue(f"The description of the machine is incomplete ({error})", "Build the table again") \
                from error

    @property
    def digest(self) -> str:
        """SHA-256 of the spec."""
        return hashlib.sha256(json.dumps(self.spec(), sort_keys=True).encode()).hexdigest()


def require_name(name: object) -> None:
    """Raise `InvalidValue` unless this is a name of an input, a column of the conditions or an output."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InvalidValue(f"'{str(name)[:70]}' is not a valid name",
                           "Use up to 64 lower-case letters, digits and _, starting with a letter")


def _require_words(name: object, unit: object) -> None:
    require_name(name)
    if not _is_text(unit) or not 1 <= len(str(unit)) <= _LONGEST_UNIT:
        raise InvalidValue(f"'{str(unit)[:70]}' is not a unit of '{name}'", "Give a unit, or 1 if there is none")


def _is_text(value: object) -> bool:
    """Whether a value of a file is a text in one line that every response can hold."""
    return isinstance(value, str) and (not value or value.isprintable())


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _quantities(entries: Sequence[Mapping[str, str]]) -> tuple[Quantity, ...]:
    return tuple(Quantity(**entry) for entry in entries)
