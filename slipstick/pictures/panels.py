"""Small pictures that stand beside each other on a wide page and below each other on a narrow one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from slipstick.pictures import theme, units
from slipstick.pictures.theme import Spec

WIDTH = 364
"""Width in px of a panel with its axes: that of the text on a screen of 390 px."""
_HEIGHT, _MAP_HEIGHT = 190, 330
_INTERVALS = 200  # in time, of each of which the least and the largest sample of a curve are drawn
_COLOURS = (theme.AFTER, theme.BEFORE, theme.MEASURED, theme.ALARM, theme.SHADES[2], theme.FAINT)
_DASHES = ([1, 0], [6, 3])
_BANDS = tuple(reversed(theme.SHADES))
_SMALL = (150, 76)
"""Width and height in px of a law without axes."""


@dataclass(frozen=True)
class Span:
    """What is marked from `start` to `end` in s, with its `label`."""

    label: str
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class Signal:
    """A signal of one run: `values` (k,) in `unit`, with constant `levels` of the run in the same unit.

    Samples below `lowest` are not drawn. The `spans` are flaws, and `instants` in s are marked.
    """

    name: str
    unit: str
    values: np.ndarray
    levels: Mapping[str, float] = field(default_factory=dict)
    spans: Sequence[Span] = ()
    instants: Mapping[str, float] = field(default_factory=dict)
    lowest: float = -np.inf


def titled(name: str, unit: str) -> str:
    """Return a name with its unit, as heads of columns and axes have it."""
    return theme.in_words(name) if unit in ("", "1") else f"{theme.in_words(name)} [{units.raised(unit)}]"


def draw_signal(time: np.ndarray, signal: Signal) -> Spec:
    """Return the curve of a signal at `time` (k,) in s, with what is marked."""
    shown = np.where(signal.values >= signal.lowest, signal.values, np.nan)
    known = shown[np.isfinite(shown)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    room = 0.08 * (high - low or 1.0)
    levels = {name: level for name, level in signal.levels.items() if low - room <= level <= high + room}
    x = {"field": "t", "type": "quantitative", "title": "time [s]", "axis": {"grid": False, "tickCount": 6},
         "scale": {"domain": [float(time[0]), float(time[-1])], "nice": False}}
    y = {"field": "y", "type": "quantitative", "title": None, "axis": {"tickCount": 5},
         "scale": {"domain": [theme.rounded(low - room), theme.rounded(high + room)], "nice": False}}
    layers: list[Spec] = [
        {"data": {"values": [{"t": span.start, "end": span.end} for span in signal.spans]},
         "mark": {"type": "rect", "color": theme.ALARM, "opacity": 0.2},
         "encoding": {"x": x, "x2": {"field": "end"}}},
        {"data": {"values": [{"t": span.start, "label": span.label} for span in signal.spans]},
         "mark": {"type": "rule", "color": theme.ALARM}, "encoding": {"x": x}},
        {"data": {"values": [{"t": instant} for instant in signal.instants.values()]},
         "mark": {"type": "rule", "color": theme.FAINT, "strokeDash": [4, 3]}, "encoding": {"x": x}},
        {"data": {"values": [{"y": level} for level in levels.values()]},
         "mark": {"type": "rule", "color": theme.BEFORE, "strokeDash": [2, 2]}, "encoding": {"y": y}},
        {"data": {"values": [{"t": float(time[-1]), "y": level, "label": name} for name, level in levels.items()]},
         "mark": {"type": "text", "align": "right", "dx": -4, "dy": -6, "fontSize": 11, "color": theme.BEFORE},
         "encoding": {"x": x, "y": y, "text": {"field": "label"}}},
        {"data": {"values": [{"t": theme.rounded(float(time[place])), "y": theme.rounded(float(shown[place]))}
                             for place in _thin(shown)]},
         "mark": {"type": "line", "strokeWidth": 1.4, "color": theme.AFTER, "invalid": "break-paths-filter-domains"},
         "encoding": {"x": x, "y": y}}]
    layers = [layer for layer in layers if layer["data"]["values"]]
    return _panel(titled(signal.name, signal.unit), {"layer": layers})


def _thin(values: np.ndarray) -> list[int]:
    """Places of the least and the largest value of each interval, so that a spike of one sample is drawn as well."""
    if len(values) <= 2 * _INTERVALS:
        return list(range(len(values)))
    places = set()
    for part in np.array_split(np.arange(len(values)), _INTERVALS):
        known = part[np.isfinite(values[part])]
        places |= {int(part[0]), *((int(known[np.argmin(values[known])]), int(known[np.argmax(values[known])]))
                                   if len(known) else ())}
    return sorted(places)


def draw_numbers(name: str, unit: str, values: np.ndarray, chosen: int, word: str) -> Spec:
    """Return one number for each run as dots (n,), with the `chosen` one marked; a run is called by a `word`."""
    finite = np.isfinite(values)
    rows = [{"run": int(run), "y": theme.rounded(float(values[run])), "chosen": int(run) == chosen}
            for run in np.flatnonzero(finite)]
    mark = {"x": {"field": "run", "type": "quantitative", "title": word, "axis": {"grid": False, "tickCount": 6},
                  "scale": {"domain": [-0.5, len(values) - 0.5], "nice": False}},
            "y": {"field": "y", "type": "quantitative", "title": None, "axis": {"tickCount": 5},
                  "scale": {"zero": False}}}
    layers: list[Spec] = [
        {"mark": {"type": "circle", "size": 18, "color": theme.AFTER, "opacity": 0.7}, "encoding": mark},
        {"transform": [{"filter": "datum.chosen"}], "encoding": mark,
         "mark": {"type": "point", "size": 110, "color": theme.BEFORE, "strokeWidth": 2}}]
    return _panel(titled(name, unit), {"data": {"values": rows}, "layer": layers})


def draw_curves(name: str, unit: str, over: tuple[str, str], curves: Mapping[str, tuple[np.ndarray, np.ndarray]],
                ) -> Spec:
    """Return named curves, each its places and values, over a quantity (name, unit)."""
    series = list(curves)
    rows = [{"x": theme.rounded(float(place)), "y": theme.rounded(float(value)), "series": label}
            for label, (places, values) in curves.items() for place, value in zip(places, values, strict=True)]
    encoding: Spec = {
        "x": {"field": "x", "type": "quantitative", "title": titled(*over), "scale": {"nice": False},
              "axis": {"grid": False, "tickCount": 6}},
        "y": {"field": "y", "type": "quantitative", "title": None, "axis": {"tickCount": 5}, "scale": {"zero": False}}}
    mark: Spec = {"type": "line", "strokeWidth": 1.6, "color": theme.AFTER}
    if len(series) > 1:
        rank = range(len(series))
        encoding["color"] = {"field": "series", "type": "nominal", "sort": None, "scale": {
            "domain": series, "range": [_COLOURS[place % len(_COLOURS)] for place in rank]},
            "legend": {"symbolType": "stroke", "columns": 3}}
        encoding["strokeDash"] = {"field": "series", "type": "nominal", "legend": None, "scale": {
            "domain": series, "range": [_DASHES[place // len(_COLOURS) % 2] for place in rank]}}
    return _panel(titled(name, unit), {"data": {"values": rows}, "mark": mark, "encoding": encoding})


def draw_map(name: str, unit: str, x: tuple[str, str, np.ndarray], y: tuple[str, str, np.ndarray],
             values: np.ndarray, nominal: tuple[float, float]) -> Spec:
    """Return `values` (b, a) in bands of colour over two axes (name, unit, a or b even places), with the nominal point.

    A value that is NaN is left blank.
    """
    sides = []
    for axis in (x, y):
        half = (axis[2][1] - axis[2][0]) / 2
        scale = {"domain": [float(axis[2][0] - half), float(axis[2][-1] + half)], "nice": False, "zero": False}
        sides.append((half, {"type": "quantitative", "title": titled(axis[0], axis[1]), "scale": scale,
                             "axis": {"grid": False, "tickCount": 5}}))
    (half_x, side_x), (half_y, side_y) = sides
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    rows = [{"x": float(place_x - half_x), "x2": float(place_x + half_x), "y": float(place_y - half_y),
             "y2": float(place_y + half_y), "value": theme.rounded(float(values[row, column]))}
            for row, place_y in enumerate(y[2]) for column, place_x in enumerate(x[2])
            if np.isfinite(values[row, column])]
    bands = {"type": "quantize", "domain": [theme.rounded(low), theme.rounded(high)],
             "range": list(_BANDS)}
    colour: Spec = {"field": "value", "type": "quantitative", "scale": bands}
    legend = {"title": None, "orient": "bottom", "symbolType": "square", "columns": 3, "format": ".3~r"}
    centre = {"data": {"values": [{"x": float(nominal[0]), "y": float(nominal[1]), "label": "nominal"}]}}
    at = {"x": {**side_x, "field": "x"}, "y": {**side_y, "field": "y"}}
    layers = [
        {"data": {"values": rows}, "mark": {"type": "rect", "strokeWidth": 0.8}, "encoding": {
            "x": {**side_x, "field": "x"}, "x2": {"field": "x2"}, "y": {**side_y, "field": "y"},
            "y2": {"field": "y2"}, "fill": {**colour, "legend": legend}, "stroke": {**colour, "legend": None}}},
        {**centre, "mark": {"type": "point", "shape": "cross", "size": 120, "filled": True, "opacity": 1,
                            "color": theme.BEFORE},
         "encoding": at},
        {**centre, "mark": {"type": "text", "dx": 10, "align": "left", "dy": -9, "fontSize": 12, "fontWeight": 600,
                            "color": theme.BEFORE}, "encoding": {**at, "text": {"field": "label"}}}]
    return _panel(titled(name, unit), {"layer": layers}, _MAP_HEIGHT)


def draw_thumbnail(x: Sequence[float], change: Sequence[float], lower: Sequence[float],
                   upper: Sequence[float], title: str) -> Spec:
    """Return a law without axes: its points with their band, about zero, in colours for bright and dark pages."""
    rows = [{"x": theme.rounded(place), "y": theme.rounded(value), "low": theme.rounded(low),
             "high": theme.rounded(high)}
            for place, value, low, high in zip(x, change, lower, upper, strict=True)]
    span = max(*change, 0.0) - min(*change, 0.0) or 1.0
    domain = [theme.rounded(min(*change, 0.0) - 0.15 * span), theme.rounded(max(*change, 0.0) + 0.15 * span)]
    side: Spec = {"type": "quantitative", "axis": None, "scale": {"zero": False, "nice": False}}
    up: Spec = {**side, "scale": {"domain": domain, "nice": False}}
    colour = theme.SHADES[2]
    layers: list[Spec] = [
        {"data": {"values": [{"y": 0}]}, "mark": {"type": "rule", "color": theme.AXIS},
         "encoding": {"y": {**up, "field": "y"}}},
        {"mark": {"type": "area", "color": colour, "opacity": 0.3, "clip": True},
         "encoding": {"x": {**side, "field": "x"}, "y": {**up, "field": "low"}, "y2": {"field": "high"}}},
        {"mark": {"type": "line", "color": colour, "strokeWidth": 2},
         "encoding": {"x": {**side, "field": "x"}, "y": {**up, "field": "y"}}}]
    return {**theme.picture(title, "", {}), "background": None, "padding": 2, "width": _SMALL[0], "height": _SMALL[1],
            "data": {"values": rows}, "layer": layers}


def _panel(title: str, body: Spec, height: int = _HEIGHT) -> Spec:
    return {**theme.picture(title, "", body), "padding": 2, "width": WIDTH, "height": height,
            "autosize": {"type": "fit", "contains": "padding"}}
