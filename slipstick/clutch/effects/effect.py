"""The interface of an effect: the model quantity that it changes, the formula, and its coefficients."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import prod
from typing import Any, NamedTuple

import numpy as np

from slipstick.bench.scales import SCALES, Scales
from slipstick.clutch.effects.shape import Shape
from slipstick.errors import InvalidValue, UnknownName

MAX_COEFFICIENTS = 4
"""Largest number of coefficients of an effect."""
QUANTITIES = {
    "valve current": "A",
    "line pressure": "bar",
    "chamber pressure": "bar",
    "piston gain": "1",
    "piston rate": "m/s",
    "clearance": "m",
    "contact pressure": "Pa",
    "friction coefficient": "N m/Pa",
    "film torque": "N m",
    "converter torque": "N m",
    "brake torque": "N m",
    "load torque": "N m",
    "stick torque": "N m",
}
"""Quantities that an effect can change, with units, in the order in which the model evaluates them."""

SENSORS = {
    "pressure sensor": "bar",
    "input speed sensor": "rad/s",
    "output speed sensor": "rad/s",
    "output torque sensor": "N m",
}
"""Sensors that an effect can change, with units. The effect acts on the signal after integration."""

SCALAR_DEPENDENCES = {
    "motor speed": "rad/s",
    "input speed": "rad/s",
    "output speed": "rad/s",
    "slip": "rad/s",
    "pressure": "bar",
    "current": "A",
    "time": "s",
    "run order": "1",
    "heat": "kJ",
    "time in contact": "s",
    "piston position": "m",
    "piston rate": "m/s",
}
"""What a quantity can depend on as a law over one number, with units (`slipstick.clutch.laws` defines each)."""

DEPENDENCES = {
    **SCALAR_DEPENDENCES,
    "past current": "A",
    "direction": "1",
    "twist": "rad",
    "lag": "s",
    "offset": "unit of the quantity",
    "gain": "1",
}
"""What a quantity can depend on, with units; the other ones are no law over one number.

On its `lag` if it follows what it should be with a delay; an `offset` and a `gain` are changes by a constant and in
proportion. `direction` is that of the piston, `twist` that of the shafts.
"""

BLOCKS = {
    "pressure": ("valve current", "line pressure", "pressure sensor"),
    "torque": ("chamber pressure", "piston gain", "piston rate", "clearance", "contact pressure",
               "friction coefficient", "film torque", "stick torque", "output torque sensor"),
    "output speed": ("brake torque", "load torque", "output speed sensor"),
    "input speed": ("converter torque", "input speed sensor"),
}
"""Blocks of the model, cut at the measured signals: output signal -> quantities between the inputs and that signal."""


class Signals(NamedTuple):
    """Signals available to a formula, at one instant of one engagement."""

    time: float
    """time since the shift command, s"""
    pressure: float
    """oil pressure, bar (x1)"""
    pressure_rate: float
    """derivative of the oil pressure, bar/s (x2)"""
    piston_state: float
    """piston state, m (x3)"""
    input_speed: float
    """speed of the input shaft, rad/s (Omega)"""
    output_speed: float
    """speed of the load shaft, behind the gear, rad/s (omega)"""
    plate_slip: float
    """slip speed of the plates, Omega - g_r omega, rad/s"""
    motor_speed: float
    """speed of the motor, rad/s (omega_m)"""
    current: float
    """valve current of the profile, A (u)"""
    current_direction: float
    """+1 where the current rises, -1 where it falls; where it is constant, the previous direction"""
    current_reversal: float
    """current at the last reversal of the profile, A; before the first reversal, the current at t = 0"""
    current_swing: float
    """magnitude of the change of the current up to its last reversal, A; 0 before the first reversal"""
    run: float
    """position of the engagement in the run order, divided by 100; 0 where the run order is unknown"""
    stuck: float
    """1 in the stick state, else 0"""
    clutch_torque: float
    """torque through the clutch, N m, positive where it drives the load; 0 except in the rate of a memory"""
    friction_power: float
    """friction power of the plates, W; 0 except in the rate of a memory"""
    memory: float
    """memory of the effect; 0 for an effect without one"""


Formula = Callable[[float, Signals, tuple[float, ...]], float]
SensorFormula = Callable[[np.ndarray, np.ndarray, tuple[np.ndarray, ...]], np.ndarray]


def check_pair(quantity: str, depends_on: str, of: str = "") -> None:
    """Raise `UnknownName` for an unknown quantity or dependence; the message says what it is `of`."""
    for kind, name, known in (("quantity", quantity, [*QUANTITIES, *SENSORS]),
                              ("dependence", depends_on, [*DEPENDENCES])):
        if name not in known:
            raise UnknownName.of(f"{kind}{of}", name, known)


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of an effect, bounded by `lower` and `upper` in a study.

    `lower`, `upper` and `typical` are multiples of a product of scales of the bench: `scale` maps scale -> power, such
    as {"pressure": 1, "speed": -2}, and is empty for a coefficient without a dimension. `neutral` is in `unit`, because
    a model without a bench at hand is complete with the neutral values of what it does not name.

    Without `shape` it is an amplitude: the effect is absent where all its amplitudes are at `neutral`. A coefficient
    with `shape`, such as a decay speed, matters only where an amplitude is not neutral; its `neutral` is a reference
    value. `typical` is a plausible value of a present effect: a study takes its first step in units of it and starts
    its search there.
    """

    name: str
    unit: str
    neutral: float
    lower: float
    upper: float
    meaning: str
    typical: float
    shape: bool = False
    scale: Mapping[str, int] = field(default_factory=dict)

    def on(self, scales: Scales) -> "Coefficient":
        """The coefficient on a bench: `lower`, `upper` and `typical` in `unit`."""
        size = prod(float(getattr(scales, name)) ** power for name, power in self.scale.items())
        return replace(self, lower=self.lower * size, upper=self.upper * size, typical=self.typical * size, scale={})


