"""The equations of the bench: those of the paper, in which effects can change every quantity.

Lanes are engagements. A phase consists of the piece of the current, the mode (rest, slip or stick) and the sign of the
slip. For the states see states.py.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from .bench import Bench
from .effect import Acting
from .equations import clutch, compliance, hydraulics, shafts
from .states import (
    CONTACT,
    CONVERTER,
    ENERGY,
    HEAT,
    INPUT,
    MAGNET,
    OUTPUT,
    PISTON,
    POSITION,
    PRESSURE,
    REST,
    SLIP,
    STICK,
    TOLERANCE,
    TWIST,
    Quantities,
)


@dataclass(frozen=True)
class Engagements:
    """n engagements: `values` of the parameters, conditions, and position in the test sequence (0 to 1), each (n,).

    The current is linear between the values `knot_current` at the times `knot_time`, (n, m); the last knot may be
    repeated. The motor speed is lower than `motor_speed` by the fraction `sag` at the largest torque on the pump.
    `clocks` gives the delays of sensors in sampling periods, at most 1. `channels` are further quantities, (n,) each,
    that effects may depend on.
    """

    bench: Bench
    values: Mapping[str, np.ndarray]
    motor_speed: np.ndarray
    load_inertia: np.ndarray
    brake_torque: np.ndarray
    sequence: np.ndarray
    knot_time: np.ndarray
    knot_current: np.ndarray
    effects: tuple[Acting, ...] = ()
    sag: float = 0.0
    clocks: Mapping[str, float] = field(default_factory=dict)
    channels: Mapping[str, np.ndarray] = field(default_factory=dict)

    tolerance = TOLERANCE

    def take(self, lanes: np.ndarray) -> "Engagements":
        """Return the engagements at the indices `lanes`, which may repeat."""
        columns = {column.name: getattr(self, column.name) for column in fields(self)}
        arrays = {name: column[lanes] for name, column in columns.items() if isinstance(column, np.ndarray)}
        return replace(self, values={name: value[lanes] for name, value in self.values.items()},
                       channels={name: value[lanes] for name, value in self.channels.items()},
                       effects=tuple(replace(acting, acts=acting.acts[lanes]) for acting in self.effects), **arrays)

    @cached_property
    def _effects_on(self) -> dict[str, list[Acting]]:
        effects_on: dict[str, list[Acting]] = {}
        for acting in self.effects:
            effects_on.setdefault(acting.effect.quantity, []).append(acting)
        return effects_on

    def is_affected(self, quantity: str) -> bool:
        """Return whether an effect changes the quantity."""
        return quantity in self._effects_on

    def with_effects(self, quantity: str, value: np.ndarray, q: Quantities) -> np.ndarray:
        """Return the value (n,) with all effects on the quantity, and put it into `q`."""
        for acting in self._effects_on.get(quantity, ()):
            value = apply_effect(acting, value, q[acting.effect.abscissa])
        q[quantity] = value
        return value

    def limit(self, phase: np.ndarray) -> np.ndarray:
        """Return the time (n,) of the end of the present piece of the current."""
        return self.knot_time[np.arange(phase.shape[1]), phase[0] + 1]

    def advance(self, phase: np.ndarray, lanes: np.ndarray) -> None:
        """Begin the next piece of the current of some lanes."""
        phase[0, lanes] += 1

    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Return states and phases at time 0, with the input speed at which converter torque and losses balance."""
        n = len(self.motor_speed)
        state, phase = np.zeros((len(TOLERANCE), n)), np.zeros((3, n), int)
        phase[2] = 1
        state[PISTON], state[MAGNET] = self.values["x30"], self.knot_current[:, 0]
        low, high = 0.5 * self.motor_speed, self.motor_speed.copy()
        for _ in range(60):
            state[INPUT] = (low + high) / 2
            q = self.quantities(np.zeros(n), state, phase)
            driven = q["converter_torque"] > q["input_drag"]
            low, high = np.where(driven, state[INPUT], low), np.where(driven, high, state[INPUT])
        state[CONVERTER] = q["converter_torque"]
        slipping = self.quantities(np.zeros(n), state, phase)["margin"] < 0
        phase[1, slipping] = SLIP
        return state, phase

    def rates(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rates (states, n) of the states and the margin (n,) of the mode."""
        q = self.quantities(time, state, phase)
        return q["rates"], q["margin"]

    def switch(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray, lanes: np.ndarray) -> None:
        """Change phases and states of the lanes whose mode has ended, in place."""
        if not len(lanes):
            return
        # Transitions: rest -> slip, stick -> slip, and slip -> stick if the speeds are equal, otherwise slip -> rest.
        new_state, mode = state[:, lanes], phase[1, lanes]
        ratio = self.values["gr"][lanes]
        synchronised = (mode == SLIP) & (phase[2, lanes] * (new_state[INPUT] / ratio - new_state[OUTPUT]) < 0)
        switching = self.take(lanes)
        q = switching.quantities(time[lanes], new_state, phase[:, lanes])
        stopped = (mode == SLIP) & ~synchronised
        new_state[OUTPUT] = np.where(stopped, 0, np.where(synchronised, new_state[INPUT] / ratio, new_state[OUTPUT]))
        for _ in range(4 if self.is_affected("shaft_compliance") else 0):  # the compliance may depend on the twist
            twist = compliance(switching, new_state, q) * q["output_torque"]
            new_state[TWIST] = np.where(synchronised, twist, new_state[TWIST])
        phase[1, lanes] = np.where(synchronised, STICK, np.where(mode == SLIP, REST, SLIP))
        phase[2, lanes] = np.where(mode == STICK, np.sign(q["output_torque"]), phase[2, lanes])
        state[:, lanes] = new_state

    def quantities(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> Quantities:
        """Return all quantities of the equations, (n,) each, with the `rates` of the states and the `margin`.

        The mode of an engagement ends when its margin becomes negative.
        """
        q: Quantities = {
            "time": time, "sequence": self.sequence, "motor_speed": self.motor_speed, "pressure": state[PRESSURE],
            "piston": state[PISTON], "input_speed": state[INPUT], "output_speed": state[OUTPUT],
            "slip": np.abs(state[INPUT] / self.values["gr"] - state[OUTPUT]), "energy": state[ENERGY],
            "contact_time": state[CONTACT], "output_position": state[POSITION], "heat": state[HEAT], **self.channels,
        }
        rates = np.zeros_like(state)
        hydraulics(self, q, rates, state, phase)
        clutch(self, q, rates, state, phase)
        shafts(self, q, rates, state, phase)
        q["rates"] = rates
        return q


def apply_effect(acting: Acting, value: np.ndarray, abscissa: np.ndarray) -> np.ndarray:
    """Return the values (n, ...) of a quantity with an effect at the abscissas (n, ...)."""
    law = acting.effect.law(acting.amplitude, abscissa)
    acts = acting.acts.reshape(-1, *[1] * (np.ndim(value) - 1))
    if acting.effect.kind == "ratio":
        return value * np.where(acts, law, 1.0)
    return value + np.where(acts, law, 0.0)
