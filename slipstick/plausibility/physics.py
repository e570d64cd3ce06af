"""The parameters of a bench by name, and the steady states that eqs. 1-4 give for each of its conditions."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slipstick.bench import Bench, parameters


@dataclass(frozen=True, eq=False)
class SteadyStates:
    """What the model's equations say about the n conditions of `bench` without integration."""

    bench: Bench

    def __getitem__(self, name: str) -> float:
        """Nominal value of a parameter in its unit."""
        return self.bench.physics.nominal[parameters.index(name)]

    @cached_property
    def current(self) -> np.ndarray:
        """Largest current of each condition's profile in A, (n,): every bound below holds for any smaller one."""
        conditions = self.bench.conditions
        return np.asarray(conditions.profile_current.max(axis=1)[conditions.current_profile])

    @cached_property
    def pressure(self) -> np.ndarray:
        """Steady pressure at that current in bar, (n,): eq. 1 at rest, k (u - a)."""
        return np.asarray(self["current_gain"] * (self.current - self["current_bias"]))

    @cached_property
    def piston(self) -> np.ndarray:
        """Steady piston position at that pressure in m, (n,): k_T b2 (p - aa)/d2, not limited by the contact."""
        state = self["piston_pressure"] * (self.pressure - self["pressure_bias"]) / self["piston_return"]
        return np.asarray(self["temperature_gain"] * state)

    @cached_property
    def contact(self) -> float:
        """Piston position in m from which f_reg exceeds 0: (1 - eps) z_contact."""
        return (1 - self["ramp_share"]) * self["contact_position"]

    @cached_property
    def capacity(self) -> np.ndarray:
        """Largest friction torque of the closed clutch in N m, (n,): alpha P with P of eq. 1 at z = z_contact."""
        clearance = self["contact_position"] - self["contact_length"]
        share = self["contact_position"] / clearance if clearance > 0 else 0.0
        return np.asarray(self["friction_coefficient"] * share * 1e5 * np.maximum(0, self.pressure))

    @cached_property
    def open_drag(self) -> np.ndarray:
        """Film torque of the open clutch in N m, (n,): eq. 2 at x3(0), the input at motor speed, the load at rest."""
        conditions = self.bench.conditions
        speed = conditions.motor_speed if conditions.initial_input_speed is None else conditions.initial_input_speed
        position = max(0.0, self["temperature_gain"] * self["initial_position"])
        clearance = self["contact_position"] - position
        slope = self["film_coefficient"] / clearance if clearance > 0 else 0.0
        return np.asarray(slope * speed / self["gear_ratio"])

    def input_torque(self, ratio: float) -> np.ndarray:
        """Torque on the input shaft less its losses in N m, (n,), at `ratio` of input and motor speed (eq. 3)."""
        conditions, converter = self.bench.conditions, self.bench.physics.converter
        speed = ratio * conditions.motor_speed
        losses = self["input_coulomb"] + self["input_viscous"] * speed
        if conditions.input_torque is not None:
            return np.asarray(conditions.input_torque - losses)
        assert converter is not None
        return np.array([converter.torque(*pair) for pair in zip(speed, conditions.motor_speed, strict=True)]) - losses
