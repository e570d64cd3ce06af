"""What an effect is: a named quantity of the model, a formula that changes it, and coefficients."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

QUANTITIES = {
    "valve current": "A",
    "chamber pressure": "bar",
    "piston rate": "m/s",
    "clearance": "m",
    "contact pressure": "Pa",
    "friction coefficient": "N m/Pa",
    "film torque": "N m",
    "converter torque": "N m",
    "load torque": "N m",
}
"""The quantities an effect can change, with units, in the order in which the model evaluates them."""


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


@dataclass(frozen=True)
class Coefficient:
    """A number the effect brings: at `neutral` the effect is absent; a study searches between the bounds."""

    name: str
    unit: str
    neutral: float
    lower: float
    upper: float
    meaning: str


Formula = Callable[[float, Signals, tuple[float, ...]], float]


@dataclass(frozen=True)
class Effect:
    """One physical effect the paper's model lacks.

    `formula(value, signals, coefficients)` returns the changed value of `quantity` and must give back exactly
    `value` at the neutral coefficients. It is compiled: plain arithmetic, `slipstick.clutch.fastmath` for exp.
    `law` is the same in words of mathematics, `signature` what a bench would show, `source` where it is from.
    """

    name: str
    quantity: str
    law: str
    coefficients: tuple[Coefficient, ...]
    source: str
    signature: str
    formula: Formula
