"""Measured against simulated shifting times, experiment by experiment (Fig. 5 of the paper), before and after a fit."""

import math
from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("Shifting times of all experiments: the nominal model before the fit, and the mean of the fitted model "
           "after it. What is left over after the fit is what the fitted scatter and noise have to explain.")

_COLOURS = {"before": theme.BEFORE, "after": theme.AFTER}
_HALF = (theme.WIDTH - 112) // 2
_BINS = 24


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec:
    """Simulated over measured time, how the differences spread, and the difference of each experiment."""
    shown = figure_data["prediction"]
    rows = [_row(*values) for values in zip(shown["condition"], shown["measured"], shown["before"], shown["mean"],
                                            strict=True)]
    spread = {who: _rms([row[f"difference {who}"] for row in rows]) for who in _COLOURS}
    lost = sum(row["before"] is None or row["after"] is None for row in rows)
    title = f"The differences shrink from {_said(spread['before'])} to {_said(spread['after'])} (root mean square)" \
        if (spread["after"] or math.inf) < (spread["before"] or math.inf) else \
        f"The differences are {_said(spread['before'])} before and {_said(spread['after'])} after (root mean square)"
    return theme.picture(
        title, f"{len(rows)} experiments. A positive difference: the model locks later than the bench."
        + (f" {lost} without a simulated shifting time are not drawn." if lost else ""),
        {"spacing": 22, "datasets": {"experiments": rows}, "vconcat": [
            {"spacing": 60, "hconcat": [_scatter(rows), _histogram(rows)]}, _by_experiment()]})


def _row(condition: int, measured: float, before: float | None, after: float | None) -> Spec:
    row: Spec = {"experiment": condition, "measured": theme.number(measured)}
    for who, simulated in (("before", before), ("after", after)):
        row[who] = theme.number(simulated)
        row[f"difference {who}"] = theme.number(None if row[who] is None else 1e3 * (row[who] - measured), 4)
    return row


def _rms(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return math.sqrt(sum(value**2 for value in known) / len(known)) if known else None


def _said(spread: float | None) -> str:
    return "no known value" if spread is None else f"{spread:.3g} ms"


def _points(x: Spec, y: str, title: str) -> list[Spec]:
    return [{"data": {"name": "experiments"}, "mark": {"type": "point", "size": 16, "filled": True, "opacity": 0.75},
             "encoding": {"x": x, "y": {"field": y.format(who), "type": "quantitative", "title": title,
                                        "scale": {"zero": False}},
                          "color": {**theme.whose(_COLOURS), "datum": who},
                          "tooltip": [{"field": name, "type": "quantitative"} for name in
                                      ("experiment", "measured", who, f"difference {who}")]}} for who in _COLOURS]


def _scatter(rows: list[Spec]) -> Spec:
    known = [row[who] for row in rows for who in ("measured", *_COLOURS) if row[who] is not None]
    ends = [{"t": min(known)}, {"t": max(known)}]
    axis: Spec = {"field": "t", "type": "quantitative", "scale": {"zero": False}, "axis": {"tickCount": 6}}
    line = {"data": {"values": ends}, "mark": {"type": "line", "color": theme.FAINT, "strokeWidth": 1},
            "encoding": {"x": axis, "y": axis}}
    x = {"field": "measured", "type": "quantitative", "title": "measured shifting time [s]", "scale": {"zero": False}}
    return {"width": _HALF, "height": 260, "layer": [line, *_points(x, "{}", "simulated shifting time [s]")]}


def _histogram(rows: list[Spec]) -> Spec:
    differences = {who: [row[f"difference {who}"] for row in rows if row[who] is not None] for who in _COLOURS}
    known = [value for values in differences.values() for value in values]
    low, high = min(known, default=0.0), max(known, default=1.0)
    width = (high - low) / _BINS or 1.0
    bars = []
    for who, values in differences.items():
        counts = [0] * _BINS
        for value in values:
            counts[min(int((value - low) / width), _BINS - 1)] += 1
        bars += [{"who": who, "from": theme.number(low + place * width), "to": theme.number(low + (place + 1) * width),
                  "count": count} for place, count in enumerate(counts) if count]
    return {"width": _HALF, "height": 260, "data": {"values": bars},
            "mark": {"type": "rect", "opacity": 0.6},
            "encoding": {"x": {"field": "from", "type": "quantitative", "title": "simulated − measured [ms]",
                               "axis": {"grid": False}},
                         "x2": {"field": "to"}, "y": {"field": "count", "type": "quantitative", "title": "experiments"},
                         "y2": {"datum": 0}, "color": {**theme.whose(_COLOURS), "field": "who"}}}


def _by_experiment() -> Spec:
    x = {"field": "experiment", "type": "quantitative", "title": "experiment", "axis": {"grid": False, "format": "d"},
         "scale": {"nice": False, "padding": 8}}
    zero = {"mark": {"type": "rule", "color": theme.FAINT}, "data": {"values": [{}]}, "encoding": {"y": {"datum": 0}}}
    return {"width": theme.WIDTH, "height": 200,
            "layer": [zero, *_points(x, "difference {}", "simulated − measured [ms]")]}
