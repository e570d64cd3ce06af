"""The gap on held-out conditions: shifting-time errors of all experiments, and the closed share of each signal."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import model_series, title
from slipstick.pictures.theme import Spec, in_words

CAPTION = ("Top: measured minus predicted shifting time of every experiment. Each prediction comes from fits without "
           "the experiments of that motor speed or of that current profile. Bottom: the closed share of the gap with "
           "90 % intervals. At 100 %, the remaining error is that of sensor noise and run-to-run scatter alone. "
           "Quantities without a significant gap are omitted. The control is the best effect that acts on another "
           "quantity; it shows how much an arbitrary effect would close.")

_HEIGHT = 210
_LOWEST = -50.0  # percent: lower values are drawn at this value
_ROW = 30  # px
_MOST = 10  # motor speeds that can be labelled without overlap
_ORDER = "experiments, ordered by motor speed, current profile, load inertia and brake torque"


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return errors by experiment and closed shares by signal; None if no effect was added."""
    gap = result["gap"]
    if gap is None:
        return None
    time = gap["closures"]["shifting_time"]
    before, after = (1e3 * time[f"rms_{when}"] for when in ("before", "after"))
    verb = "falls" if after < before else "grows"
    return theme.picture(
        f"On held-out conditions, the shifting-time error {verb} from {before:.3g} to {after:.3g} ms",
        f"Root-mean-square error. Noise and scatter alone would cause {1e3 * time['rms_expected']:.3g} ms.",
        {"spacing": 26, "resolve": {"scale": {"color": "independent"}},
         "vconcat": [_differences(result, figure_data), *_closures(result, figure_data)]})


def _differences(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec:
    conditions, prediction = figure_data["conditions"], figure_data["prediction"]
    models = model_series(result, figure_data)
    names = ("motor_speed", "current_profile", "load_inertia", "brake_torque")
    order = sorted(range(len(prediction["measured"])), key=lambda index: [conditions[name][index] for name in names])
    speeds = [conditions["motor_speed"][index] for index in order]
    rows = [{"position": position, "experiment": index, "series": label,
             "difference": theme.rounded(1e3 * (prediction["measured"][index] - prediction[key]["mean"][index]), 4)}
            for key, (label, _) in models.items() for position, index in enumerate(order)]
    starts = [position for position, speed in enumerate(speeds) if position == 0 or speed != speeds[position - 1]]
    starts = starts if len(starts) <= _MOST else []
    x: Spec = {"field": "position", "type": "quantitative", "title": _ORDER,
               "scale": {"nice": False, "padding": 8}, "axis": {"labels": False, "ticks": False, "grid": False}}
    y: Spec = {"field": "difference", "type": "quantitative", "title": "measured − predicted [ms]"}
    return {"width": theme.WIDTH, "height": _HEIGHT, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        {"data": {"values": [{"position": start - 0.5} for start in starts[1:]]}, "encoding": {"x": x},
         "mark": {"type": "rule", "color": "#c3cad0"}},
        {"data": {"values": [{"position": start, "label": f"{speeds[start]:.0f} rad/s"} for start in starts]},
         "mark": {"type": "text", "align": "left", "color": theme.FAINT, "dx": 2},
         "encoding": {"x": x, "y": {"value": -8}, "text": {"field": "label"}}},
        {"data": {"values": rows}, "mark": {"type": "point", "filled": True, "size": 18, "opacity": 0.8},
         "encoding": {"x": x, "y": y, "color": {**theme.series_colour(dict(models.values())), "field": "series",
                                                     "legend": {"offset": 24}},
                      "tooltip": [{"field": "experiment", "type": "quantitative"},
                                  {"field": "difference", "type": "quantitative"}]}}]}


def _closures(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> list[Spec]:
    """Return one row per channel with a significant gap; empty without one."""
    gap, added = result["gap"], result["answer"]["effects"]
    named = model_series(result, figure_data)["after"][0]
    series = {named: (gap["closures"], theme.AFTER)}
    if gap["control"] is not None:
        series[f"control: {title(figure_data, gap['control']['effect'])}"] = (gap["control"]["closures"], theme.FAINT)
    rows = [{"channel": in_words(channel), "series": label, **_percent(closure)}
            for label, (closures, _) in series.items() for channel, closure in closures.items()
            if closure["closure"] is not None]
    if not rows or not added:
        return []
    y: Spec = {"field": "channel", "type": "nominal", "title": None, "sort": None,
               "axis": {"ticks": False, "domain": False, "grid": False}}
    offset = {"yOffset": {"field": "series", "type": "nominal", "sort": list(series)}}
    low, high = min(0.0, *(row["lower"] for row in rows)), max(100.0, *(row["upper"] for row in rows))
    x: Spec = {"field": "closure", "type": "quantitative", "title": "closed share of the gap [%]",
               "scale": {"domain": [low, high], "nice": False, "padding": 12}}
    colour = {**theme.series_colour({label: hue for label, (_, hue) in series.items()}), "field": "series"}
    height = _ROW * len({row["channel"] for row in rows})
    return [{"width": theme.WIDTH - 120, "height": height, "data": {"values": rows}, "layer": [
        *({"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT, "strokeDash": dash},
           "encoding": {"x": {"datum": percent}}} for percent, dash in ((0, []), (100, [4, 3]))),
        {"mark": {"type": "rule", "strokeWidth": 2, "clip": True}, "encoding": {
            "x": {**x, "field": "lower"}, "x2": {"field": "upper"}, "y": y, **offset, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1},
         "encoding": {"x": x, "y": y, **offset, "color": colour}},
        {"transform": [{"filter": "datum.beyond != ''"}], "mark": {"type": "text", "align": "left", "dx": 8,
                                                                   "color": theme.FAINT},
         "encoding": {"x": x, "y": y, **offset, "text": {"field": "beyond"}}}]}]


def _percent(closure: Mapping[str, float]) -> Spec:
    if 100 * closure["closure"] < _LOWEST:
        return {**dict.fromkeys(("closure", "lower", "upper"), _LOWEST),
                "beyond": "larger error than without the effect"}
    ends = {name: theme.rounded(max(_LOWEST, 100 * closure[name]), 4) for name in ("closure", "lower", "upper")}
    return {**ends, "beyond": ""}
