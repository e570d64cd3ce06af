"""The one look of all pictures: colours that the colour-blind and a grey print tell apart, fonts, sizes, numbers."""

import math
import textwrap
from typing import Any

Spec = dict[str, Any]
"""A Vega-Lite v5 specification, or a part of one."""

SCHEMA = "https://vega.github.io/schema/vega-lite/v5.json"
WIDTH = 720
"""Width in px of the plot of a whole picture, without its axis."""

INK, FAINT, GRID = "#1f2a33", "#66727d", "#e6e9ec"
MEASURED, BEFORE, AFTER, ALARM = "#3d4852", "#e0843a", "#1f5fa8", "#a3195b"
"""What was measured, the model before and after a fit, and what deserves a look."""
PHASES = {"fill": "#f6f0e4", "slip": "#dfe9f4", "stick": "#f0f2f4"}
SHADES = ("#0b3c78", "#2463a6", "#5a8fc4", "#92b8dc", "#c3d8ec", "#e3edf6", "#f5f8fb")
"""From the best to the worst."""

_COLUMNS = 112  # characters of a subtitle that fit in the width of a picture
_CONFIG: Spec = {
    "font": "Helvetica, Arial, sans-serif",
    "view": {"stroke": None},
    "axis": {"domainColor": "#98a2ab", "tickColor": "#98a2ab", "tickSize": 4, "gridColor": GRID, "labelColor": MEASURED,
             "titleColor": MEASURED, "titleFontWeight": "normal", "titleFontSize": 12, "titlePadding": 8,
             "labelFontSize": 11, "labelPadding": 4, "labelFlush": False},
    "title": {"anchor": "start", "frame": "group", "color": INK, "fontSize": 15, "fontWeight": 600, "offset": 16,
              "subtitleColor": FAINT, "subtitleFontSize": 12, "subtitleLineHeight": 16, "subtitlePadding": 5},
    "axisY": {"minExtent": 38},
    "legend": {"orient": "top", "title": None, "labelColor": MEASURED, "labelFontSize": 12, "labelLimit": 300,
               "offset": 8, "symbolStrokeWidth": 2, "symbolType": "circle"},
    "concat": {"spacing": 12},
}


def picture(title: str, subtitle: str, body: Spec) -> Spec:
    """Return `body`, a view with its data, as a whole picture under a title that says what is seen."""
    return {"$schema": SCHEMA, "background": "white", "padding": 12, "config": _CONFIG,
            "title": {"text": title, "subtitle": textwrap.wrap(subtitle, _COLUMNS)}, **body}


def whose(colours: dict[str, str]) -> Spec:
    """A colour scale that names whose values are drawn, in the order of its legend."""
    return {"type": "nominal", "title": None, "scale": {"domain": list(colours), "range": list(colours.values())}}


def number(value: float | None, digits: int = 5) -> float | None:
    """Round to significant digits, so that a picture stays small; None where there is no finite number."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.{digits}g}")


def milliseconds(seconds: float) -> str:
    """A time in words."""
    return f"{1e3 * seconds:.0f} ms"


def plain(name: str) -> str:
    """The name of an input or an unknown as words."""
    return name.replace("_", " ")
