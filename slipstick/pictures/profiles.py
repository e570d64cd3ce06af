"""The profile likelihood of every unknown: how much is lost if it is held elsewhere and all others follow."""

import math
from collections.abc import Mapping
from typing import Any

from scipy.stats import chi2

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("Each curve holds one unknown at a value and lets all others follow. Values above the dashed line are in "
           "the interval; where the curve does not come down to it, the interval is open on that side: the recordings "
           "do not limit the unknown there.")

_COLUMNS = 3
_WIDTH, _HEIGHT = 204, 130
_DEPTH = 1.25  # decades shown below the best


def draw(result: Mapping[str, Any], evidence: Mapping[str, Any]) -> Spec | None:
    """One small panel an unknown; None where no profile was computed."""
    shown = [interval for interval in result["intervals"] if interval["curve"]]
    if not shown:
        return None
    is_open = [theme.plain(interval["unknown"]) for interval in shown if None in (interval["lower"], interval["upper"])]
    level = 100 * shown[0]["level"]
    title = f"{len(is_open)} of {len(shown)} unknowns stay open on one side or both" if is_open else \
        f"The recordings limit all {len(shown)} unknowns"
    subtitle = (f"Shaded: the {level:.0f} % intervals. Dashed: where they end, "
                f"{threshold(shown[0]['level']):.2f} decades below the best.")
    return theme.picture(title, subtitle, {
        "columns": _COLUMNS, "spacing": {"row": 26, "column": 46},
        "concat": [_panel(interval, place) for place, interval in enumerate(shown)]})


def threshold(level: float) -> float:
    """Decades below the best at which the interval of one unknown ends (Wilks): half the chi-square quantile."""
    return float(chi2.ppf(level, 1) / 2 / math.log(10))


def _panel(interval: Mapping[str, Any], place: int) -> Spec:
    unknown, curve = interval["unknown"], interval["curve"]
    unit = "s" if unknown.startswith("output") else "1" if unknown.startswith("correlation") else "multiple of nominal"
    rows = [{"value": theme.number(value), "height": theme.number(None if drop is None else -drop)}
            for value, drop in curve]
    low = curve[0][0] if interval["lower"] is None else interval["lower"]
    high = curve[-1][0] if interval["upper"] is None else interval["upper"]
    x = {"field": "value", "type": "quantitative", "title": f"{theme.plain(unknown)} [{unit}]",
         "scale": {"zero": False, "nice": False, "padding": 6},
         "axis": {"tickCount": 4, "grid": False, "titleFontSize": 11, "format": ".3~r"}}
    y = {"field": "height", "type": "quantitative", "scale": {"domain": [-_DEPTH, 0.1], "nice": False},
         "title": "decades from the best" if place % _COLUMNS == 0 else None, "axis": {"tickCount": 4}}
    band = {"low": theme.number(low), "high": theme.number(high)}
    return {"width": _WIDTH, "height": _HEIGHT, "layer": [
        {"data": {"values": [band]}, "mark": {"type": "rect", "color": theme.PHASES["slip"]},
         "encoding": {"x": {**x, "field": "low"}, "x2": {"field": "high"}}},
        {"data": {"values": [{}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT},
         "encoding": {"y": {"datum": -threshold(interval["level"])}}},
        {"data": {"values": rows}, "mark": {"type": "line", "color": theme.AFTER, "strokeWidth": 1.8, "clip": True,
                                            "interpolate": "monotone", "point": {"color": theme.AFTER, "size": 18}},
         "encoding": {"x": x, "y": y}},
        {"data": {"values": [{"value": theme.number(interval["estimate"]), "height": 0}]},
         "mark": {"type": "point", "filled": True, "size": 55, "color": theme.INK, "opacity": 1},
         "encoding": {"x": x, "y": y}},
        *(_open(side, at) for side, at in (("lower", 0), ("upper", _WIDTH)) if interval[side] is None)]}


def _open(side: str, at: int) -> Spec:
    text, align, dx = ("← open", "left", 4) if side == "lower" else ("open →", "right", -4)
    return {"data": {"values": [{}]}, "mark": {"type": "text", "text": text, "align": align, "dx": dx, "color":
                                               theme.FAINT, "fontStyle": "italic"},
            "encoding": {"x": {"value": at}, "y": {"value": _HEIGHT - 9}}}
