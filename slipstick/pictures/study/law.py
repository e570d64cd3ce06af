"""Measured torque over pressure as a function of the plate slip, and the friction law of the models."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import model_series
from slipstick.pictures.theme import Spec

CAPTION = ("Each dot is an average over 16 ms of one engagement while its plates slip: the measured torque on the "
           "clutch"
           "side of the gear, minus the torque of the oil film, divided by the contact pressure that follows from the "
           "measured oil pressure. The measured line and shade are the median and the range from the 10 % to the 90 % "
           "quantile at equal slip. The lines of the models show the same ratio in their simulations. During an "
           "engagement the slip decreases, from right to left.")

_SCALE = 1e4  # N m/Pa -> 1e-4 N m/Pa
_SUBTITLE = "The friction coefficient derived from the signals of the test bench, and that of the models."
_NEGLIGIBLE = 2.0  # percent: smaller changes with slip are not reported
_FEWEST = 3  # bins of a curve
_HEIGHT = 330
_MARGIN, _LEAST_MARGIN = 0.25, 0.02  # above and below the shade, as shares of its height and of the friction


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return measurements, their median and the models; None without signals, or with too few bins."""
    law = figure_data["law"]
    if law is None or len(law["bins"]["at"]) < _FEWEST:
        return None
    bins, cloud, models = law["bins"], law["cloud"], model_series(result, figure_data)
    colours = {"measured": theme.MEASURED, **dict(models.values())}
    low, high = _SCALE * min(bins["low"]), _SCALE * max(bins["high"])
    margin = max(_MARGIN * (high - low), _LEAST_MARGIN * high)
    y: Spec = {"field": "friction", "type": "quantitative", "title": "torque over pressure [10⁻⁴ N m/Pa]",
               "scale": {"domain": [theme.rounded(low - margin), theme.rounded(high + margin)], "nice": False}}
    x: Spec = {"field": "slip", "type": "quantitative", "title": "slip of the plates [rad/s]", "axis": {"grid": False},
               "scale": {"nice": False, "domain": [0, theme.rounded(max(bins["at"]) * 1.03)]}}
    colour = theme.series_colour(colours)
    dots = {"data": {"values": _rows(cloud["slip"], friction=cloud["friction"])},
            "mark": {"type": "point", "filled": True, "size": 7, "opacity": 0.35, "color": theme.FAINT, "clip": True},
            "encoding": {"x": x, "y": y}}
    band = {"data": {"values": _rows(bins["at"], friction=bins["low"], high=bins["high"])},
            "mark": {"type": "area", "color": theme.MEASURED, "opacity": 0.16, "clip": True},
            "encoding": {"x": x, "y": y, "y2": {"field": "high"}}}
    lines = [(label, law["model"][key], 2.4) for key, (label, _) in models.items()]
    curves = [{"data": {"values": _rows(line["at"], friction=line["median"])},
              "mark": {"type": "line", "strokeWidth": width, "clip": True},
              "encoding": {"x": x, "y": y, "color": {**colour, "datum": label, "legend": {"symbolType": "stroke"}}}}
             for label, line, width in [("measured", bins, 5.0), *lines]]
    return theme.picture(_title(law), _SUBTITLE, {
        "width": theme.WIDTH, "height": _HEIGHT, "layer": [dots, band, *curves]})


def _title(law: Mapping[str, Any]) -> str:
    median = law["bins"]["median"]
    rise = 100 * (median[0] / median[-1] - 1)
    if abs(rise) < _NEGLIGIBLE:
        return "On the test bench, torque over pressure hardly depends on slip"
    verb = "grows" if rise > 0 else "falls"
    return f"On the test bench, torque over pressure {verb} by {abs(rise):.0f} % as the slip decreases"


def _rows(slip: list[float], **columns: list[float]) -> list[Spec]:
    return [{"slip": theme.rounded(at, 4), **{name: theme.rounded(_SCALE * value, 5)
                                            for name, value in zip(columns, values, strict=True)}}
            for at, *values in zip(slip, *columns.values(), strict=True)]
