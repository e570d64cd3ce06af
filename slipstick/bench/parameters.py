"""The 20 parameters of the model, eqs. 1-4 of Tod et al.

Their values are those of a bench (`Bench`). The ramp of the regularization, its width `ramp_share` and its smoothstep
form, is a choice of this project.
"""

from dataclasses import dataclass

from slipstick.errors import UnknownName


@dataclass(frozen=True)
class Parameter:
    """A parameter: its `unit`, the paper's `symbol`, and whether the model needs a positive value."""

    name: str
    symbol: str
    unit: str
    meaning: str
    positive: bool = False


PARAMETERS = (
    Parameter("current_delay", "tau", "s", "time delay from current to pressure", True),
    Parameter("current_bias", "a", "A", "current bias"),
    Parameter("current_gain", "k", "bar/A", "gain from current to pressure", True),
    Parameter("piston_pressure_rate", "a2", "m/bar", "piston coefficient on the pressure derivative"),
    Parameter("piston_pressure", "b2", "m/(s bar)", "piston coefficient on the pressure", True),
    Parameter("piston_inertia", "c2", "1", "piston coefficient on the derivative of the piston state", True),
    Parameter("piston_return", "d2", "1/s", "piston coefficient on the piston state", True),
    Parameter("pressure_bias", "aa", "bar", "oil pressure bias in the piston position"),
    Parameter("temperature_gain", "k_T", "1", "gain of the oil temperature on the piston position", True),
    Parameter("contact_position", "z_contact", "m", "largest piston displacement", True),
    Parameter("initial_position", "x3(0)", "m", "initial piston position"),
    Parameter("contact_length", "beta", "m", "length in the contact-pressure law of eq. 1"),
    Parameter("film_coefficient", "gamma", "N m^2 s", "plate geometry and fluid viscosity"),
    Parameter("friction_coefficient", "alpha", "N m/Pa", "plate geometry and dynamic friction", True),
    Parameter("gear_ratio", "g_r", "1", "gear ratio between clutch output and load shaft", True),
    Parameter("input_inertia", "J_i", "kg m^2", "inertia of the input shaft", True),
    Parameter("input_coulomb", "T_ic", "N m", "Coulomb friction of the input shaft"),
    Parameter("input_viscous", "b_iv", "N m s", "viscous friction of the input shaft"),
    Parameter("output_viscous", "b_ov", "N m s", "viscous friction of the output shaft"),
    Parameter("ramp_share", "eps", "1", "fraction of the stroke over which f_reg rises from 0 to 1", True),
)

NAMES = tuple(parameter.name for parameter in PARAMETERS)
UNCERTAIN = ("current_delay", "current_bias", "current_gain", "pressure_bias", "temperature_gain", "initial_position",
             "friction_coefficient")
"""The parameters that the paper treats as uncertain (section II.C)."""


def index(name: str) -> int:
    """Index of the parameter `name` in the parameter vector; raises `UnknownName`."""
    if name not in NAMES:
        raise UnknownName.of("parameter", name, NAMES)
    return NAMES.index(name)
