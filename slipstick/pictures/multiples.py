"""Axes of unknowns: multiples of nominal with the same value in its engineering unit below, and outputs."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slipstick.pictures import theme, units
from slipstick.pictures.output import SHIFTING_TIME, Output
from slipstick.pictures.theme import Spec

_KINDS = ("mean of ", "std of ")
_ROUND = (5.0, 2.0, 1.0)
_ROOM, _INSET = 62, 0.1
"""Width in px of a label with its gap, and share of an axis at each end without one: the next panel has labels, too."""


@dataclass(frozen=True)
class Unknown:
    """How an unknown is shown: its name, the `factor` from its value to the axis, and its `unit` there (may be empty).

    `per_multiple` is the value of the multiple 1 in `physical_unit`; None for an unknown that is no multiple.
    """

    name: str
    factor: float
    unit: str
    per_multiple: float | None = None
    physical_unit: str = ""

    @property
    def title(self) -> str:
        """Name and unit for an axis."""
        return f"{theme.in_words(self.name)} [{self.unit}]" if self.unit else theme.in_words(self.name)

    def axis(self, **options: Any) -> Spec:
        """Return the properties of an axis whose labels have the multiple and, below, the value in its unit."""
        shown: Spec = {"format": _format(options.get("values", ())), **options}
        if self.per_multiple is not None and self.physical_unit not in ("", "1"):
            unit = json.dumps(f" {self.physical_unit}", ensure_ascii=False)
            value = f"format(datum.value * {self.per_multiple:.6g}, '{shown['format']}')"
            shown["labelExpr"] = f"[datum.label, {value} + {unit}]"
        return shown

    def text(self, value: float) -> str:
        """A value of the unknown in its physical unit where it has one, else as on the axis."""
        if self.per_multiple is None or self.physical_unit in ("", "1"):
            return units.with_unit(units.number(self.factor * value), "" if self.per_multiple else self.unit)
        return units.with_unit(units.number(self.per_multiple * value), self.physical_unit)


def unknown(name: str, physical: Sequence[Mapping[str, Any]], output: Output = SHIFTING_TIME) -> Unknown:
    """How the unknown `name` of a fit of this `output` is shown.

    `physical` has name, unit and nominal value of each input.
    """
    if name.startswith("output"):
        return Unknown(name, output.factor, output.small)
    for kind in _KINDS:
        for entry in physical:
            if name == f"{kind}{entry['name']}":
                typical = entry["nominal"] if kind == _KINDS[0] else entry["std"] or entry["nominal"]
                unit, factor = units.scale(entry["unit"], typical)
                return Unknown(name, 1.0, "multiple of nominal", factor * entry["nominal"], unit)
    return Unknown(name, 1.0, "multiple of nominal" if name.startswith(_KINDS) else "")


def ticks(domain: Sequence[float], size: float) -> list[float]:
    """Two or three round values of an axis over `domain` of at least 100 px, with room for labels of `Unknown.axis`."""
    low, high = domain
    if low == high:
        return [low]
    pixel, inset = (high - low) / size, _INSET * (high - low)
    largest = math.floor(math.log10(high - low))
    for step in (factor * 10.0**power for power in (largest, largest - 1) for factor in _ROUND):
        counts = range(math.ceil((low + inset) / step), math.floor((high - inset) / step) + 1)
        values = [float(f"{step * count:.10g}") for count in counts]
        if values and values[-1] - values[0] >= _ROOM * pixel:
            break
    middle = values[len(values) // 2]
    return [values[0], *([middle] if min(middle - values[0], values[-1] - middle) >= _ROOM * pixel else []), values[-1]]


def _format(values: Sequence[float]) -> str:
    """The number format with the digits that these values need, and at least three."""
    digits = (len(f"{abs(value):.10g}".replace(".", "").lstrip("0")) for value in values)
    return f".{max([3, *digits])}~r"
