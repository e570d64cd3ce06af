"""Simulated against measured shifting times of all experiments, before and after a fit (Fig. 5 of the paper)."""

import math
from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme, units
from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec

CAPTION = ("All experiments. Before: the nominal model. After: the mean of the fitted model. The "
           "fitted scatter and output noise account for the differences that remain after the fit.")

_COLOURS = {"before": theme.BEFORE, "after": theme.AFTER}
_HALF = (theme.WIDTH - 112) // 2
_BINS = 24


def draw(output: Mapping[str, Any]) -> Spec:
    """Return simulated over measured times, a histogram of the differences, and the difference of each experiment."""
    prediction, conditions = output["figure_data"]["prediction"], output["figure_data"]["conditions"]
    columns = (prediction[name] for name in ("condition", "measured", "before", "mean"))
    shown = Output.of(output["figure_data"])
    rows = [_row(shown, conditions, *values) for values in zip(*columns, strict=True)]
    rms = {stage: _rms([row[f"difference {stage}"] for row in rows]) for stage in _COLOURS}
    undefined = sum(row["before"] is None or row["after"] is None for row in rows)
    before, after = (_with_unit(rms[stage], shown.small) for stage in ("before", "after"))
    title = f"The root-mean-square difference falls from {before} to {after}" \
        if (rms["after"] or math.inf) < (rms["before"] or math.inf) else \
        f"The root-mean-square difference is {before} before and {after} after the fit"
    return theme.picture(
        title, f"{len(rows)} experiments. Positive differences: {shown.later}."
        + (f" Not drawn: {undefined} without a predicted {shown.words}." if undefined else ""),
        {"spacing": 22, "datasets": {"experiments": rows}, "vconcat": [
            {"spacing": 60, "hconcat": [_scatter(rows, shown), _histogram(rows, shown)]},
            _by_experiment(shown)]})


def _row(shown: Output, conditions: Columns, condition: int, measured: float, before: float | None,
         after: float | None) -> Spec:
    row: Spec = {"experiment": condition, "conditions": described(conditions, condition),
                 "measured": theme.rounded(measured)}
    for stage, simulated in (("before", before), ("after", after)):
        row[stage] = theme.rounded(simulated)
        row[f"difference {stage}"] = theme.rounded(
            None if row[stage] is None else shown.factor * (measured - row[stage]), 4)
    return row


def _rms(values: list[float | None]) -> float | None:
    finite = [value for value in values if value is not None]
    return math.sqrt(sum(value**2 for value in finite) / len(finite)) if finite else None


def _with_unit(value: float | None, unit: str) -> str:
    return "an undefined value" if value is None else units.with_unit(f"{value:.3g}", unit)


def _points(x: Spec, y: str, title: str) -> list[Spec]:
    return [{"data": {"name": "experiments"}, "mark": {"type": "point", "size": 16, "filled": True, "opacity": 0.75},
             "encoding": {"x": x, "y": {"field": y.format(stage), "type": "quantitative", "title": title,
                                        "scale": {"zero": False}},
                          "color": {**theme.series_colour(_COLOURS), "datum": stage},
                          "tooltip": [{"field": "conditions", "type": "nominal"},
                                      *({"field": name, "type": "quantitative"} for name in
                                        ("experiment", "measured", stage, f"difference {stage}"))]}}
            for stage in _COLOURS]


def _scatter(rows: list[Spec], shown: Output) -> Spec:
    times = [row[name] for row in rows for name in ("measured", *_COLOURS) if row[name] is not None]
    ends = [{"t": min(times)}, {"t": max(times)}]
    axis: Spec = {"field": "t", "type": "quantitative", "scale": {"zero": False}, "axis": {"tickCount": 6}}
    line = {"data": {"values": ends}, "mark": {"type": "line", "color": theme.FAINT, "strokeWidth": 1},
            "encoding": {"x": axis, "y": axis}}
    unit = units.raised(shown.unit)
    x = {"field": "measured", "type": "quantitative", "title": f"measured {shown.words} [{unit}]",
         "scale": {"zero": False}}
    return {"width": _HALF, "height": 260, "layer": [line, *_points(x, "{}", f"predicted {shown.words} [{unit}]")]}


def _histogram(rows: list[Spec], shown: Output) -> Spec:
    differences = {stage: [row[f"difference {stage}"] for row in rows if row[stage] is not None] for stage in _COLOURS}
    pooled = [value for values in differences.values() for value in values]
    low, high = min(pooled, default=0.0), max(pooled, default=1.0)
    width = (high - low) / _BINS or 1.0
    bars = []
    for stage, values in differences.items():
        counts = [0] * _BINS
        for value in values:
            counts[min(int((value - low) / width), _BINS - 1)] += 1
        bars += [{"series": stage, "from": theme.rounded(low + index * width),
                  "to": theme.rounded(low + (index + 1) * width), "count": count}
                 for index, count in enumerate(counts) if count]
    return {"width": _HALF, "height": 260, "data": {"values": bars},
            "mark": {"type": "rect", "opacity": 0.6},
            "encoding": {"x": {"field": "from", "type": "quantitative", "axis": {"grid": False},
                               "title": f"measured − predicted [{shown.small}]"},
                         "x2": {"field": "to"}, "y": {"field": "count", "type": "quantitative", "title": "experiments"},
                         "y2": {"datum": 0}, "color": {**theme.series_colour(_COLOURS), "field": "series"}}}


def _by_experiment(shown: Output) -> Spec:
    x = {"field": "experiment", "type": "quantitative", "title": "experiment", "axis": {"grid": False, "format": "d"},
         "scale": {"nice": False, "padding": 8}}
    zero = {"mark": {"type": "rule", "color": theme.FAINT}, "data": {"values": [{}]}, "encoding": {"y": {"datum": 0}}}
    return {"width": theme.WIDTH, "height": 200,
            "layer": [zero, *_points(x, "difference {}", f"measured − predicted [{shown.small}]")]}
