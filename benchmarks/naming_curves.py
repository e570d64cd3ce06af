"""The share of right and of wrong names over the strength of a single listed effect, as a picture."""

from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.rates import bounds
from slipstick.pictures import theme
from slipstick.pictures.rendering import render

BOUNDS = (0.0, 0.3, 1.0, 2.0, 5.0, 15.0, np.inf)
"""Between these strengths, in naming limits, cases are counted together."""
_SHARES = {"found": "found, alone or in a tie", "alone": "named alone", "wrong_alone": "a wrong name, alone"}
_COLOURS = [theme.AFTER, theme.MEASURED, theme.BEFORE]


def shares(strengths: list[float], verdicts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each range of strengths with a case: the shares of the verdicts of `naming.judged`, with bounds."""
    found = []
    for low, high in pairwise(BOUNDS):
        its = [verdict for strength, verdict in zip(strengths, verdicts, strict=True) if low <= strength < high]
        label = f"from {low:g}" if high == np.inf else f"{low:g} to {high:g}"
        for key, words in _SHARES.items():
            hits = sum(verdict[key] > 0 for verdict in its)
            if its:
                lower, upper = bounds(hits, len(its))
                found.append({"strength": f"{label} ({len(its)})", "share": hits / len(its), "lower": lower,
                              "upper": upper, "answer": words})
    return found


def drawn(strengths: list[float], verdicts: list[dict[str, Any]], title: str) -> bytes:
    """The shares as SVG."""
    values = shares(strengths, verdicts)
    order = list(dict.fromkeys(one["strength"] for one in values))
    x = {"field": "strength", "type": "nominal", "sort": order, "axis": {"labelAngle": 0},
         "title": "strength in naming limits (cases)"}
    offset = {"field": "answer", "type": "nominal", "sort": list(_SHARES.values())}
    colour = {"field": "answer", "type": "nominal", "sort": list(_SHARES.values()), "title": None,
              "scale": {"range": _COLOURS}, "legend": {"orient": "top"}}

    def y(field: str) -> theme.Spec:
        return {"field": field, "type": "quantitative", "title": "share of cases", "scale": {"domain": [0, 1]}}

    return render(theme.picture(title, "bars: 95 % bounds of the rate", {
        "width": theme.WIDTH, "height": 220, "data": {"values": values}, "layer": [
            {"mark": {"type": "rule", "strokeWidth": 2},
             "encoding": {"x": x, "xOffset": offset, "y": y("lower"), "y2": {"field": "upper"}, "color": colour}},
            {"mark": {"type": "point", "filled": True, "size": 70, "opacity": 1},
             "encoding": {"x": x, "xOffset": offset, "y": y("share"), "color": colour}}]}), "svg")
