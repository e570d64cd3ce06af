"""Measured laws: changes of a quantity that are data, a table over what the quantity depends on.

A law is piecewise linear between its points and constant outside. It acts on the quantity after all effects on it:

    quantity (1 + law(x))   relative
    quantity + law(x)       absolute, with the law in the unit of the quantity

A law of a sensor changes what it reads, and depends on the true signals.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from slipstick.clutch.effects.effect import QUANTITIES as _ALL_QUANTITIES
from slipstick.clutch.effects.effect import SCALAR_DEPENDENCES, SENSORS
from slipstick.errors import InvalidValue, UnknownName
from slipstick.law_files import LawTable, write_law

MOST_LAWS, MOST_POINTS = 4, 16
"""Largest number of laws of a model, and of points of a law: the compiled loops have room for no more."""
_NARROWEST = 1e-9
"""Smallest distance of two points, as a share of the span of all."""

QUANTITIES = {**{name: unit for name, unit in _ALL_QUANTITIES.items() if name != "stick torque"}, **SENSORS}
"""What a law can change, with units: quantities and sensors. A change of the stick torque would decouple the shafts."""

DEPENDENCES = {**SCALAR_DEPENDENCES, "output torque": "N m"}
"""What a law can depend on, with units: functions of the state of the model, which no effect or law on them changes.

`slip` is that of the plates, |Omega - g_r omega|; `current` is that of the profile. `time` counts from the shift
command. `run order` is the position in the order of the test, from 0, and 0 where it is unknown. `heat` is the friction
energy of the plates since t = 0, and `time in contact` the integral of f_reg: the time since full contact and a part of
that of the closing. `piston position` is min(z_contact, max(0, k_T x3)), and `piston rate` is x3' of eq. 1. Only laws
of sensors can depend on the output torque, and these on nothing but `OF_SENSORS`.
"""

OF_SENSORS = ("motor speed", "input speed", "output speed", "pressure", "output torque", "time", "run order")
"""What a law of a sensor can depend on."""


@dataclass(frozen=True)
class MeasuredLaw:
    """A `change` of a `quantity` at the points `at` of what it `depends_on`, with 2 to 16 points.

    `at` rises and is in the unit of the dependence. `change` has no unit if `relative`, and else that of the quantity.
    Raises `UnknownName`, and `InvalidValue` for points that define no law.
    """

    quantity: str
    depends_on: str
    at: tuple[float, ...]
    change: tuple[float, ...]
    relative: bool

    def __post_init__(self) -> None:
        """Reject here what would give wrong results in the compiled loops; equal laws have equal specs."""
        for name in ("at", "change"):
            object.__setattr__(self, name, tuple(float(value) for value in getattr(self, name)))
        object.__setattr__(self, "relative", bool(self.relative))
        for kind, name, known in (("quantity (of a measured law)", self.quantity, QUANTITIES),
                                  ("dependence (of a measured law)", self.depends_on, DEPENDENCES)):
            if name not in known:
                raise UnknownName.of(kind, name, known)
        about = f"The law of the {self.quantity} over the {self.depends_on}"
        if len(self.at) != len(self.change) or not 2 <= len(self.at) <= MOST_POINTS:
            raise InvalidValue(f"{about} has {len(self.at)} points and {len(self.change)} values",
                               f"Give 2 to {MOST_POINTS} points with one value each")
        if not np.all(np.isfinite([*self.at, *self.change])):
            raise InvalidValue(f"{about} has a point or value that is not finite", "Give finite numbers")
        if min(high - low for low, high in pairwise(self.at)) <= _NARROWEST * (self.at[-1] - self.at[0]):
            raise InvalidValue(f"{about} has points that do not rise",
                               f"Sort them, and keep them more than {_NARROWEST:g} of their span apart")
        possible = OF_SENSORS if self.of_sensor else SCALAR_DEPENDENCES
        if self.depends_on not in possible:
            raise InvalidValue(f"{about} is none that a {'sensor' if self.of_sensor else 'quantity'} can have",
                               f"Let it depend on one of: {', '.join(possible)}")
        if self.depends_on == "piston rate" and self.quantity in ("valve current", "line pressure"):
            raise InvalidValue(f"{about} has no solution: the piston rate contains the derivative of that pressure",
                               "Let the law depend on the pressure or on the piston position")

    @property
    def of_sensor(self) -> bool:
        """Whether the law changes what a sensor reads."""
        return self.quantity in SENSORS

    @property
    def units(self) -> tuple[str, str]:
        """Units of `at` and of `change`."""
        return DEPENDENCES[self.depends_on], "1" if self.relative else QUANTITIES[self.quantity]

    def changed(self, value: float, x: float) -> float:
        """The quantity after the law, where it is `value` before and what it depends on is `x`."""
        law = float(np.interp(x, self.at, self.change))
        return value * (1.0 + law) if self.relative else value + law

    def spec(self) -> dict[str, Any]:
        """The law as JSON, with units."""
        return {"quantity": self.quantity, "depends_on": self.depends_on, "at": list(self.at),
                "change": list(self.change), "relative": self.relative,
                "units": dict(zip(("at", "change"), self.units, strict=True))}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "MeasuredLaw":
        """The law of a `spec()`; raises `UnknownName`, and `InvalidValue` also if it states other units."""
        law = cls(*(spec[name] for name in ("quantity", "depends_on", "at", "change", "relative")))
        expected = law.spec()["units"]
        if spec.get("units", expected) != expected:
            raise InvalidValue(f"The law of the {law.quantity} over the {law.depends_on} states other units than "
                               f"{law.units[0]} and {law.units[1]}", "Convert its points and values to these units")
        return law

    def export(self, suffix: str) -> bytes:
        """The law as a file that ends in `.csv`, `.mat`, `.mo` or `.h`; raises `InvalidValue` for another `suffix`."""
        return write_law(LawTable(self.quantity, self.depends_on, self.at, self.units[0], self.change, self.units[1],
                                  self.relative), suffix)