@dataclass(frozen=True)
class Memory:
    """A state variable of an effect, available to its formula as `signals.memory`.

    `rate(value, signals, coefficients)` is its time derivative, with `value` as passed to the formula. The initial
    value is zero; with `relaxed` it is the value of the quantity at t = 0.
    """

    rate: Formula
    relaxed: bool = False


@dataclass(frozen=True)
class Effect:
    """One physical effect that the paper's model lacks.

    `formula(value, signals, coefficients)` returns the changed value of `quantity`, and exactly `value` at the neutral
    coefficients. It is compiled, so it uses plain arithmetic and the `exp` of `slipstick.clutch.fastmath`. On a sensor
    it is a `SensorFormula(values, times, coefficients)` of a whole signal (..., k) at sample times (k,) in s.

    `title`, `law`, `signature` and `source` appear in reports: the name in words, the formula, the visible consequence
    on a test bench, and the literature.

    A study measures a law, without the formula. It finds the effect by what the quantity `depends_on`, and for one of
    the `SCALAR_DEPENDENCES` by the `shape` of the change over it. `also` lists further pairs (quantity, depends on)
    under which a study may find the same effect, with the same shape.

    An effect with fast dynamics gives its `time_constant(*coefficients)` in s, which maps arrays (m,) to one array (m,)
    and is infinite where the effect is neutral; steps stay below a third of it. `uses_run_order` is set where the
    formula reads `signals.run`.

    Raises `UnknownName` for an unknown quantity, dependence or scale, `InvalidValue` for an invalid number of
    coefficients, or a shape over what is not scalar.
    """

    name: str
    title: str
    quantity: str
    depends_on: str
    law: str
    coefficients: tuple[Coefficient, ...]
    source: str
    signature: str
    formula: Callable[..., Any]
    memory: Memory | None = None
    time_constant: Callable[..., np.ndarray] | None = None
    uses_run_order: bool = False
    shape: Shape | None = None
    also: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        """Reject here what would fail later without the name of the effect."""
        for pair in self.pairs:
            check_pair(*pair, of=f" (of the effect {self.name})")
        if self.shape and self.depends_on not in SCALAR_DEPENDENCES:
            raise InvalidValue(f"The effect {self.name} has a shape, but its law over the {self.depends_on} is not "
                               "a law over one number", "Leave out the shape, or change `depends_on`")
        if not 1 <= len(self.coefficients) <= MAX_COEFFICIENTS:
            raise InvalidValue(f"The effect {self.name} has {len(self.coefficients)} coefficients",
                               f"Give 1 to {MAX_COEFFICIENTS} coefficients: the compiled loops support no more")
        for name in (name for c in self.coefficients for name in c.scale if name not in SCALES):
            raise UnknownName.of(f"scale (of the effect {self.name})", name, [*SCALES])

    def on(self, scales: Scales) -> "Effect":
        """The effect on a bench: bounds and typical values of the coefficients in their units.

        Raises `InvalidValue` where the typical value, or the neutral value of an amplitude, is not within the bounds.
        That of a shape coefficient is the same on every bench, and on an unusual one may be outside.
        """
        coefficients = tuple(c.on(scales) for c in self.coefficients)
        for c in coefficients:
            inside = (c.typical,) if c.shape else (c.neutral, c.typical)
            if not c.lower <= min(inside) <= max(inside) <= c.upper:
                raise InvalidValue(f"The coefficient {c.name} of the effect {self.name} has the neutral value "
                                   f"{c.neutral:g} {c.unit} and the typical value {c.typical:g} {c.unit}",
                                   f"Put both within its bounds, {c.lower:g} and {c.upper:g} {c.unit}")
        return replace(self, coefficients=coefficients)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Pairs (quantity, depends on) under which a study may find the effect, its own first."""
        return (self.quantity, self.depends_on), *self.also

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return {**QUANTITIES, **SENSORS}[self.quantity]

    @property
    def block(self) -> str:
        """Block of the model that contains the quantity: a key of `BLOCKS`."""
        return next(block for block, quantities in BLOCKS.items() if self.quantity in quantities)

    @property
    def neutral(self) -> tuple[float, ...]:
        """Neutral value of each coefficient, in their order."""
        return tuple(coefficient.neutral for coefficient in self.coefficients)

    def is_neutral(self, coefficients: Sequence[float] | np.ndarray) -> bool:
        """Whether the effect is absent at all of its `coefficients` (..., c) in their order: amplitudes are neutral."""
        amplitudes = [not coefficient.shape for coefficient in self.coefficients]
        return not np.any((np.asarray(coefficients) != np.array(self.neutral))[..., amplitudes])

    @property
    def typical(self) -> tuple[float, ...]:
        """Typical value of each coefficient, in their order; in their units on a bench (`on`)."""
        return tuple(coefficient.typical for coefficient in self.coefficients)
