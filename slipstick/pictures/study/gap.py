"""The gap on conditions that the fit has not seen: of every experiment's shifting time, and closed by signal."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import models, title
from slipstick.pictures.theme import Spec, plain

CAPTION = ("Above: measured less predicted shifting time of every experiment, each predicted by a fit that has seen no "
           "experiment of its motor speed, or of its profile. Below: the share of the gap that is closed, with 90 % "
           "intervals; 100 % leaves what sensor noise and scatter from run to run explain. Left out where there was "
           "no gap to close. The control is the best effect that acts on another quantity: what any effect would "
           "close.")

_HEIGHT = 210
_LOWEST = -50.0  # per cent: what closes less is drawn there
_ROW = 30
_MOST = 10  # motor speeds that can be written side by side
_ORDER = "experiments, by motor speed, current profile, load inertia and brake torque"


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Differences by experiment, and closures by signal; None where nothing was added."""
    gap = result["gap"]
    if gap is None:
        return None
    time = gap["closures"]["shifting_time"]
    before, after = (1e3 * time[f"rms_{when}"] for when in ("before", "after"))
    verb = "falls" if after < before else "grows"
    return theme.picture(
        f"On conditions never seen, the shifting-time error {verb} from {before:.3g} to {after:.3g} ms",
        f"Root mean square; noise and scatter alone would leave {1e3 * time['rms_expected']:.3g} ms.",
        {"spacing": 26, "resolve": {"scale": {"color": "independent"}},
         "vconcat": [_differences(result, figure_data), *_closures(result, figure_data)]})


def _differences(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec:
    conditions, prediction, who = figure_data["conditions"], figure_data["prediction"], models(result, figure_data)
    names = ("motor_speed", "current_profile", "load_inertia", "brake_torque")
    order = sorted(range(len(prediction["measured"])), key=lambda place: [conditions[name][place] for name in names])
    speeds = [conditions["motor_speed"][place] for place in order]
    rows = [{"place": at, "experiment": place, "who": name,
             "difference": theme.number(1e3 * (prediction["measured"][place] - prediction[key]["mean"][place]), 4)}
            for key, (name, _) in who.items() for at, place in enumerate(order)]
    starts = [at for at, speed in enumerate(speeds) if at == 0 or speed != speeds[at - 1]]
    starts = starts if len(starts) <= _MOST else []
    x: Spec = {"field": "place", "type": "quantitative", "title": _ORDER,
               "scale": {"nice": False, "padding": 8}, "axis": {"labels": False, "ticks": False, "grid": False}}
    y: Spec = {"field": "difference", "type": "quantitative", "title": "measured − predicted [ms]"}
    return {"width": theme.WIDTH, "height": _HEIGHT, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        {"data": {"values": [{"place": at - 0.5} for at in starts[1:]]}, "encoding": {"x": x},
         "mark": {"type": "rule", "color": "#c3cad0"}},
        {"data": {"values": [{"place": at, "said": f"{speeds[at]:.0f} rad/s"} for at in starts]},
         "mark": {"type": "text", "align": "left", "color": theme.FAINT, "dx": 2},
         "encoding": {"x": x, "y": {"value": -8}, "text": {"field": "said"}}},
        {"data": {"values": rows}, "mark": {"type": "point", "filled": True, "size": 18, "opacity": 0.8},
         "encoding": {"x": x, "y": y, "color": {**theme.whose(dict(who.values())), "field": "who",
                                                     "legend": {"offset": 24}},
                      "tooltip": [{"field": "experiment", "type": "quantitative"},
                                  {"field": "difference", "type": "quantitative"}]}}]}


def _closures(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> list[Spec]:
    """A row a channel that has a gap; none where none has."""
    gap, added = result["gap"], result["answer"]["effects"]
    named = models(result, figure_data)["after"][0]
    shown = {named: (gap["closures"], theme.AFTER)}
    if gap["control"] is not None:
        shown[f"control: {title(figure_data, gap['control']['effect'])}"] = (gap["control"]["closures"], theme.FAINT)
    rows = [{"channel": plain(channel), "who": who, **_percent(one)}
            for who, (closures, _) in shown.items() for channel, one in closures.items() if one["closure"] is not None]
    if not rows or not added:
        return []
    y: Spec = {"field": "channel", "type": "nominal", "title": None, "sort": None,
               "axis": {"ticks": False, "domain": False, "grid": False}}
    offset = {"yOffset": {"field": "who", "type": "nominal", "sort": list(shown)}}
    low, high = min(0.0, *(row["lower"] for row in rows)), max(100.0, *(row["upper"] for row in rows))
    x: Spec = {"field": "closure", "type": "quantitative", "title": "share of the gap that is closed [%]",
               "scale": {"domain": [low, high], "nice": False, "padding": 12}}
    colour = {**theme.whose({who: hue for who, (_, hue) in shown.items()}), "field": "who"}
    height = _ROW * len({row["channel"] for row in rows})
    return [{"width": theme.WIDTH - 120, "height": height, "data": {"values": rows}, "layer": [
        *({"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT, "strokeDash": dash},
           "encoding": {"x": {"datum": at}}} for at, dash in ((0, []), (100, [4, 3]))),
        {"mark": {"type": "rule", "strokeWidth": 2, "clip": True}, "encoding": {
            "x": {**x, "field": "lower"}, "x2": {"field": "upper"}, "y": y, **offset, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1},
         "encoding": {"x": x, "y": y, **offset, "color": colour}},
        {"transform": [{"filter": "datum.beyond != ''"}], "mark": {"type": "text", "align": "left", "dx": 8,
                                                                   "color": theme.FAINT},
         "encoding": {"x": x, "y": y, **offset, "text": {"field": "beyond"}}}]}]


def _percent(one: Mapping[str, float]) -> Spec:
    if 100 * one["closure"] < _LOWEST:
        return {**dict.fromkeys(("closure", "lower", "upper"), _LOWEST), "beyond": "a larger error than without it"}
    ends = {name: theme.number(max(_LOWEST, 100 * one[name]), 4) for name in ("closure", "lower", "upper")}
    return {**ends, "beyond": ""}
