"""Axes of unknowns: multiples of nominal with the same value in its engineering unit below, and outputs."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slipstick.pictures import theme, units
from slipstick.pictures.output import SHIFTING_TIME, Output
from slipstick.pictures.theme import Spec

_KINDS = ("mean of ", "std of ")


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
        shown: Spec = {"format": ".3~r", **options}
        if self.per_multiple is not None and self.physical_unit not in ("", "1"):
            unit = json.dumps(f" {self.physical_unit}", ensure_ascii=False)
            shown["labelExpr"] = f"[datum.label, format(datum.value * {self.per_multiple:.6g}, '.3~r') + {unit}]"
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
