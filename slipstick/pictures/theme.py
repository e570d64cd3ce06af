"""The theme of all pictures: fonts, sizes, and colours that stay distinct in greyscale and for the colour-blind."""

import math
import textwrap
from collections.abc import Mapping
from typing import Any

Spec = dict[str, Any]
"""A Vega-Lite v5 specification, or part of one."""

SCHEMA = "https://vega.github.io/schema/vega-lite/v5.json"
WIDTH = 720
"""Width in px of the plot area of a full-width picture."""

INK, FAINT, GRID = "#1f2a33", "#66727d", "#e6e9ec"
MEASURED, BEFORE, AFTER, ALARM = "#3d4852", "#e0843a", "#1f5fa8", "#a3195b"
"""Colours of measurements, of the model before and after a fit, and of values to be checked."""
PHASES = {"fill": "#f6f0e4", "slip": "#dfe9f4", "stick": "#f0f2f4"}
SHADES = ("#0b3c78", "#2463a6", "#5a8fc4", "#92b8dc", "#c3d8ec", "#e3edf6", "#f5f8fb")
"""Colours of likelihood bands, from the best to the worst."""

AXIS, EDGE = "#98a2ab", "#c3cad0"
"""Colours of axes, and of lines between groups."""
DARK = {
    "white": "#14191e", INK: "#eef2f5", FAINT: "#9aa7b2", GRID: "#2b343c", MEASURED: "#c6d0d8", BEFORE: "#f0a060",
    AFTER: "#6fb0f0", ALARM: "#f07ab0", AXIS: "#6b7883", EDGE: "#3d4852", "#f6f0e4": "#2b2820", "#dfe9f4": "#1d2c3d",
    "#f0f2f4": "#20272d",
    # From the best to the worst as in the light: the best stands out from the background.
    "#0b3c78": "#d6e8fb", "#2463a6": "#a5cbf2", "#5a8fc4": "#72a6da", "#92b8dc": "#477eb5", "#c3d8ec": "#2c5a8a",
    "#e3edf6": "#1f3f61", "#f5f8fb": "#182938"}
"""Colour on white -> colour on a dark background."""

_COLUMNS = 112  # characters per line of a subtitle, to fit the width of a picture
_CONFIG: Spec = {
    "font": "Helvetica, Arial, sans-serif",
    "view": {"stroke": None},
    "axis": {"domainColor": AXIS, "tickColor": AXIS, "tickSize": 4, "gridColor": GRID, "labelColor": MEASURED,
             "titleColor": MEASURED, "titleFontWeight": "normal", "titleFontSize": 12, "titlePadding": 8,
             "labelFontSize": 11, "labelPadding": 4, "labelFlush": False},
    "title": {"anchor": "start", "frame": "group", "color": INK, "fontSize": 15, "fontWeight": 600, "offset": 16,
              "subtitleColor": FAINT, "subtitleFontSize": 12, "subtitleLineHeight": 16, "subtitlePadding": 5},
    "axisY": {"minExtent": 38},
    "legend": {"orient": "top", "title": None, "labelColor": MEASURED, "labelFontSize": 12, "labelLimit": 300,
               "offset": 8, "symbolStrokeWidth": 2, "symbolType": "circle"},
    "concat": {"spacing": 12},
}


def picture(title: str, subtitle: str, body: Spec, caption: str = "") -> Spec:
    """Return the full specification of `body`, a view with its data. The title states the finding.

    The `caption` explains what is drawn, and is the description of the specification.
    """
    return {"$schema": SCHEMA, **({"description": caption} if caption else {}), "background": "white", "padding": 12,
            "config": _CONFIG, "title": {"text": title, "subtitle": textwrap.wrap(subtitle, _COLUMNS)}, **body}


def captions(specs: Mapping[str, Spec]) -> dict[str, str]:
    """Return name -> caption of specifications that have one."""
    return {name: spec["description"] for name, spec in specs.items()}


def series_colour(colours: dict[str, str]) -> Spec:
    """Return the colour encoding of named series -> colour, in the order of the legend."""
    return {"type": "nominal", "title": None, "scale": {"domain": list(colours), "range": list(colours.values())}}


def band(low: float, high: float, y: Spec, opacity: float = 0.13) -> Spec:
    """Return a shade between two values in the encoding `y`."""
    return {"data": {"values": [{"low": low, "high": high}]},
            "mark": {"type": "rect", "color": MEASURED, "opacity": opacity},
            "encoding": {"y": {**y, "field": "low"}, "y2": {"field": "high"}}}


def rounded(value: float | None, digits: int = 5) -> float | None:
    """Round to significant digits to limit the size of a picture; None if the value is None or not finite."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.{digits}g}")


def milliseconds(seconds: float) -> str:
    """Return a time with its unit, in whole ms."""
    return f"{1e3 * seconds:.0f} ms"


def in_words(name: str) -> str:
    """Return the name of an input or unknown with spaces instead of underscores.

    The std of an input is its scatter between runs, and no uncertainty; that of the output is its noise.
    """
    return name.replace("_", " ").replace("std of ", "scatter of ").replace("output std", "output noise")
