"""The profile likelihood of every unknown: the maximum over all other unknowns at each of its values."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import scipy

from slipstick.pictures import theme
from slipstick.pictures.multiples import Unknown, ticks, unknown
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec

CAPTION = ("Each curve is the profile likelihood of one unknown: at each of its values, all other unknowns are "
           "optimised. The interval contains the values at which the curve lies above the dashed line. Open: the "
           "curve stays above the line up to the bound of the search, so the recordings do not limit the unknown on "
           "that side. Not found: the computation stopped before it reached the end of the interval.")

_COLUMNS = 3
_WIDTH, _HEIGHT = 204, 130
DEPTH = 1.25
"""Decades shown below the optimum."""
_MARGIN = 0.03  # as a share of the panel width
_CHARACTERS = 36  # per line of an axis title, to fit the panel width


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return one panel per unknown; None if no profile was computed."""
    intervals = [interval for interval in output["result"]["intervals"] if interval["curve"]]
    if not intervals:
        return None
    closed = sum(None not in (interval["lower"], interval["upper"]) for interval in intervals)
    level = intervals[0]["level"]
    share = f"all {closed}" if closed == len(intervals) else f"{closed} of {len(intervals)}"
    subtitle = (f"Shaded: {100 * level:.0f} % intervals. Dashed: their threshold, {threshold(level):.2f} decades "
                "below the optimum. Dots: computed points; between them the line is interpolated.")
    return theme.picture(f"The recordings limit {share} unknowns on both sides", subtitle, {
        "columns": _COLUMNS, "spacing": {"row": 26, "column": 46},
        "concat": [_panel(interval, unknown(interval["unknown"], output["physical"],
                                               Output.of(output["figure_data"])), index)
                   for index, interval in enumerate(intervals)]})


def threshold(level: float) -> float:
    """Return the drop of the profile at the ends of an interval, in decades: half the chi-square quantile (Wilks)."""
    return float(scipy.special.chdtri(1, 1 - level) / 2 / math.log(10))


def _panel(interval: Mapping[str, Any], shown: Unknown, index: int) -> Spec:
    scale = shown.factor
    title = textwrap.wrap(theme.in_words(interval["unknown"]), _CHARACTERS)
    curve = [(scale * value, drop) for value, drop in interval["curve"]]
    rows = [{"value": theme.rounded(value), "height": theme.rounded(None if drop is None else -drop)}
            for value, drop in curve]
    ends = [None if interval[side] is None else theme.rounded(scale * interval[side]) for side in ("lower", "upper")]
    reach = _domain(curve)
    domain = [theme.rounded(end) for end in reach]
    band = {side: edge if end is None else end for side, end, edge in zip(("low", "high"), ends, domain, strict=True)}
    x = {"field": "value", "type": "quantitative", "title": [*title, f"[{shown.unit}]"] if shown.unit else title,
         "scale": {"domain": domain, "nice": False},
         "axis": shown.axis(values=ticks(reach, _WIDTH), grid=False, labelOverlap=False, titleFontSize=11)}
    y = {"field": "height", "type": "quantitative", "scale": {"domain": [-DEPTH, 0.1], "nice": False},
         "title": "decades from optimum" if index % _COLUMNS == 0 else None, "axis": {"tickCount": 4}}
    return {"width": _WIDTH, "height": _HEIGHT, "layer": [
        {"data": {"values": [band]}, "mark": {"type": "rect", "color": theme.PHASES["slip"]},
         "encoding": {"x": {**x, "field": "low"}, "x2": {"field": "high"}}},
        {"data": {"values": [{"value": end} for end in ends if end is not None]},
         "mark": {"type": "rule", "color": theme.AFTER, "strokeWidth": 0.8}, "encoding": {"x": x}},
        {"data": {"values": [{}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT},
         "encoding": {"y": {"datum": -threshold(interval["level"])}}},
        {"data": {"values": rows}, "mark": {"type": "line", "color": theme.AFTER, "strokeWidth": 1, "clip": True,
                                            "interpolate": "monotone"},
         "encoding": {"x": x, "y": y}},
        {"data": {"values": rows}, "mark": {"type": "point", "filled": True, "color": theme.AFTER, "size": 32,
                                            "opacity": 1, "clip": True}, "encoding": {"x": x, "y": y}},
        {"data": {"values": [{"value": theme.rounded(scale * interval["estimate"]), "height": 0}]},
         "mark": {"type": "point", "filled": True, "size": 55, "color": theme.INK, "opacity": 1},
         "encoding": {"x": x, "y": y}},
        *(_missing_end(side, side in interval["unsettled"]) for side in ("lower", "upper") if interval[side] is None)]}


def _domain(curve: Sequence[tuple[float, float | None]]) -> tuple[float, float]:
    """Return the range of values in which the drop is at most `DEPTH`, extrapolated as a parabola, with a margin."""
    drops = [math.inf if drop is None else drop for _, drop in curve]
    inside = [index for index, drop in enumerate(drops) if drop <= DEPTH]
    ends = []
    for last, step in ((inside[0], -1), (inside[-1], 1)):
        beyond, value = last + step, curve[last][0]
        if 0 <= beyond < len(curve) and math.isfinite(drops[beyond]):
            low, high = (math.sqrt(max(drops[index], 0.0)) for index in (last, beyond))
            value += (curve[beyond][0] - value) * (math.sqrt(DEPTH) - low) / (high - low)
        ends.append(value)
    margin = _MARGIN * (ends[1] - ends[0])
    return ends[0] - margin, ends[1] + margin


def _missing_end(side: str, unsettled: bool) -> Spec:
    word = "not found" if unsettled else "open"
    text, align, x, dx = (f"← {word}", "left", 0, 4) if side == "lower" else (f"{word} →", "right", _WIDTH, -4)
    return {"data": {"values": [{}]}, "mark": {"type": "text", "text": text, "align": align, "dx": dx, "color":
                                               theme.FAINT, "fontStyle": "italic"},
            "encoding": {"x": {"value": x}, "y": {"value": _HEIGHT - 9}}}
