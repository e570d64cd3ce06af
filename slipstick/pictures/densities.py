"""The predicted density of the shifting time of every experiment, with the measured time (Fig. 7 of the paper)."""

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.calibration import probability_below
from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec

CAPTION = ("Each shape is the density of one experiment, predicted with the fitted inputs and output noise: the wider "
           "the shape, the more likely the value. Each dot is what was measured. All are relative to the predicted "
           "mean of their experiment.")

_ROW = 36  # experiments per row
_HEIGHT = 105
_HALF_WIDTH = 0.46  # of the widest shape, as a share of the distance between experiments
_NEGLIGIBLE = 0.015  # of the largest density: narrower than a line
_CENTRAL = 0.9  # probability of the central interval
_ORDER = "experiments, ordered by motor speed, load inertia and brake torque"
_INSIDE, _OUTSIDE = "inside the central 90 % interval", "outside"


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return rows of shapes, one per experiment, grouped by current profile; None without predictions."""
    prediction, conditions = output["figure_data"]["prediction"], output["figure_data"]["conditions"]
    shown = Output.of(output["figure_data"])
    locking = [index for index, mean in enumerate(prediction["mean"]) if theme.rounded(mean) is not None]
    if not locking:
        return None
    largest = max(value for index in locking for value in prediction["density"][index])
    shapes = {index: _shape(index, prediction, largest, shown.factor) for index in locking}
    dots = {index: _dot(index, prediction, conditions, shown.factor) for index in locking}
    speeds = conditions.get("motor_speed")  # None for another machine
    panels = [_panel(title, [shapes[index] for index in row], [dots[index] for index in row],
                     None if speeds is None else [speeds[index] for index in row], shown.small)
              for title, row in _rows(locking, conditions)]
    for panel in panels[:-1]:
        panel["layer"][-1]["encoding"]["x"]["title"] = None
    outside = sum(dot["where"] == _OUTSIDE for dot in dots.values())
    omitted = len(prediction["mean"]) - len(locking)
    return theme.picture(
        f"{outside} of {len(locking)} measured {shown.plural} lie outside their predicted central 90 % intervals; "
        f"the expected number is {round((1 - _CENTRAL) * len(locking))}",
        f"Shapes: predicted densities, on a common scale. Dots: measured {shown.plural}. Zero: predicted mean of each "
        "experiment."
        + (f" Not drawn: {omitted} that {shown.missing}." if omitted else ""),
        {"spacing": 14, "vconcat": panels, "resolve": {"scale": {"y": "shared"}}})


def _rows(experiments: Sequence[int], conditions: Mapping[str, Any]) -> list[tuple[str, list[int]]]:
    """Return the rows of the picture: title and experiments, one or more rows per current profile."""
    if "current_profile" not in conditions:  # of another machine
        return [("", list(experiments[first:first + _ROW])) for first in range(0, len(experiments), _ROW)]
    profile, *rest = (conditions[name] for name in ("current_profile", "motor_speed", "load_inertia", "brake_torque"))
    ordered = sorted(experiments, key=lambda index: (profile[index], *(column[index] for column in rest)))
    groups = [(number, list(group)) for number, group in groupby(ordered, key=lambda index: profile[index])]
    return [(f"current profile {number}", group[first:first + _ROW])
            for number, group in groups for first in range(0, len(group), _ROW)]


def _panel(title: str, shapes: Sequence[Spec], dots: Sequence[Spec], speed: Sequence[float] | None,
           unit: str) -> Spec:
    y: Spec = {"field": "y", "type": "quantitative", "title": f"measured − predicted [{unit}]",
               "axis": {"tickCount": 4}}
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
        *(_speeds(speed) if speed else ()),
        {"data": {"values": [{**dot, "x": x} for x, dot in enumerate(dots)]},
         "mark": {"type": "point", "filled": True, "size": 26, "opacity": 1},
         "encoding": {
             "x": {"field": "x", "type": "quantitative", "title": _ORDER if speed else "conditions"}, "y": y,
             "color": {**theme.series_colour({_INSIDE: theme.INK, _OUTSIDE: theme.ALARM}), **where},
             "shape": {**where, "scale": {"domain": [_INSIDE, _OUTSIDE], "range": ["circle", "diamond"]}},
             "tooltip": [{"field": "conditions", "type": "nominal"}, *(
                 {"field": name, "type": "quantitative"} for name in ("experiment", "measured", "predicted"))]}}]}


def _shape(index: int, prediction: Mapping[str, Any], largest: float, factor: float) -> Spec:
    outline = [(factor * (time - prediction["mean"][index]), _HALF_WIDTH * density / largest) for time, density in
               zip(prediction["density_time"][index], prediction["density"][index], strict=True)
               if density > _NEGLIGIBLE * largest]
    return {"experiment": prediction["condition"][index], "y": [theme.rounded(y, 4) for y, _ in outline],
            "half": [half for _, half in outline]}


def _dot(index: int, prediction: Mapping[str, Any], conditions: Columns, factor: float) -> Spec:
    measured, mean = prediction["measured"][index], prediction["mean"][index]
    return {"experiment": prediction["condition"][index], "y": theme.rounded(factor * (measured - mean), 4),
            "conditions": described(conditions, index),
            "measured": theme.rounded(measured), "predicted": theme.rounded(mean),
            "where": _INSIDE if _is_inside(prediction, index) else _OUTSIDE}


def _speeds(speed: Sequence[float]) -> list[Spec]:
    """Return a faint line at each change of motor speed, and the speeds as labels."""
    changes = [x for x, (before, after) in enumerate(pairwise(speed)) if before != after]
    marks = [{"x": x + 0.5, "speed": f"{speed[x]:.0f} rad/s"} for x in [*changes, len(speed) - 1]]
    encoding: Spec = {"x": {"field": "x", "type": "quantitative"}}
    return [{"data": {"values": marks[:-1]}, "mark": {"type": "rule", "color": theme.EDGE}, "encoding": encoding},
            {"data": {"values": marks}, "mark": {"type": "text", "align": "right", "dx": -4, "color": theme.FAINT},
             "encoding": {**encoding, "y": {"value": -7}, "text": {"field": "speed"}}}]


def _is_inside(prediction: Mapping[str, Any], index: int) -> bool:
    """Return whether the measured time lies between the 5 % and 95 % quantiles of its density."""
    return (1 - _CENTRAL) / 2 <= probability_below(prediction, index) <= (1 + _CENTRAL) / 2
