"""Every pair of unknowns: the way of the search, the traces of both profile likelihoods, and the estimate.

The trace of a profile is where all other unknowns are best while one has each of its values (Bates and Watts 1988,
section 6.1.2). Traces that coincide are a ridge: the recordings determine a combination of both unknowns only.
"""

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.multiples import Unknown, ticks, unknown
from slipstick.pictures.output import Output
from slipstick.pictures.profiles import DEPTH
from slipstick.pictures.theme import Spec

CAPTION = ("Each panel is the plane of two unknowns. Orange: the best candidate after each generation of the search, "
           "the larger the later; where it leaves the panel, an earlier generation is outside. Dark dot: the "
           "estimate. Blue: the unknown on the horizontal axis is moved, and all others are optimised; grey: the same "
           "for the vertical axis. Dots on these traces are the computed points. Traces at right angles: the "
           "recordings tell both unknowns apart. Traces that coincide: they determine a combination of both only.")

MOST = 5
"""Unknowns drawn; of more, those with the largest weights in the combination that is hardest to identify."""
_SIZE = {2: 230, 3: 195, 4: 140, 5: 105}  # px of a panel, by the number of unknowns
_GAP = 40  # px between panels
_CHARACTER = 6  # px of a character in a title
_MARGIN = 0.08
_REACH = 1.5
"""Multiple of the range of the traces up to which the way of the search widens a panel."""
_SEARCH, _ACROSS, _UP = "search", "horizontal unknown moved", "vertical unknown moved"


