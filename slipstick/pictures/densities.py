"""The predicted density of every experiment with its measured time in it (Fig. 7 of the paper)."""

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("The wider the shape, the more likely that shifting time under the fitted inputs and noise; the dot is what "
           "was measured. Times are counted from the predicted mean of each experiment, so that all can be read.")

_ROW = 36  # experiments side by side
_HEIGHT = 105
_HALF_WIDTH = 0.46  # of the widest shape, in experiments
_NEGLIGIBLE = 0.015  # of the largest density: thinner than a line
_CENTRAL = 0.9
_ORDER = "experiments, by motor speed, load inertia and brake torque"
_INSIDE, _OUTSIDE = "inside its central 90 %", "outside"


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Rows of shapes, one an experiment: a row for each current profile."""
    shown, conditions = figure_data["prediction"], figure_data["conditions"]
    places = [place for place, mean in enumerate(shown["mean"]) if theme.number(mean) is not None]
    if not places:
        return None
    widest = max(value for place in places for value in shown["density"][place])
    shapes = {place: _shape(place, shown, widest) for place in places}
    dots = {place: _dot(place, shown) for place in places}
    panels = [_panel(title, [shapes[place] for place in chunk], [dots[place] for place in chunk],
                     [conditions["motor_speed"][place] for place in chunk])
              for title, chunk in _chunks(places, conditions)]
    for panel in panels[:-1]:
        panel["layer"][-1]["encoding"]["x"]["title"] = None
    outside = sum(dot["where"] == _OUTSIDE for dot in dots.values())
    lost = len(shown["mean"]) - len(places)
    return theme.picture(
        f"{outside} of {len(places)} measured times lie outside the central 90 % predicted for them; "
        f"{round((1 - _CENTRAL) * len(places))} would be expected",
        "Shapes: predicted density, the same scale everywhere. Dots: measured. Zero is the predicted mean of each."
        + (f" {lost} that may never lock left out." if lost else ""),
        {"spacing": 14, "vconcat": panels, "resolve": {"scale": {"y": "shared"}}})


def _chunks(places: Sequence[int], conditions: Mapping[str, Any]) -> list[tuple[str, list[int]]]:
    profile, *rest = (conditions[name] for name in ("current_profile", "motor_speed", "load_inertia", "brake_torque"))
    ordered = sorted(places, key=lambda place: (profile[place], *(column[place] for column in rest)))
    groups = [(number, list(group)) for number, group in groupby(ordered, key=lambda place: profile[place])]
    return [(f"current profile {number}", group[first:first + _ROW])
            for number, group in groups for first in range(0, len(group), _ROW)]


def _panel(title: str, shapes: Sequence[Spec], dots: Sequence[Spec], speed: Sequence[float]) -> Spec:
    y: Spec = {"field": "y", "type": "quantitative", "title": "from mean [ms]", "axis": {"tickCount": 4}}
    x: Spec = {"type": "quantitative", "scale": {"domain": [-0.7, max(len(dots), 12) - 0.3], "nice": False},
               "axis": {"labels": False, "ticks": False, "grid": False, "domain": False}}
    where: Spec = {"field": "where", "type": "nominal"}
    return {"width": theme.WIDTH, "height": _HEIGHT, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT, "strokeWidth": 0.7},
         "encoding": {"y": {"datum": 0}}},
        {"data": {"values": [{"experiment": shape["experiment"], "y": shape["y"],
                              "left": [round(x - half, 3) for half in shape["half"]],
                              "right": [round(x + half, 3) for half in shape["half"]]}
                             for x, shape in enumerate(shapes)]},
         "transform": [{"flatten": ["y", "left", "right"]}],
         "mark": {"type": "area", "orient": "horizontal", "color": theme.AFTER, "opacity": 0.45},
         "encoding": {"x": {**x, "field": "left"}, "x2": {"field": "right"}, "y": y,
                      "detail": {"field": "experiment"}}},
        {"data": {"values": [{}]}, "mark": {"type": "text", "align": "left", "text": title, "color": theme.MEASURED,
                                            "fontSize": 12}, "encoding": {"x": {"value": 0}, "y": {"value": -7}}},
        *_speeds(speed),
        {"data": {"values": [{**dot, "x": x} for x, dot in enumerate(dots)]},
         "mark": {"type": "point", "filled": True, "size": 26, "opacity": 1},
         "encoding": {
             "x": {"field": "x", "type": "quantitative", "title": _ORDER}, "y": y,
             "color": {**theme.whose({_INSIDE: theme.INK, _OUTSIDE: theme.ALARM}), **where},
             "shape": {**where, "scale": {"domain": [_INSIDE, _OUTSIDE], "range": ["circle", "diamond"]}},
             "tooltip": [{"field": name, "type": "quantitative"}
                         for name in ("experiment", "measured", "predicted")]}}]}


def _shape(place: int, shown: Mapping[str, Any], widest: float) -> Spec:
    outline = [(1e3 * (time - shown["mean"][place]), _HALF_WIDTH * density / widest) for time, density in
               zip(shown["density_time"][place], shown["density"][place], strict=True)
               if density > _NEGLIGIBLE * widest]
    return {"experiment": shown["condition"][place], "y": [theme.number(y, 4) for y, _ in outline],
            "half": [half for _, half in outline]}


def _dot(place: int, shown: Mapping[str, Any]) -> Spec:
    measured, mean = shown["measured"][place], shown["mean"][place]
    return {"experiment": shown["condition"][place], "y": theme.number(1e3 * (measured - mean), 4),
            "measured": theme.number(measured), "predicted": theme.number(mean),
            "where": _INSIDE if _inside(shown, place) else _OUTSIDE}


def _speeds(speed: Sequence[float]) -> list[Spec]:
    """A faint line where the motor speed changes, and the speed above."""
    changes = [x for x, (one, other) in enumerate(pairwise(speed)) if one != other]
    marks = [{"x": x + 0.5, "speed": f"{speed[x]:.0f} rad/s"} for x in [*changes, len(speed) - 1]]
    at: Spec = {"x": {"field": "x", "type": "quantitative"}}
    return [{"data": {"values": marks[:-1]}, "mark": {"type": "rule", "color": "#c3cad0"}, "encoding": at},
            {"data": {"values": marks}, "mark": {"type": "text", "align": "right", "dx": -4, "color": theme.FAINT},
             "encoding": {**at, "y": {"value": -7}, "text": {"field": "speed"}}}]


def _inside(shown: Mapping[str, Any], place: int) -> bool:
    """Whether the measured time lies between the 5 % and 95 % quantiles of its density."""
    time = np.array(shown["density_time"][place])
    with np.errstate(over="ignore"):  # where the density all but vanishes; the slope there comes out as 0
        share = PchipInterpolator(time, shown["density"][place]).antiderivative()
    below = share(np.clip(shown["measured"][place], time[0], time[-1])) / share(time[-1])
    return bool((1 - _CENTRAL) / 2 <= below <= (1 + _CENTRAL) / 2)
