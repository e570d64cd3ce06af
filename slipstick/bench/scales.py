"""How large things are on a bench: the magnitudes in which effects give their bounds and typical values."""

from dataclasses import dataclass

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.bench.physics import Physics
from slipstick.errors import InvalidValue

PASCAL_PER_BAR = 1e5
SCALES = {
    "pressure": ("bar", "the oil pressure at the largest current"),
    "current": ("A", "the largest current"),
    "speed": ("rad/s", "the largest motor speed"),
    "load_speed": ("rad/s", "the largest load speed"),
    "torque": ("N m", "the friction torque at the largest pressure"),
    "load_torque": ("N m", "that torque behind the gear"),
    "stroke": ("m", "the piston stroke"),
    "piston_rate": ("m/s", "the piston rate at the largest pressure"),
    "time": ("s", "the current delay"),
    "energy": ("kJ", "the largest kinetic energy of the load"),
}
"""The fields of `Scales`, with their units and in words."""


@dataclass(frozen=True)
class Scales:
    """Positive magnitudes of a bench, from its nominal parameters, current profiles and conditions.

    - `pressure` = k (u - a) in bar, with the largest current u of the profiles: `current` in A.
    - `speed` in rad/s is the largest motor speed, or a larger one at which an input shaft without converter starts;
      `load_speed` = speed / g_r in rad/s.
    - `torque` = alpha pressure in N m, the friction torque of the plates; `load_torque` = g_r torque in N m.
    - `stroke` = z_contact in m; `piston_rate` = b2 pressure / c2 in m/s, at which the piston begins to fill.
    - `time` = tau in s: nothing on the bench follows a command faster than the pressure does, so that a lag in the
      hydraulics, the plates, the shafts or a sensor is visible or not against it.
    - `energy` = J_o load_speed^2 / 2 in kJ with the largest load inertia: the plates turn about as much into heat.
    """

    pressure: float
    current: float
    speed: float
    load_speed: float
    torque: float
    load_torque: float
    stroke: float
    piston_rate: float
    time: float
    energy: float

    @classmethod
    def of(cls, physics: Physics, conditions: Conditions) -> "Scales":
        """The scales of a bench; raises `InvalidValue` where no profile exceeds the current bias."""
        p = dict(zip(parameters.NAMES, physics.nominal, strict=True))
        current = float(conditions.profile_current.max())
        if not current > max(0.0, p["current_bias"]):
            raise InvalidValue(f"The largest current of the profiles, {current:g} A, gives no oil pressure: the "
                               f"current bias is {p['current_bias']:g} A",
                               "Check the profiles, their unit, and current_bias")
        pressure = p["current_gain"] * (current - p["current_bias"])
        initial = conditions.initial_input_speed
        speed = max(float(conditions.motor_speed.max()), 0.0 if initial is None else float(initial.max()))
        load_speed = speed / p["gear_ratio"]
        torque = p["friction_coefficient"] * PASCAL_PER_BAR * pressure
        energy = 0.5 * float(conditions.load_inertia.max()) * load_speed**2 / 1000
        return cls(pressure, current, speed, load_speed, torque, p["gear_ratio"] * torque, p["contact_position"],
                   p["piston_pressure"] * pressure / p["piston_inertia"], p["current_delay"], energy)