@dataclass(frozen=True)
class _Unknown:
    """One of the drawn unknowns: its place among all, how it is shown, and the drawn range."""

    place: int
    shown: Unknown
    domain: tuple[float, float]


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return the lower triangle of panels; None for a fit that was stored without its search."""
    search = output["figure_data"].get("search")
    if not search or not search["path"]:
        return None
    result, chosen = output["result"], _choose(output["result"], search["unknowns"])
    traces = [_near(trace, interval["curve"]) for trace, interval in
              zip(search["traces"], result["intervals"], strict=False)]
    drawn = [_Unknown(place, shown := unknown(search["unknowns"][place], output["physical"],
                                                   Output.of(output["figure_data"])),
                      _domain(place, shown.factor, search, traces)) for place in chosen]
    size = _SIZE[len(drawn)]
    rows = [{"spacing": _GAP, "bounds": "flush", "hconcat": [
        _panel(x, y, search, traces, size, column == 0, row == len(drawn) - 2)
        for column, x in enumerate(drawn[:row + 1])]} for row, y in enumerate(drawn[1:])]
    left_out = len(search["unknowns"]) - len(drawn)
    return theme.picture(
        f"{len(search['path'])} steps of the search, and how the unknowns compensate for each other at the estimate",
        "Traces of the profile likelihoods, and the best candidates of the search."
        + ("" if traces else " Intervals were not requested, so that there are no traces.")
        + (f" The {len(drawn)} unknowns that are hardest to separate; {left_out} others are left out." if left_out
           else ""), {"spacing": 14, "vconcat": rows})


def _choose(result: Mapping[str, Any], names: Sequence[str]) -> list[int]:
    if len(names) <= MOST or not result["combinations"]:
        return list(range(min(len(names), MOST)))
    weights = result["combinations"][-1]["weights"]
    return sorted(sorted(range(len(names)), key=lambda place: -abs(weights.get(names[place], 0.0)))[:MOST])


def _near(trace: Sequence[Sequence[float]], curve: Sequence[tuple[float, float]]) -> list[list[float]]:
    """The points of a trace that lie at most `DEPTH` decades below the optimum, and the next ones beside them."""
    inside = [place for place, (_, drop) in enumerate(curve) if drop is not None and drop <= DEPTH]
    return [list(point) for point in trace[max(inside[0] - 1, 0):inside[-1] + 2]] if inside else []


def _domain(place: int, factor: float, search: Mapping[str, Any],
            traces: Sequence[Sequence[Sequence[float]]]) -> tuple[float, float]:
    """The range of the traces, widened by the search as far as `_REACH` allows."""
    near = [search["estimate"][place], *(point[place] for trace in traces for point in trace)]
    low, high = min(near), max(near)
    path = [vector[place] for vector in search["path"]]
    reach = _REACH * (high - low) if traces else math.inf
    low, high = min(low, max(min(path), low - reach)), max(high, min(max(path), high + reach))
    margin = _MARGIN * (high - low) or 0.05 * abs(high) or 1.0
    return factor * (low - margin), factor * (high + margin)


def _panel(x: _Unknown, y: _Unknown, search: Mapping[str, Any], traces: Sequence[Sequence[Sequence[float]]], size: int,
           first: bool, last: bool) -> Spec:
    def row(vector: Sequence[float]) -> Spec:
        return {channel: theme.rounded(coordinate.shown.factor * vector[coordinate.place])
                for channel, coordinate in (("x", x), ("y", y))}

    labels = {"grid": False, "labelOverlap": False, "titleFontSize": 11}
    encoding = {channel: {
        "field": channel, "type": "quantitative",
        "scale": {"domain": [theme.rounded(end) for end in coordinate.domain], "nice": False, "zero": False},
        "title": _title(coordinate.shown, size) if labelled else None,
        "axis": coordinate.shown.axis(values=ticks(coordinate.domain, size), labels=labelled, ticks=labelled, **labels)}
        for channel, coordinate, labelled in (("x", x, last), ("y", y, first))}
    colour = theme.series_colour({_SEARCH: theme.BEFORE, _ACROSS: theme.AFTER, _UP: theme.FAINT})
    path = [{**row(vector), "step": step, "size": 6 + 34 * step / len(search["path"])}
            for step, vector in enumerate(search["path"], 1)]
    # A step of the search that changes nothing is drawn once.
    moved = [path[0], *(after for before, after in pairwise(path)
                        if (before["x"], before["y"]) != (after["x"], after["y"]))]
    order = {"field": "order", "type": "quantitative"}
    layers: list[Spec] = [
        {"data": {"values": moved}, "mark": {"type": "line", "strokeWidth": 1, "opacity": 0.7, "clip": True},
         "encoding": {"color": {**colour, "datum": _SEARCH}, "order": {"field": "step", "type": "quantitative"}}},
        {"data": {"values": moved}, "mark": {"type": "point", "filled": True, "opacity": 0.85, "clip": True},
         "encoding": {"color": {**colour, "datum": _SEARCH},
                      "size": {"field": "size", "type": "quantitative", "scale": None},
                      "tooltip": [{"field": "step", "type": "quantitative"}]}}]
    for label, coordinate in ((_UP, y), (_ACROSS, x)):
        if coordinate.place < len(traces) and traces[coordinate.place]:
            values = [{**row(point), "order": number} for number, point in enumerate(traces[coordinate.place])]
            layers.append({
                "data": {"values": values},
                "mark": {"type": "line", "strokeWidth": 1.6, "clip": True, "point": {"size": 16, "opacity": 1}},
                "encoding": {"color": {**colour, "datum": label}, "order": order}})
    layers.append({"data": {"values": [row(search["estimate"])]}, "mark": {"type": "point", "filled": True, "size": 60,
                                                                           "opacity": 1, "color": theme.INK}})
    return {"width": size, "height": size, "view": {"stroke": theme.GRID}, "encoding": encoding, "layer": layers}


def _title(shown: Unknown, size: int) -> list[str]:
    """The title of an axis in lines that fit a panel of this size with the gap beside it."""
    return [*textwrap.wrap(theme.in_words(shown.name), (size + _GAP) // _CHARACTER),
            *([f"[{shown.unit}]"] if shown.unit else [])]
