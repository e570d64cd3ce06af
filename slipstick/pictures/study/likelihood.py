"""Likelihood of each held-out shifting time under the model before and after."""

import math
from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import model_series
from slipstick.pictures.theme import Spec

CAPTION = ("Left: log10 of the predicted density per ms at each measured shifting time. Each prediction comes from "
           "fits without the experiments of that motor speed or of that current profile. For points above the line, "
           "the effect makes the measurement more likely. Each model has its own fitted scatter and noise. Right: "
           "measured minus predicted times in predicted standard deviations; the curve is the standard normal density, "
           "expected of a correct model.")

_SIZE = 280
_EDGE = 4.0  # standard deviations: larger errors count in the outermost bins
_BINS = 20
_DEEPEST = -8.0  # decades: lower values are drawn at this value
_MARGIN = 0.1  # decades


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return the densities of both models, and standardised errors; None if no effect was added."""
    prediction, models = figure_data["prediction"], model_series(result, figure_data)
    if "after" not in models:
        return None
    scores = {key: [(time - mean) / std for time, mean, std in zip(
        prediction["measured"], prediction[key]["mean"], prediction[key]["std"], strict=True)] for key in models}
    decades = {key: [density(score, std) for score, std in zip(scores[key], prediction[key]["std"], strict=True)]
               for key in models}
    total = {key: sum(values) for key, values in decades.items()}
    spread = {key: 1e3 * sum(prediction[key]["std"]) / len(scores[key]) for key in models}
    improvement = total["after"] - total["before"]
    subtitle = (f"log10 likelihood of all experiments: {total['before']:.1f} before, {total['after']:.1f} after. Mean "
                f"predicted standard deviation: {spread['before']:.3g} ms before, {spread['after']:.3g} ms after.")
    return theme.picture(
        f"The held-out shifting times become {abs(improvement):.0f} decades "
        f"{'more' if improvement > 0 else 'less'} likely",
        subtitle.replace("-", "−"),
        {"spacing": 60, "hconcat": [_densities(decades, models), _standardised(scores, models)]})


def density(score: float, std: float) -> float:
    """Return the log10 normal density per ms at `score` standard deviations from the mean, with `std` in s."""
    return -(score**2 / 2) / math.log(10) - math.log10(1e3 * std * math.sqrt(2 * math.pi))


def _densities(decades: Mapping[str, list[float]], models: Mapping[str, tuple[str, str]]) -> Spec:
    clipped = {key: [max(_DEEPEST, value) for value in values] for key, values in decades.items()}
    rows = [{key: theme.rounded(values[index], 4) for key, values in clipped.items()}
            for index in range(len(clipped["after"]))]
    low, high = min(map(min, clipped.values())) - _MARGIN, max(map(max, clipped.values())) + _MARGIN
    scale: Spec = {"domain": [theme.rounded(low), theme.rounded(high)], "nice": False}
    x, y = ({"field": key, "type": "quantitative", "title": f"log10 density, {label}", "scale": scale}
            for key, (label, _) in models.items())
    ends = [{"before": end, "after": end} for end in scale["domain"]]
    return {"width": _SIZE, "height": _SIZE, "layer": [
        {"data": {"values": ends}, "mark": {"type": "line", "color": theme.FAINT, "strokeWidth": 1},
         "encoding": {"x": x, "y": y}},
        {"data": {"values": rows}, "mark": {"type": "point", "filled": True, "size": 18, "color": theme.AFTER,
                                            "opacity": 0.7}, "encoding": {"x": x, "y": y}}]}


def _standardised(scores: Mapping[str, list[float]], models: Mapping[str, tuple[str, str]]) -> Spec:
    width, n = 2 * _EDGE / _BINS, len(scores["after"])
    bars = []
    for key, (label, _) in models.items():
        counts = [0] * _BINS
        for score in scores[key]:
            counts[min(_BINS - 1, max(0, int((score + _EDGE) / width)))] += 1
        bars += [{"series": label, "share": theme.rounded(count / n / width, 4),
                  "from": theme.rounded(index * width - _EDGE), "to": theme.rounded((index + 1) * width - _EDGE)}
                 for index, count in enumerate(counts) if count]
    curve = [{"from": score, "share": theme.rounded(math.exp(-score**2 / 2) / math.sqrt(2 * math.pi), 4)}
             for score in (tenth / 10 for tenth in range(-40, 41))]
    x: Spec = {"field": "from", "type": "quantitative", "axis": {"grid": False},
               "title": "measured − predicted [predicted standard deviations]"}
    y: Spec = {"field": "share", "type": "quantitative", "title": "density of experiments"}
    return {"width": _SIZE, "height": _SIZE, "layer": [
        {"data": {"values": bars}, "mark": {"type": "rect", "opacity": 0.55},
         "encoding": {"x": x, "x2": {"field": "to"}, "y": y, "y2": {"datum": 0},
                      "color": {**theme.series_colour(dict(models.values())), "field": "series"}}},
        {"data": {"values": curve}, "mark": {"type": "line", "color": theme.INK, "strokeWidth": 1.6},
         "encoding": {"x": x, "y": y}}]}
