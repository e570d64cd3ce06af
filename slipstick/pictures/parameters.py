"""Parameters of a calibration with their intervals, relative to their nominal values."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("Dots and dark lines: estimates with their intervals, which assume that the model is right. Light lines: "
           "one standard deviation of the scatter from run to run on either side of the estimate.")
_ROW = 26  # px


def draw(entries: Mapping[str, Mapping[str, Any]], nominal: Mapping[str, float], level: float) -> Spec:
    """Return a row for each parameter of a calibration, in multiples of its `nominal` value.

    An entry has `value`, `interval`, of probability `level`, and `scatter` in the unit of the parameter.
    """
    rows = []
    for name, entry in entries.items():
        value, scatter = (entry[key] / nominal[name] for key in ("value", "scatter"))
        low, high = sorted(end / nominal[name] for end in entry["interval"])
        rows.append({"parameter": theme.in_words(name), "value": theme.rounded(value), "low": theme.rounded(low),
                     "high": theme.rounded(high), "from": theme.rounded(value - abs(scatter)),
                     "to": theme.rounded(value + abs(scatter))})
    y: Spec = {"field": "parameter", "type": "nominal", "sort": None, "title": None,
               "axis": {"labelLimit": 220, "grid": True}}
    x: Spec = {"type": "quantitative", "title": "multiple of the nominal value", "scale": {"zero": False}}
    title = f"{len(rows)} parameters fitted to the recordings"
    return theme.picture(title, f"Dark lines: {100 * level:.0f} % intervals.", {
        "width": theme.WIDTH - 180, "height": _ROW * len(rows), "data": {"values": rows}, "layer": [
            {"mark": {"type": "rule", "strokeWidth": 9, "color": theme.PHASES["slip"]},
             "encoding": {"y": y, "x": {**x, "field": "from"}, "x2": {"field": "to"}}},
            {"data": {"values": [{}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT},
             "encoding": {"x": {"datum": 1}}},
            {"mark": {"type": "rule", "strokeWidth": 3, "color": theme.MEASURED},
             "encoding": {"y": y, "x": {**x, "field": "low"}, "x2": {"field": "high"}}},
            {"mark": {"type": "point", "filled": True, "size": 60, "opacity": 1, "color": theme.MEASURED},
             "encoding": {"y": y, "x": {**x, "field": "value"}}}]})
