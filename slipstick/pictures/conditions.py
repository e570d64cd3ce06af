"""Conditions of an engagement in words, wherever pictures and reports number it."""

from collections.abc import Mapping, Sequence

from slipstick.pictures import units

Columns = Mapping[str, Sequence[float] | None]
"""Columns of conditions: `current_profile`, `motor_speed` in rad/s, `load_inertia` in kg m², `brake_torque` in N m.

Columns of another machine have their units in the name, as in "voltage [V]".
"""


def described(conditions: Columns, place: int) -> str:
    """The conditions of the engagement at this place of the columns; those that were not recorded are left out."""
    forms = {"current_profile": "profile {:.0f}", "motor_speed": "motor {:.0f} rad/s", "load_inertia": "{:.3g} kg m²",
             "brake_torque": "brake {:.3g} N m"}
    words = [form.format(column[place]) for name, form in forms.items() if (column := conditions.get(name)) is not None]
    for heading, column in conditions.items():
        name, bracket, unit = heading.removesuffix("]").partition(" [")
        if bracket and column is not None:
            words.append(units.with_unit(f"{name.replace('_', ' ')} {column[place]:.5g}", units.raised(unit)))
    return ", ".join(words)
