"""How far a named effect's law is from the hidden one: relative L2 error over what the recordings visit."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import Signals

ABSCISSA = {"slip": ("plate_slip", 1.0), "energy": ("memory", 1e-3), "input_speed": ("input_speed", 1.0),
            "output_speed": ("output_speed", 1.0), "motor_speed": ("motor_speed", 1.0)}
"""The hidden law's abscissa -> what the catalogue's formulas look at, and the factor between their units."""
PARAMETERS = {"friction_coefficient": "friction_coefficient", "pressure_gain": "current_gain",
              "film_coefficient": "film_coefficient", "clearance": "contact_position",
              "oil_temperature_gain": "temperature_gain"}
"""Hidden quantity -> the parameter that a ratio multiplies."""
CONSTANT = ("lag", "compliance", "offset", "hysteresis")
"""Names of effects whose first coefficient is the changed quantity itself."""
LOAD = 60.0  # N m, of the brake, about


def error(truth: Mapping[str, Any], name: str, spec: Mapping[str, Any], runs: int) -> float | None:
    """|fitted - hidden| over |hidden| of the quantity that both laws change, by visits; None where they differ.

    `truth` is one of the `changed` of the hidden case, `spec` the fitted model as JSON.
    """
    effect = effects.find(name)
    coefficients = tuple(spec["effects"][name][one.name] for one in effect.coefficients)
    grid, change, visits = (np.array(truth[key], float) for key in ("grid", "change", "visits"))
    base, hidden = truth["base"], change
    if any(one in name for one in CONSTANT):
        fitted = np.full(len(grid), coefficients[0])
    elif name.endswith("sensor_gain"):
        fitted = coefficients[0] * grid
    elif truth["abscissa"] in ABSCISSA or truth["abscissa"] == "sequence":
        field, factor = ABSCISSA.get(truth["abscissa"], ("run", (runs - 1) / 100))
        if truth["kind"] == "ratio" and truth["quantity"] in PARAMETERS:
            value, hidden = spec["parameters"][PARAMETERS[truth["quantity"]]], base * change
        elif truth["quantity"] == "brake_torque":
            value, hidden = LOAD, LOAD * change
        elif truth["kind"] == "difference":
            value = 0.0
        else:
            return None
        blank = Signals(*np.zeros(len(Signals._fields)))
        law = effect.formula
        fitted = np.array([law(value, blank._replace(**{field: x * factor}), coefficients) for x in grid])
    else:
        return None
    return float(np.sqrt(visits @ (fitted - hidden) ** 2 / (visits @ hidden**2)))
