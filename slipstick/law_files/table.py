"""A measured law as a table, whatever machine it is of."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from slipstick.errors import InvalidValue


class Column(NamedTuple):
    """A column of a table."""

    name: str
    unit: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class LawTable:
    """The `change` (m,) in `unit` of a quantity at rising points `x` (m,) of what it depends on, in `x_unit`.

    A `relative` change is a share of the quantity. `lower` and `upper` (m,) are the ends of an interval at each point,
    which `band` describes, and `formula` (m,) is the change by the formula of a named effect, whose `equation` is text.
    A law is known up to what parameters of the model replace. Between its points it is linear, and beyond them
    constant. Raises `InvalidValue` for columns of other lengths, numbers that are not finite, and points that do not
    rise.
    """

    quantity: str
    depends_on: str
    x: Sequence[float]
    x_unit: str
    change: Sequence[float]
    unit: str
    relative: bool
    lower: Sequence[float] | None = None
    upper: Sequence[float] | None = None
    band: str = ""
    formula: Sequence[float] | None = None
    equation: str | None = None
    known_up_to: Literal["nothing", "constant", "line"] = "nothing"

    def __post_init__(self) -> None:
        """Reject here what other programs would read without an error."""
        about = f"The law of the {self.quantity} over the {self.depends_on}"
        if len(self.x) == 0 or any(len(column.values) != len(self.x) for column in self.columns):
            raise InvalidValue(f"{about} has columns of the lengths {[len(each.values) for each in self.columns]}",
                               "Give each point a value in each column")
        if not all(math.isfinite(value) for column in self.columns for value in column.values):
            raise InvalidValue(f"{about} has a number that is not finite", "Give finite numbers")
        if any(high <= low for low, high in pairwise(self.x)):
            raise InvalidValue(f"{about} has points that do not rise", "Sort them, and keep one of equal points")

    @property
    def name(self) -> str:
        """The name of the law in files, and of its files, such as friction_coefficient_over_slip."""
        return identifier(f"{self.quantity} over {self.depends_on}")

    @property
    def columns(self) -> list[Column]:
        """The points, the change, and as far as there are any its band and the change by the formula."""
        unit, changed = self.unit or "1", f"{identifier(self.quantity)}_{'relative_' if self.relative else ''}change"
        given = ((identifier(self.depends_on), self.x_unit or "1", self.x), (changed, unit, self.change),
                 ("lower", unit, self.lower), ("upper", unit, self.upper), ("formula", unit, self.formula))
        return [Column(name, unit, tuple(map(float, values))) for name, unit, values in given if values is not None]

    def describe(self) -> list[str]:
        """What the law is, and how it is added to a model, in sentences."""
        point, change, *_ = self.columns
        kind = "relative change" if self.relative else "change"
        added = f"{self.quantity} * (1 + y)" if self.relative else f"{self.quantity} + y"
        sentences = [
            f"Measured law: {kind} y [{change.unit}] of the {self.quantity} over the {self.depends_on} [{point.unit}].",
            f"In a model, {added} takes the place of the {self.quantity}.",
            "It is linear between its points, and constant beyond them."]
        if self.lower is not None:
            sentences.append(f"lower, upper: {self.band or 'interval at each point'}.")
        if self.known_up_to != "nothing":
            sentences.append(f"It is known up to a {self.known_up_to}, which parameters of the model replace.")
        return [*sentences, *([] if self.equation is None else [f"Named effect: {self.equation}."])]


def identifier(words: str) -> str:
    """Words as a name that programs accept, such as output_speed."""
    name = re.sub(r"\W+", "_", words, flags=re.ASCII).strip("_")
    return name if name[:1].isalpha() else f"law_{name}"
