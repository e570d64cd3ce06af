"""What an effect is: a named quantity of the model, a formula that changes it, and coefficients."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from slipstick.errors import InvalidValue, UnknownName

MOST_COEFFICIENTS = 4
"""Coefficients that an effect may have."""
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
    "load torque": "N m",
    "stick torque": "N m",
}
"""The quantities an effect can change, with units, in the order in which the model evaluates them."""

SENSORS = {
    "pressure sensor": "bar",
    "input speed sensor": "rad/s",
    "output speed sensor": "rad/s",
    "output torque sensor": "N m",
}
"""What an effect on a sensor changes, with units: the signal that it shows, after integration."""

BLOCKS = {
    "pressure": ("valve current", "line pressure", "pressure sensor"),
    "torque": ("chamber pressure", "piston gain", "piston rate", "clearance", "contact pressure",
               "friction coefficient", "film torque", "stick torque", "output torque sensor"),
    "output speed": ("load torque", "output speed sensor"),
    "input speed": ("converter torque", "input speed sensor"),
}
"""The model cut at the signals that a bench measures: the quantities that lie between its inputs and each of them."""


class Signals(NamedTuple):
    """What a formula may look at, at one instant of one engagement."""

    time: float
    """s since the shift command"""
    pressure: float
    """oil pressure, bar (x1)"""
    pressure_rate: float
    """bar/s (x2)"""
    piston_state: float
    """m (x3)"""
    input_speed: float
    """rad/s (Omega)"""
    output_speed: float
    """rad/s, behind the gear (omega)"""
    plate_slip: float
    """Omega - g_r omega, rad/s: what the plates rub at"""
    motor_speed: float
    """rad/s (omega_m)"""
    current: float
    """valve current that the profile asks for, A (u)"""
    current_direction: float
    """+1 where the current rises, -1 where it falls; where it is held, what it did before"""
    current_turn: float
    """current at the last turn of the profile, A; before the first, that at t = 0"""
    current_swing: float
    """how far the current had gone when it last turned, A; before the first turn 0"""
    run: float
    """place of the engagement in the run order, in hundreds; 0 where it is not known"""
    stuck: float
    """1 while the plates stick, else 0"""
    clutch_torque: float
    """torque through the clutch, N m, positive where it drives the load; 0 but in the rate of a memory"""
    friction_power: float
    """heat that the plates make, W; 0 but in the rate of a memory"""
    memory: float
    """the effect's own state, if it keeps one"""


Formula = Callable[[float, Signals, tuple[float, ...]], float]
SensorFormula = Callable[[np.ndarray, np.ndarray, tuple[np.ndarray, ...]], np.ndarray]


@dataclass(frozen=True)
class Coefficient:
    """A number the effect brings; a study searches between the bounds.

    At the `neutral` value of its amplitudes an effect is absent. A coefficient of its `shape` (how fast something
    fades, say) matters only where an amplitude is not neutral, and its `neutral` is no more than a reference.
    `typical` is a plausible value of an effect that acts: the size of a first step away from neutral, the start of a
    search.
    """

    name: str
    unit: str
    neutral: float
    lower: float
    upper: float
    meaning: str
    typical: float
    shape: bool = False


@dataclass(frozen=True)
class Memory:
    """A state of its own that an effect keeps: `signals.memory`, at t = 0 zero, or where `relaxed` the quantity itself.

    `rate(value, signals, coefficients)` is its time derivative, with `value` as the formula is given it.
    """

    rate: Formula
    relaxed: bool = False


@dataclass(frozen=True)
class Effect:
    """One physical effect the paper's model lacks.

    `formula(value, signals, coefficients)` returns the changed value of `quantity` and must give back exactly
    `value` at the neutral coefficients. It is compiled: plain arithmetic, `slipstick.clutch.fastmath` for exp. On a
    sensor it is a `SensorFormula(values, times, coefficients)` of a whole signal (..., k) at sample times (k,) in s.
    `law` is the same in words of mathematics, `title` the name in words, `signature` what a bench would show, `source`
    where it is from. What changes faster than the plain model needs a `time_constant(*coefficients)` in s, arrays (m,)
    to one (m,) that is infinite where the effect is neutral: steps stay below a third of it. An effect that looks at
    `signals.run` says so in `uses_run_order`. Where its shape coefficients take none but certain values, `forms` lists
    them. Only what is `listed` belongs to the catalogue of named effects (the others: open_terms.py).
    """

    name: str
    title: str
    quantity: str
    law: str
    coefficients: tuple[Coefficient, ...]
    source: str
    signature: str
    formula: Callable[..., Any]
    memory: Memory | None = None
    time_constant: Callable[..., np.ndarray] | None = None
    uses_run_order: bool = False
    forms: tuple[tuple[float, ...], ...] = ()
    listed: bool = True

    def __post_init__(self) -> None:
        """Refuse what fails later, where nothing says which file is to blame; raises `InvalidValue`, `UnknownName`."""
        known = [*QUANTITIES, *SENSORS]
        if self.quantity not in known:
            raise UnknownName.of(f"quantity (of the effect {self.name})", self.quantity, known)
        if not 1 <= len(self.coefficients) <= MOST_COEFFICIENTS:
            raise InvalidValue(f"The effect {self.name} has {len(self.coefficients)} coefficients",
                               f"Give 1 to {MOST_COEFFICIENTS}: the compiled loops have room for no more")
        for one in self.coefficients:
            if not one.lower <= min(one.neutral, one.typical) <= max(one.neutral, one.typical) <= one.upper:
                raise InvalidValue(f"{one.name} of the effect {self.name} is neutral at {one.neutral} and typical at "
                                   f"{one.typical}", f"Put both within its bounds, {one.lower} and {one.upper}")

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return {**QUANTITIES, **SENSORS}[self.quantity]

    @property
    def block(self) -> str:
        """The block of the model that the effect acts in: a key of `BLOCKS`."""
        return next(block for block, quantities in BLOCKS.items() if self.quantity in quantities)

    @property
    def neutral(self) -> tuple[float, ...]:
        """The coefficients at which the effect is absent, in their order."""
        return tuple(coefficient.neutral for coefficient in self.coefficients)

    @property
    def typical(self) -> tuple[float, ...]:
        """Coefficients of an effect that acts, in their order."""
        return tuple(coefficient.typical for coefficient in self.coefficients)
