"""One engagement (Fig. 4 of the paper): fill, slip and stick, the shafts, and the moment they lock."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("One engagement: the chamber fills until the plates touch, they slip while torque speeds up the load, and "
           "stick from the shifting time on, where the two shafts meet. The input speed is divided by the gear ratio.")

COLOURS = {"measured": theme.MEASURED, "nominal": theme.BEFORE, "calibrated": theme.AFTER, "simulated": theme.AFTER}
_PANELS = (("current", "current [A]", 45), ("pressure", "oil pressure [bar]", 85),
           ("piston_position", "piston [mm]", 55), ("speed", "shaft speed [rad/s]", 160),
           ("output_torque", "output torque [N m]", 120))
_SPEEDS = {"input_speed": ("input ÷ gear ratio", "left"), "output_speed": ("output", "right")}
"""Signals of the shafts, what is written above them, and on which side of its place: where the curve goes down."""
_SAMPLES = 300
_AFTER_LOCK = 0.35  # s drawn of the sticking phase
_TIME: Spec = {"field": "t", "type": "quantitative"}

Signals = Mapping[str, Sequence[float | None]]
"""Name of a signal -> its samples."""


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """The engagement of the figure data, measured where there are signals, and simulated at the fitted means."""
    shown, prediction = figure_data["engagement"], figure_data["prediction"]
    if shown is None:
        return None
    condition, lock = shown["condition"], shown["lock"]
    measured = prediction["measured"][prediction["condition"].index(condition)]
    simulated = "not at all" if lock is None else f"at {theme.milliseconds(lock)}"
    lines = {"measured": shown["measured"], "simulated": {"current": shown["current"], **shown["simulated"]}}
    return theme.picture(
        f"Experiment {condition} locks at {theme.milliseconds(measured)} on the bench, {simulated} in the fitted model",
        "Shaded: the phases of the simulation at the fitted means. Dashed: the shifting times.",
        panels(shown["time"], {who: signals for who, signals in lines.items() if signals},
               {"measured": measured, "simulated": lock}, shown["touch"], shown["gear_ratio"]))


def panels(time: Sequence[float], lines: Mapping[str, Signals], locks: Mapping[str, float | None],
           touch: float | None, gear_ratio: float) -> Spec:
    """Every signal that any of `lines` (who -> signals) has, over `time` in s, with the shifting times `locks` in s.

    `touch` is when torque starts. The phases are those of the last of `lines`.
    """
    known = {who: lock for who, lock in locks.items() if lock is not None}
    end = min(time[-1], max(known.values(), default=time[-1]) + _AFTER_LOCK)
    found = {signal for signals in lines.values() for signal in signals} | {"speed"}
    drawn = [panel for panel in _PANELS if panel[0] in found]
    views: list[Spec] = [{"width": theme.WIDTH, "height": height, "layer": _layers(name, title, height, lines)}
                         for name, title, height in drawn]
    samples = _samples(time, lines, gear_ratio, end)
    views[0]["layer"].append(_note({"name": "phases"}, "from", {"value": -7}, "phase"))
    speeds = views[[name for name, *_ in drawn].index("speed")]
    speeds["layer"] += [
        _note({"name": "locks"}, "t", {"value": speeds["height"] - 10}, "note"),
        *_shafts(list(lines), samples)]
    for view in views:
        axis: Spec = {"grid": False, "title": None, "labels": False, "ticks": False}
        if view is views[-1]:
            axis = {"grid": False, "title": "time since the shift command [s]", "format": ".1f"}
        scale = {"domain": [0, theme.number(end)], "nice": False}
        view["encoding"] = {"x": {**_TIME, "scale": scale, "axis": {**axis, "tickCount": 12}}}
    return {"spacing": 10, "vconcat": views, "datasets": {
        "signals": samples, "phases": _phases(touch, locks[list(lines)[-1]], end),
        "locks": [{"who": who, "t": theme.number(lock), "note": "shifting time" if lock == max(known.values()) else ""}
                  for who, lock in known.items()]}}


def _samples(time: Sequence[float], lines: Mapping[str, Signals], gear_ratio: float, end: float) -> list[Spec]:
    inside = [sample for sample, t in enumerate(time) if t <= end]
    scale = {"input_speed": 1 / gear_ratio, "piston_position": 1e3}  # m -> mm
    rows = []
    for sample in inside[::math.ceil(len(inside) / _SAMPLES)]:
        row: Spec = {"t": theme.number(time[sample])}
        for who, signals in lines.items():
            for name, values in signals.items():
                value = values[sample]
                row[f"{who} {name}"] = theme.number(None if value is None else value * scale.get(name, 1.0), 4)
        rows.append(row)
    return rows


def _phases(touch: float | None, lock: float | None, end: float) -> list[Spec]:
    bounds = [0.0, end if touch is None else touch, end if lock is None else lock, end]
    return [{"phase": phase, "colour": colour, "from": theme.number(begin), "to": theme.number(stop)}
            for (phase, colour), begin, stop in zip(theme.PHASES.items(), bounds[:-1], bounds[1:], strict=True)
            if stop > begin]


def _layers(name: str, title: str, height: int, lines: Mapping[str, Signals]) -> list[Spec]:
    colour = {**theme.whose({who: COLOURS[who] for who in lines}), "legend": {"symbolType": "stroke"}}
    y = {"type": "quantitative", "title": title, "axis": {"tickCount": max(2, height // 30)}, "scale": {"padding": 5}}
    below, above = {"strokeWidth": 3, "opacity": 0.6}, {"strokeWidth": 1.8}
    curves = [{"data": {"name": "signals"}, "mark": {"type": "line", **(below if who == "measured" else above)},
               "encoding": {"x": _TIME, "y": {**y, "field": f"{who} {signal}"}, "color": {**colour, "datum": who}}}
              for who, signals in lines.items() for signal in (_SPEEDS if name == "speed" else (name,))
              if signal in signals]
    return [
        {"data": {"name": "phases"}, "mark": "rect", "encoding": {
            "x": {**_TIME, "field": "from"}, "x2": {"field": "to"},
            "color": {"field": "colour", "type": "nominal", "scale": None}}},
        {"data": {"name": "locks"}, "mark": {"type": "rule", "strokeDash": [4, 3], "strokeWidth": 1.2},
         "encoding": {"x": _TIME, "color": {**colour, "field": "who"}}},
        *curves]


def _shafts(who: list[str], samples: list[Spec]) -> list[Spec]:
    """The names of the two speeds, above the curves before the shafts meet."""
    sample = samples[len(samples) * 3 // 8]
    return [_note({"values": [{"t": sample["t"], "y": max(sample.get(f"{name} {signal}") or 0.0 for name in who),
                               "shaft": words}]}, "t", {"field": "y", "type": "quantitative"}, "shaft", side, -12)
            for signal, (words, side) in _SPEEDS.items()]


def _note(data: Spec, at: str, y: Spec, text: str, align: str = "left", dy: int = 0) -> Spec:
    return {"data": data,
            "mark": {"type": "text", "align": align, "dx": 4, "dy": dy, "fontStyle": "italic", "color": theme.FAINT},
            "encoding": {"x": {**_TIME, "field": at}, "y": y, "text": {"field": text}}}
