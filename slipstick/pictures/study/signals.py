"""The experiments that the model without the effect describes worst: the signals measured and simulated."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import models
from slipstick.pictures.theme import Spec, plain

CAPTION = ("The worst experiments, each of another current profile. Averages over 16 ms; each simulation has the run's "
           "own scatter, so that nothing is left that a parameter could do. The input speed is divided by the gear "
           "ratio: where it meets the output speed, the clutch locks. Dashed: the measured shifting time.")

_PANELS = (("pressure", "pressure [bar]", 70), ("speed", "shaft speed [rad/s]", 130),
           ("output_torque", "output torque [N m]", 140))
_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}
_AFTER_LOCK = 0.15  # s
_ACROSS, _DOWN, _LABEL = 54, 12, 34  # px between panels, and above the first
_WIDE, _LIGHT = 5.0, "#aab4bc"  # the measured line, seen on both sides of one that lies on it


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """A column an experiment, a row a signal; None without signals."""
    shown, who = figure_data["signals"], models(result, figure_data)
    if not shown:
        return None
    width = (theme.WIDTH - _ACROSS * (len(shown) - 1)) // len(shown)
    rows: list[Spec] = [{"spacing": _ACROSS, "bounds": "flush", "hconcat": [
        _panel(one, who, panel, width, first=one is shown[0]) for one in shown]}
            for panel in _PANELS]
    for place, one in enumerate(shown):
        rows[0]["hconcat"][place]["layer"].append({
            "data": {"values": [{}]}, "encoding": {"x": {"value": 0}, "y": {"value": -_LABEL}},
            "mark": {"type": "text", "align": "left", "baseline": "top", "color": theme.FAINT, "lineHeight": 14,
                     "text": _conditions(figure_data["conditions"], one["condition"])}})
    return theme.picture(_title(result, shown, list(who)), "Measured, and simulated after the best fit.",
                         {"spacing": _DOWN, "vconcat": rows})


def _title(result: Mapping[str, Any], shown: Sequence[Mapping[str, Any]], who: list[str]) -> str:
    def off(key: str, signal: str) -> float:
        squares = [(one[key][signal][at] - value) ** 2 for one in shown for at, value in enumerate(
            one["measured"][signal])]
        return math.sqrt(sum(squares) / len(squares))

    worst = max(_UNITS, key=lambda signal: off("before", signal) / result["noise"][signal])
    before, *after = (f"{off(key, worst):.2g}" for key in who)
    added = "with the effect" if len(result["answer"]["effects"]) == 1 else "with what was added"
    return f"In the worst experiments the {plain(worst)} is off by {before} {_UNITS[worst]}" + "".join(
        f", {added} by {one}" for one in after) + f"; noise is {result['noise'][worst]:.2g}"


def _panel(one: Mapping[str, Any], who: Mapping[str, tuple[str, str]], panel: tuple[str, str, int],
           width: float, first: bool) -> Spec:
    signal, title, height = panel
    last = panel is _PANELS[-1]
    colour = {**theme.whose({"measured": _LIGHT, **dict(who.values())}), "legend": {"symbolType": "stroke"}}
    end = min(one["time"][-1], one["lock"] + _AFTER_LOCK)
    x: Spec = {"field": "t", "type": "quantitative", "title": "time [s]" if last else None,
               "scale": {"domain": [0, theme.number(end)], "nice": False},
               "axis": {"grid": False, "labels": last, "ticks": last, "tickCount": 5}}
    y: Spec = {"field": "y", "type": "quantitative", "title": title if first else None,
               "axis": {"tickCount": 4, "format": "~f"}}
    layers: list[Spec] = [{"data": {"values": [{"t": one["lock"]}]}, "encoding": {"x": x},
                           "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT}}]
    for key, name, stroke in [("measured", "measured", _WIDE), *((key, name, 1.6) for key, (name, _) in who.items())]:
        for values in _curves(one, key, signal):
            rows = [{"t": t, "y": theme.number(value, 4)} for t, value in zip(one["time"], values, strict=True)
                    if t <= end]
            layers.append({"data": {"values": rows}, "mark": {"type": "line", "strokeWidth": stroke},
                           "encoding": {"x": x, "y": y, "color": {**colour, "datum": name}}})
    return {"width": width, "height": height, "layer": layers}


def _curves(one: Mapping[str, Any], key: str, signal: str) -> list[Sequence[float]]:
    if signal != "speed":
        return [one[key][signal]]
    return [[value / one["gear_ratio"] for value in one[key]["input_speed"]], one[key]["output_speed"]]


def _conditions(conditions: Mapping[str, Any], place: int) -> list[str]:
    profile, speed, inertia, brake = (conditions[name][place] for name in (
        "current_profile", "motor_speed", "load_inertia", "brake_torque"))
    return [f"{place}: profile {profile}, motor {speed:.0f} rad/s", f"{inertia:.3g} kg m², brake {brake:.3g} N m"]
