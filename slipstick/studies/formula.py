"""The formula of a named effect: over what it depends on, beside the measured law, and as an equation."""

from collections.abc import Sequence

import numpy as np

from slipstick.clutch.effects import CATALOGUE, Effect, find
from slipstick.clutch.effects.effect import SENSORS, Signals
from slipstick.law_files import insert_values
from slipstick.naming.measured import LawPoints
from slipstick.studies.finding import FindingResult

_FIELDS = {"motor speed": "motor_speed", "input speed": "input_speed", "output speed": "output_speed",
           "slip": "plate_slip", "pressure": "pressure", "time": "time", "run order": "run"}
"""Dependence -> field of the signals of a formula that holds it."""
_RUN = 100.0
"""Runs in a unit of `Signals.run`."""


def formula(name: str, values: Sequence[float], law: LawPoints) -> np.ndarray | None:
    """Changes (m,) by an effect with coefficients `values` at the points of a measured law, in the unit of the law.

    A law that is known up to a constant or a line is compared with the formula after the same part is fitted. A
    relative one known up to a constant is a share of the mean quantity, so that a factor is fitted. None where the
    formula is not one over the points: that of a sensor, of a memory, or found under another pair.
    """
    effect = find(name)
    on, blank = law.pair[1], Signals(*[0.0] * len(Signals._fields))
    if (law.x is None or effect.memory is not None or effect.quantity in SENSORS or law.pair != effect.pairs[0]
            or on not in (*_FIELDS, "direction")):
        return None
    x = law.x / _RUN if on == "run order" else law.x
    # What depends on the direction of the piston is measured over its rate, which is the quantity itself.
    before = x if on == "direction" else np.full(len(x), 1.0 if law.relative else 0.0)
    signals = [blank._replace(**{_FIELDS[on]: float(at)}) if on in _FIELDS else blank for at in x]
    change = np.array([effect.formula(float(base), signal, tuple(values)) - base
                       for base, signal in zip(before, signals, strict=True)])
    weight = 1 / np.maximum(law.std, 1e-3 * law.std.max())
    if law.relative and law.up_to == "constant":
        total = weight * (1 + change)
        return np.asarray((1 + change) * (total @ (weight * (1 + law.change)) / (total @ total)) - 1)
    columns = {"nothing": [], "constant": [np.ones_like(x)], "line": [np.ones_like(x), x]}[law.up_to]
    if columns:
        design = np.stack(columns, axis=1)
        change = change + design @ np.linalg.lstsq(weight[:, None] * design, weight * (law.change - change))[0]
    return np.asarray(change)


def effect_of(name: str | None) -> Effect | None:
    """The effect of the catalogue; None for another name, which a stored result of a changed catalogue may have."""
    return next((effect for effect in CATALOGUE if effect.name == name), None)


def equation(finding: FindingResult) -> str | None:
    """The equation of the named effect with its fitted coefficients in numbers and their units.

    Such as `friction coefficient = alpha (1 + 0.15 exp(-|plate slip| / (25.9 rad/s)))`, with the symbols of the
    catalogue. None without a name, or where the simulation was not fitted with the formula of the effect.
    """
    effect = effect_of(finding.effect)
    coefficients = {each.name: (each.value, each.unit) for each in finding.confirmation.coefficients}
    if effect is None or set(coefficients) != {each.name for each in effect.coefficients}:
        return None
    return f"{describe_quantity(effect)} = {insert_values(effect.law, coefficients)}"


def describe_quantity(effect: Effect) -> str:
    """What an effect changes: its quantity, or the reading of its sensor."""
    return f"reading of the {effect.quantity}" if effect.quantity.endswith("sensor") else effect.quantity
