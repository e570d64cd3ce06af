"""The signals of a machine in its own experiments."""

from slipstick.machine import Machine, Runs
from slipstick.pictures import theme, units
from slipstick.pictures.theme import Spec

_HEIGHT, _POINTS, _MOST = 130, 400, 12
"""Height of a panel in px, points of a curve, and experiments that are drawn."""


def draw_machine(machine: Machine, runs: Runs) -> Spec:
    """Return a panel for each command and signal with a curve for each experiment."""
    every, rows = max(1, len(runs.time) // _POINTS), range(min(len(runs), _MOST))
    curves = {**{name: profile.at(runs.time) for name, profile in runs.commands.items()}, **runs.signals}
    panels: list[Spec] = []
    for name, values in curves.items():
        unit, is_last = runs.units.get(name, ""), name == list(curves)[-1]
        points = [{"t": theme.rounded(float(t)), "y": theme.rounded(float(value)), "experiment": row}
                  for row in rows for t, value in zip(runs.time[::every], values[row, ::every], strict=True)]
        title = name if unit in ("", "1") else f"{name} [{units.raised(unit)}]"
        panels.append({"width": theme.WIDTH, "height": _HEIGHT, "data": {"values": points},
                       "mark": {"type": "line", "strokeWidth": 1.4}, "encoding": {
                           "x": {"field": "t", "type": "quantitative", "title": "time [s]" if is_last else None,
                                 "scale": {"nice": False}, "axis": {"grid": False}},
                           "y": {"field": "y", "type": "quantitative", "title": title, "scale": {"zero": False}},
                           "color": {"field": "experiment", "type": "ordinal", "legend": {"title": "experiment"}}}})
    more = f" The first {_MOST} are drawn." if len(runs) > _MOST else ""
    return theme.picture(f"{machine.name}: {len(runs)} experiments", "Commands and simulated signals, without noise."
                         + more, {"spacing": 16, "vconcat": panels})
