"""The page of a table: its axes, and a map over two of them for a chosen condition."""

from collections.abc import Sequence
from html import escape

import numpy as np

from slipstick.errors import UnknownName
from slipstick.pictures import units
from slipstick.pictures.conditions import described
from slipstick.pictures.panels import draw_curves, draw_map
from slipstick.pictures.theme import in_words
from slipstick.report.markup import definitions, paragraph, section, table
from slipstick.report.words import listed
from slipstick.table import Axis, Table
from slipstick.table.subject import columns

from ..drawings import Drawings
from ..front.details import conditions_table, page
from ..front.elements import options
from ..front.panels import Panel, draw_panels

_PLACES, _POINTS = 25, 101
"""Places of a map along each axis, and points of a curve."""


def table_page(name: str, shown_table: Table, about: str, condition: int, axes: tuple[str | None, str | None],
               drawings: Drawings) -> str:
    """Return the content of the page of a table with a map at the `condition` of this number; raises `UnknownName`.

    The map is over the `axes` of these names, by default the first two.
    """
    rows = [(in_words(axis.name), f"{axis.nominal:g}", units.raised(axis.unit),
             f"{axis.values[0]:g} to {axis.values[-1]:g}", str(len(axis.values))) for axis in shown_table.axes]
    return page("Table", name, about, f"/v1/tables/{name}", [
        _map_section(name, shown_table, condition, axes, drawings),
        section("Axes", table(("parameter", "nominal value", "unit", "range [multiples]", "points"), rows, {2})),
        section("Conditions", conditions_table(shown_table.conditions)),
        section("Origin", definitions([("computed by", shown_table.origin), ("digest", shown_table.digest),
                                       ("digest of the model", shown_table.model.digest)]))])


def _map_section(name: str, shown_table: Table, condition: int, axes: tuple[str | None, str | None],
                 drawings: Drawings) -> str:
    if condition >= len(shown_table.conditions):
        raise UnknownName(f"The table '{name}' has no condition {condition}",
                          f"Give a number from 0 to {len(shown_table.conditions) - 1}")
    places = _places(shown_table.axes, axes)
    names = [shown_table.axes[place].name for place in places]
    output = in_words(shown_table.output.name)
    panels = _draw(shown_table, condition, places)
    over = " and ".join(in_words(axis) for axis in names)
    others = ", ".join(in_words(axis.name) for axis in shown_table.axes if axis.name not in names)
    return (f'<section id="map" aria-labelledby="map-title">\n<h2 id="map-title">{escape(output.capitalize())} over '
            f"{escape(over)}</h2>\n{_form(shown_table, condition, names)}\n"
            + paragraph(f"Condition {condition}: {described(columns(shown_table.conditions), condition)}"
                        + (f"; {others} at the nominal value" if others else ""))
            + draw_panels(drawings, panels, "map", shown_table.digest, str(condition), *names) + "\n</section>")


def _places(axes: Sequence[Axis], names: tuple[str | None, str | None]) -> list[int]:
    """Return the places of the named axes: two different ones, or the only one of the table."""
    known = [axis.name for axis in axes]
    for name in names:
        if name is not None and name not in known:
            raise UnknownName.of("axis", name, known)
    if len(axes) == 1:
        return [0]
    chosen = [None if name is None else known.index(name) for name in names]
    first = chosen[0] if chosen[0] is not None else next(place for place in (0, 1) if place != chosen[1])
    second = chosen[1] if chosen[1] not in (None, first) else next(place for place in (0, 1) if place != first)
    return [first, second]


def _form(shown_table: Table, condition: int, names: Sequence[str]) -> str:
    """Return the form that chooses condition and axes."""
    fields = [f'<label>Condition <input type="number" name="condition" min="0" max="{len(shown_table.conditions) - 1}" '
              f'value="{condition}" required></label>']
    choices = (("Across", "x"), ("Up", "y"))[:len(shown_table.axes) - 1]  # of two axes, one follows from the other
    for (label, field), chosen in zip(choices, names, strict=False):
        axes = options(((axis.name, in_words(axis.name)) for axis in shown_table.axes), chosen)
        fields.append(f'<label>{label} <select name="{field}">{axes}</select></label>')
    return f'<form class="flip" action="#map" method="get">{" ".join(fields)}\n<button>Show</button></form>'


def _draw(shown_table: Table, condition: int, places: Sequence[int]) -> list[Panel]:
    axes = [shown_table.axes[place] for place in places]
    count = _PLACES if len(axes) == 2 else _POINTS
    grids = [np.linspace(axis.lower, axis.upper, count) for axis in axes]
    points = np.ones((count ** len(axes), len(shown_table.axes)))
    for place, mesh in zip(places, np.meshgrid(*grids), strict=True):
        points[:, place] = mesh.ravel()
    single = shown_table.restricted(shown_table.conditions.take(np.array([condition])))
    values = single.interpolate(points)[:, 0]
    sides = []
    for axis, grid in zip(axes, grids, strict=True):
        unit, factor = units.scale(axis.unit, axis.nominal * np.abs(grid).max())
        sides.append((axis.name, unit, factor * axis.nominal * grid, factor * axis.nominal))
    output, known = shown_table.output.name, values[np.isfinite(values)]
    shown, scale = units.scale(shown_table.output.unit, float(np.abs(known).max(initial=0.0)))
    values, known = scale * values, scale * known
    if len(sides) == 1:
        axis_name, unit, grid, nominal = sides[0]
        return [Panel(draw_curves(output, shown, (axis_name, unit), {output: (grid, values)}),
                      f"The {in_words(output)} over the {in_words(axis_name)}.",
                      f"Nominal value: {units.with_unit(units.number(nominal), unit)}.")]
    across, up = sides
    spec = draw_map(output, shown, across[:3], up[:3], values.reshape(count, count), (across[3], up[3]))
    span = f"from {known.min():.4g} to {units.with_unit(f'{known.max():.4g}', shown)}" if len(known) else "undefined"
    missing = "; where it is blank, the output is undefined" * (len(known) < len(values))
    drawn = Panel(spec, f"A map of the {in_words(output)}, {span}, in bands of colour over {in_words(across[0])} "
                        f"and {in_words(up[0])}. A cross marks the nominal point{missing}.",
                  f"Cross: the nominal point{missing}.")
    curves = {units.with_unit(units.number(up[2][row]), up[1]): (across[2], values.reshape(count, count)[row])
              for row in (0, count // 2, count - 1)}
    at = f"{in_words(up[0])} of {listed(list(curves))}"
    return [drawn, Panel(draw_curves(output, shown, across[:2], curves),
                         f"The {in_words(output)} over the {in_words(across[0])}, at {at}.",
                         f"At three values of the {in_words(up[0])}.")]
