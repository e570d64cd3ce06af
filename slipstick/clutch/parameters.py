"""The 20 parameters of the model, eqs. 1-4 of Tod et al.

The paper publishes no values. The nominal values here are plausible for a heavy-vehicle test bench. The ramp of the
regularization, its width `ramp_share` and its smoothstep form, is also a choice of this project.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.errors import UnknownName


@dataclass(frozen=True)
class Parameter:
    """A parameter: nominal `value` in `unit`, the paper's `symbol`, and whether it is uncertain in the paper (II.C).

    `lower` and `upper` are the bounds of a calibration, in multiples of the nominal value.
    """

    name: str
    symbol: str
    value: float
    unit: str
    meaning: str
    uncertain: bool = False
    lower: float = 0.5
    upper: float = 1.5


PARAMETERS = (
    Parameter("current_delay", "tau", 0.05, "s", "time delay from current to pressure", True),
    Parameter("current_bias", "a", 0.1, "A", "current bias", True),
    Parameter("current_gain", "k", 20.0, "bar/A", "gain from current to pressure", True),
    Parameter("piston_pressure_rate", "a2", 4e-6, "m/bar", "piston coefficient on the pressure derivative"),
    Parameter("piston_pressure", "b2", 1.6e-3, "m/(s bar)", "piston coefficient on the pressure"),
    Parameter("piston_inertia", "c2", 1.0, "1", "piston coefficient on the derivative of the piston state"),
    Parameter("piston_return", "d2", 1.0, "1/s", "piston coefficient on the piston state"),
    Parameter("pressure_bias", "aa", 1.6, "bar", "oil pressure bias in the piston position", True),
    Parameter("temperature_gain", "k_T", 1.0, "1", "gain of the oil temperature on the piston position", True),
    Parameter("contact_position", "z_contact", 2e-3, "m", "largest piston displacement"),
    Parameter("initial_position", "x3(0)", 5e-4, "m", "initial piston position", True, 0.1, 3.0),
    Parameter("contact_length", "beta", 2e-5, "m", "length in the contact-pressure law of eq. 1"),
    Parameter("film_coefficient", "gamma", 8e-5, "N m^2 s", "plate geometry and fluid viscosity"),
    Parameter("friction_coefficient", "alpha", 3.2e-4, "N m/Pa", "plate geometry and dynamic friction", True),
    Parameter("gear_ratio", "g_r", 3.2, "1", "gear ratio between clutch output and load shaft"),
    Parameter("input_inertia", "J_i", 0.25, "kg m^2", "inertia of the input shaft"),
    Parameter("input_coulomb", "T_ic", 4.0, "N m", "Coulomb friction of the input shaft"),
    Parameter("input_viscous", "b_iv", 0.02, "N m s", "viscous friction of the input shaft"),
    Parameter("output_viscous", "b_ov", 0.6, "N m s", "viscous friction of the output shaft"),
    Parameter("ramp_share", "eps", 0.08, "1", "fraction of the stroke over which f_reg rises from 0 to 1"),
)

NAMES = tuple(parameter.name for parameter in PARAMETERS)
UNCERTAIN = tuple(parameter.name for parameter in PARAMETERS if parameter.uncertain)


def index(name: str) -> int:
    """Index of the parameter `name` in the parameter vector; raises `UnknownName`."""
    if name not in NAMES:
        raise UnknownName.of("parameter", name, NAMES)
    return NAMES.index(name)


def nominal() -> np.ndarray:
    """Nominal values, shape (20,), in the units of `PARAMETERS`."""
    return np.array([parameter.value for parameter in PARAMETERS])
