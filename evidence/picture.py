"""The picture of the rates: the share of right and of wrong answers over the strength of a single known effect."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from evidence.rates import Entry, bounds
from slipstick.pictures import theme
from slipstick.pictures.rendering import render

STRENGTHS = (0.0, 1.0, 2.0, 3.5, 6.0, np.inf)
"""Between these strengths, in residuals over the noise, cases are counted together."""
_SHARES = {"in the answer": lambda verdict: verdict.effects_named > 0,
           "named first": lambda verdict: verdict.right_first, "a wrong name": lambda verdict: verdict.too_many > 0}
_COLOURS = [theme.AFTER, theme.MEASURED, theme.BEFORE]


def draw_rates(entries: Sequence[Entry]) -> bytes:
    """Return the picture as SVG."""
    single = [entry for entry in entries if entry.suite == "one_known_effect"]
    values, order = [], []
    for low, high in pairwise(STRENGTHS):
        verdicts = [entry.verdict("reported") for entry in single if low <= entry.strength < high]
        if not verdicts:
            continue
        order.append(f"{f'from {low:g}' if high == np.inf else f'{low:g} to {high:g}'} ({len(verdicts)})")
        for words, holds in _SHARES.items():
            hits = sum(map(holds, verdicts))
            lower, upper = bounds(hits, len(verdicts))
            values.append({"strength": order[-1], "share": hits / len(verdicts), "lower": lower, "upper": upper,
                           "answer": words})
    x = {"field": "strength", "type": "nominal", "sort": order, "axis": {"labelAngle": 0},
         "title": "residual of the best fit without the effect, over the noise (cases)"}
    offset = {"field": "answer", "type": "nominal", "sort": [*_SHARES]}
    colour = {"field": "answer", "type": "nominal", "sort": [*_SHARES], "title": None,
              "scale": {"range": _COLOURS}, "legend": {"orient": "top"}}

    def y(field: str) -> theme.Spec:
        return {"field": field, "type": "quantitative", "title": "share of cases", "scale": {"domain": [0, 1]}}

    title = f"Answers where one known effect is hidden, over its strength ({len(single)} cases)"
    return render(theme.picture(title, "bars: 95 % bounds of the rate", {
        "width": theme.WIDTH, "height": 220, "data": {"values": values}, "layer": [
            {"mark": {"type": "rule", "strokeWidth": 2},
             "encoding": {"x": x, "xOffset": offset, "y": y("lower"), "y2": {"field": "upper"}, "color": colour}},
            {"mark": {"type": "point", "filled": True, "size": 70, "opacity": 1},
             "encoding": {"x": x, "xOffset": offset, "y": y("share"), "color": colour}}]}), "svg")
