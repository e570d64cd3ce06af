"""The profile likelihood of every unknown: how much is lost if it is held elsewhere and all others follow."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from scipy.stats import chi2

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("Each curve holds one unknown at a value and lets all others follow. Values above the dashed line are in "
           "the interval; where the curve does not come down to it, the interval is open on that side: the recordings "
           "do not limit the unknown there. Not found: the computation stopped before it met an end.")

_COLUMNS = 3
_WIDTH, _HEIGHT = 204, 130
_DEPTH = 1.25  # decades shown below the best
_MARGIN = 0.03  # of a panel
_CHARACTERS = 36  # that fit below a panel


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """One small panel an unknown; None where no profile was computed."""
    shown = [interval for interval in result["intervals"] if interval["curve"]]
    if not shown:
        return None
    is_open = sum(None in (interval["lower"], interval["upper"]) for interval in shown)
    level = 100 * shown[0]["level"]
    title = f"{is_open} of {len(shown)} unknowns stay open on one side or both" if is_open else \
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
    unit, scale = _unit(interval["unknown"])
    title = textwrap.wrap(theme.plain(interval["unknown"]), _CHARACTERS)
    curve = [(scale * value, drop) for value, drop in interval["curve"]]
    rows = [{"value": theme.number(value), "height": theme.number(None if drop is None else -drop)}
            for value, drop in curve]
    ends = [None if interval[side] is None else theme.number(scale * interval[side]) for side in ("lower", "upper")]
    domain = _shown(curve)
    band = {side: at if end is None else end for side, end, at in zip(("low", "high"), ends, domain, strict=True)}
    x = {"field": "value", "type": "quantitative", "title": [*title, f"[{unit}]"] if unit else title,
         "scale": {"domain": domain, "nice": False},
         "axis": {"tickCount": 4, "grid": False, "titleFontSize": 11, "format": ".3~r"}}
    y = {"field": "height", "type": "quantitative", "scale": {"domain": [-_DEPTH, 0.1], "nice": False},
         "title": "decades from the best" if place % _COLUMNS == 0 else None, "axis": {"tickCount": 4}}
    return {"width": _WIDTH, "height": _HEIGHT, "layer": [
        {"data": {"values": [band]}, "mark": {"type": "rect", "color": theme.PHASES["slip"]},
         "encoding": {"x": {**x, "field": "low"}, "x2": {"field": "high"}}},
        {"data": {"values": [{"value": end} for end in ends if end is not None]},
         "mark": {"type": "rule", "color": theme.AFTER, "strokeWidth": 0.8}, "encoding": {"x": x}},
        {"data": {"values": [{}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT},
         "encoding": {"y": {"datum": -threshold(interval["level"])}}},
        {"data": {"values": rows}, "mark": {"type": "line", "color": theme.AFTER, "strokeWidth": 1.8, "clip": True,
                                            "interpolate": "monotone", "point": {"color": theme.AFTER, "size": 18}},
         "encoding": {"x": x, "y": y}},
        {"data": {"values": [{"value": theme.number(scale * interval["estimate"]), "height": 0}]},
         "mark": {"type": "point", "filled": True, "size": 55, "color": theme.INK, "opacity": 1},
         "encoding": {"x": x, "y": y}},
        *(_without_end(side, side in interval["unsettled"]) for side in ("lower", "upper") if interval[side] is None)]}


def _unit(unknown: str) -> tuple[str, float]:
    """The unit that an unknown is drawn in, empty for none, and what its value is multiplied by."""
    if unknown.startswith("output"):
        return "ms", 1e3
    return ("" if unknown.startswith(("correlation", "partial correlation")) else "multiple of nominal"), 1.0


def _shown(curve: Sequence[tuple[float, float | None]]) -> list[float | None]:
    """The values to show: where the curve is in the picture, which it leaves as a parabola would, and a margin."""
    drops = [math.inf if drop is None else drop for _, drop in curve]
    inside = [place for place, drop in enumerate(drops) if drop <= _DEPTH]
    ends = []
    for last, step in ((inside[0], -1), (inside[-1], 1)):
        beyond, value = last + step, curve[last][0]
        if 0 <= beyond < len(curve) and math.isfinite(drops[beyond]):
            low, high = (math.sqrt(max(drops[place], 0.0)) for place in (last, beyond))
            value += (curve[beyond][0] - value) * (math.sqrt(_DEPTH) - low) / (high - low)
        ends.append(value)
    margin = _MARGIN * (ends[1] - ends[0])
    return [theme.number(ends[0] - margin), theme.number(ends[1] + margin)]


def _without_end(side: str, unsettled: bool) -> Spec:
    word = "not found" if unsettled else "open"
    text, align, at, dx = (f"← {word}", "left", 0, 4) if side == "lower" else (f"{word} →", "right", _WIDTH, -4)
    return {"data": {"values": [{}]}, "mark": {"type": "text", "text": text, "align": align, "dx": dx, "color":
                                               theme.FAINT, "fontStyle": "italic"},
            "encoding": {"x": {"value": at}, "y": {"value": _HEIGHT - 9}}}
