"""How likely the model calls each measured shifting time that its fit has not seen, before and after."""

import math
from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import models
from slipstick.pictures.theme import Spec

CAPTION = ("Left: log10 of the predicted density per ms at each measured shifting time, the prediction made without "
           "its motor speed or its profile; above the line, the effect makes the measurement more likely. Both models "
           "come with the scatter and the noise that suit them. Right: how far the measured times lie from their "
           "predicted means, in predicted standard deviations; the curve is what a right model would give.")

_SIZE = 280
_EDGE = 4.0  # standard deviations
_BINS = 20
_DEEPEST = -8.0  # decades: what is less likely is drawn there
_MARGIN = 0.1  # decades


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Densities against each other, and standardised errors; None where there is one model only."""
    prediction, who = figure_data["prediction"], models(result, figure_data)
    if "after" not in who:
        return None
    scores = {key: [(time - mean) / std for time, mean, std in zip(
        prediction["measured"], prediction[key]["mean"], prediction[key]["std"], strict=True)] for key in who}
    decades = {key: [density(score, std) for score, std in zip(scores[key], prediction[key]["std"], strict=True)]
               for key in who}
    total = {key: sum(values) for key, values in decades.items()}
    spread = {key: 1e3 * sum(prediction[key]["std"]) / len(scores[key]) for key in who}
    gained = total["after"] - total["before"]
    subtitle = (f"log10 likelihood {total['before']:.1f} before, {total['after']:.1f} after, all experiments together. "
                f"Predicted standard deviation {spread['before']:.3g} ms before, {spread['after']:.3g} ms after.")
    return theme.picture(
        f"The held-out shifting times become {abs(gained):.0f} decades {'more' if gained > 0 else 'less'} likely",
        subtitle.replace("-", "−"),
        {"spacing": 60, "hconcat": [_against(decades, who), _standardised(scores, who)]})


def density(score: float, std: float) -> float:
    """log10 of the normal density per ms, `score` standard deviations of `std` s from the mean."""
    return -(score**2 / 2) / math.log(10) - math.log10(1e3 * std * math.sqrt(2 * math.pi))


def _against(decades: Mapping[str, list[float]], who: Mapping[str, tuple[str, str]]) -> Spec:
    shown = {key: [max(_DEEPEST, value) for value in values] for key, values in decades.items()}
    rows = [{key: theme.number(values[place], 4) for key, values in shown.items()}
            for place in range(len(shown["after"]))]
    low, high = min(map(min, shown.values())) - _MARGIN, max(map(max, shown.values())) + _MARGIN
    scale: Spec = {"domain": [theme.number(low), theme.number(high)], "nice": False}
    x, y = ({"field": key, "type": "quantitative", "title": f"log10 density, {name}", "scale": scale}
            for key, (name, _) in who.items())
    ends = [{"before": end, "after": end} for end in scale["domain"]]
    return {"width": _SIZE, "height": _SIZE, "layer": [
        {"data": {"values": ends}, "mark": {"type": "line", "color": theme.FAINT, "strokeWidth": 1},
         "encoding": {"x": x, "y": y}},
        {"data": {"values": rows}, "mark": {"type": "point", "filled": True, "size": 18, "color": theme.AFTER,
                                            "opacity": 0.7}, "encoding": {"x": x, "y": y}}]}


def _standardised(scores: Mapping[str, list[float]], who: Mapping[str, tuple[str, str]]) -> Spec:
    width, n = 2 * _EDGE / _BINS, len(scores["after"])
    bars = []
    for key, (name, _) in who.items():
        counts = [0] * _BINS
        for score in scores[key]:
            counts[min(_BINS - 1, max(0, int((score + _EDGE) / width)))] += 1
        bars += [{"who": name, "share": theme.number(count / n / width, 4), "from": theme.number(place * width - _EDGE),
                  "to": theme.number((place + 1) * width - _EDGE)} for place, count in enumerate(counts) if count]
    curve = [{"from": at / 10, "share": theme.number(math.exp(-(at / 10) ** 2 / 2) / math.sqrt(2 * math.pi), 4)}
             for at in range(-40, 41)]
    x: Spec = {"field": "from", "type": "quantitative", "axis": {"grid": False},
               "title": "measured − predicted [predicted standard deviations]"}
    y: Spec = {"field": "share", "type": "quantitative", "title": "density of the experiments"}
    return {"width": _SIZE, "height": _SIZE, "layer": [
        {"data": {"values": bars}, "mark": {"type": "rect", "opacity": 0.55},
         "encoding": {"x": x, "x2": {"field": "to"}, "y": y, "y2": {"datum": 0},
                      "color": {**theme.whose(dict(who.values())), "field": "who"}}},
        {"data": {"values": curve}, "mark": {"type": "line", "color": theme.INK, "strokeWidth": 1.6},
         "encoding": {"x": x, "y": y}}]}
