"""Measured torque over pressure against the plates' slip, with the law of the model through it."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import models
from slipstick.pictures.theme import Spec

CAPTION = ("Each dot is an average over 16 ms of one engagement while its plates slip: the torque on the clutch's side "
           "of the gear, less that of the oil film, over the force of the measured pressure on the plates. Line and "
           "shade: median, and from a tenth below to a tenth above, at equal slip. The model's lines are the same "
           "ratio in its own simulation. The plates slow down from right to left.")

_SCALE = 1e4  # N m/Pa -> 1e-4 N m/Pa
_SUBTITLE = "The friction coefficient that the bench shows, and the one that the model has."
_SLIGHT = 2.0  # per cent: as good as no change with slip
_FEWEST = 3  # bins that make a curve
_HEIGHT = 330
_MARGIN, _LEAST = 0.25, 0.02  # of what the shade covers, and of the friction: shown above and below


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """The cloud, its median, and the models; None without signals, or with too few."""
    shown = figure_data["law"]
    if shown is None or len(shown["bins"]["at"]) < _FEWEST:
        return None
    bins, cloud, who = shown["bins"], shown["cloud"], models(result, figure_data)
    colours = {"measured": theme.MEASURED, **dict(who.values())}
    low, high = _SCALE * min(bins["low"]), _SCALE * max(bins["high"])
    margin = max(_MARGIN * (high - low), _LEAST * high)
    y: Spec = {"field": "friction", "type": "quantitative", "title": "torque over pressure [10⁻⁴ N m/Pa]",
               "scale": {"domain": [theme.number(low - margin), theme.number(high + margin)], "nice": False}}
    x: Spec = {"field": "slip", "type": "quantitative", "title": "slip of the plates [rad/s]", "axis": {"grid": False},
               "scale": {"nice": False, "domain": [0, theme.number(max(bins["at"]) * 1.03)]}}
    colour = theme.whose(colours)
    dots = {"data": {"values": _rows(cloud["slip"], friction=cloud["friction"])},
            "mark": {"type": "point", "filled": True, "size": 7, "opacity": 0.35, "color": theme.FAINT, "clip": True},
            "encoding": {"x": x, "y": y}}
    band = {"data": {"values": _rows(bins["at"], friction=bins["low"], high=bins["high"])},
            "mark": {"type": "area", "color": theme.MEASURED, "opacity": 0.16, "clip": True},
            "encoding": {"x": x, "y": y, "y2": {"field": "high"}}}
    lines = [(name, shown["model"][key], 2.4) for key, (name, _) in who.items()]
    drawn = [{"data": {"values": _rows(line["at"], friction=line["median"])},
              "mark": {"type": "line", "strokeWidth": width, "clip": True},
              "encoding": {"x": x, "y": y, "color": {**colour, "datum": name, "legend": {"symbolType": "stroke"}}}}
             for name, line, width in [("measured", bins, 5.0), *lines]]
    return theme.picture(_title(result, shown), _SUBTITLE, {
        "width": theme.WIDTH, "height": _HEIGHT, "layer": [dots, band, *drawn]})


def _title(result: Mapping[str, Any], shown: Mapping[str, Any]) -> str:
    median = shown["bins"]["median"]
    rise = 100 * (median[0] / median[-1] - 1)
    if abs(rise) < _SLIGHT:
        return "Torque over pressure hardly depends on slip on the bench"
    verb = "grows" if rise > 0 else "falls"
    return f"As the plates slow down, torque over pressure {verb} by {abs(rise):.0f} % on the bench"


def _rows(slip: list[float], **columns: list[float]) -> list[Spec]:
    return [{"slip": theme.number(at, 4), **{name: theme.number(_SCALE * value, 5)
                                            for name, value in zip(columns, values, strict=True)}}
            for at, *values in zip(slip, *columns.values(), strict=True)]
