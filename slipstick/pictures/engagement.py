"""One engagement with its phases fill, slip and stick, and its shifting time (Fig. 4 of the paper)."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.conditions import described
from slipstick.pictures.theme import Spec

CAPTION = ("One engagement. Fill: oil fills the chamber until the plates touch. Slip: the plates slip while the "
           "transmitted torque accelerates the load. Stick: from the shifting time on, the plates stick and the "
           "curves of both shaft speeds coincide, because the input speed is divided by the gear ratio. Below the "
           "curves of a measured signal: measured minus simulated, for the output speed as a dashed line.")

COLOURS = {"measured": theme.MEASURED, "nominal": theme.BEFORE, "calibrated": theme.AFTER, "simulated": theme.AFTER}
_PANELS = (("current", "current [A]", 45), ("pressure", "oil pressure [bar]", 85),
           ("piston_position", "piston [mm]", 55), ("speed", "shaft speed [rad/s]", 160),
           ("output_torque", "output torque [N m]", 120))
_SPEEDS = {"input_speed": ("input ÷ gear ratio", "left"), "output_speed": ("output", "right")}
"""Speed signal -> label and its alignment. Each label extends to the side on which its curve descends."""
_SAMPLES = 300  # drawn per curve at most
_DIFFERENCE_HEIGHT = 60
_AFTER_LOCK = 0.35  # s drawn after lock-up
VACUUM = -1.0
"""Lowest pressure in bar, gauge, that is drawn: no oil has a lower one."""
_TIME: Spec = {"field": "t", "type": "quantitative"}

Signals = Mapping[str, Sequence[float | None]]
"""Signal name -> samples."""


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return the engagement in the figure data, measured (if signals exist) and simulated at the fitted means."""
    figure_data = output["figure_data"]
    data, prediction = figure_data["engagement"], figure_data["prediction"]
    if data is None:
        return None
    condition, lock = data["condition"], data["lock"]
    measured = prediction["measured"][prediction["condition"].index(condition)]
    simulated = "never" if lock is None else f"at {theme.milliseconds(lock)}"
    lines = {"measured": data["measured"], "simulated": {"current": data["current"], **data["simulated"]}}
    return theme.picture(
        f"Experiment {condition} locks at {theme.milliseconds(measured)} on the test bench, {simulated} in the fitted "
        "model",
        f"Conditions: {described(figure_data['conditions'], condition)}. Shaded: phases of the simulation at the "
        "fitted means. Dashed: shifting times.",
        panels(data["time"], {series: signals for series, signals in lines.items() if signals},
               {"measured": measured, "simulated": lock}, data["touch"], data["gear_ratio"], with_differences=True))


def panels(time: Sequence[float], lines: Mapping[str, Signals], locks: Mapping[str, float | None],
           touch: float | None, gear_ratio: float, *, with_differences: bool = False) -> Spec:
    """Return one panel for each signal in `lines` (series -> signals) over `time` in s.

    `locks` are the shifting times of the series and `touch` is the time at which the plates touch, in s; None if never.
    The shaded phases are those of the last series. `with_differences` adds a panel with what was `measured` minus the
    `simulated` under each one that has both.
    """
    shifting_times = {series: lock for series, lock in locks.items() if lock is not None}
    end = min(time[-1], max(shifting_times.values(), default=time[-1]) + _AFTER_LOCK)
    names = {signal for signals in lines.values() for signal in signals}
    names |= {"speed"} if names & set(_SPEEDS) else set()
    selected = [panel for panel in _PANELS if panel[0] in names]
    of: dict[str, Spec] = {}
    for name, title, height in selected:
        of[name] = {"width": theme.WIDTH, "height": height, "layer": _layers(name, title, height, lines)}
        if with_differences and (both := _select_compared(name, lines)):
            of[f"{name} difference"] = {"width": theme.WIDTH, "height": _DIFFERENCE_HEIGHT,
                                        "layer": _differences(both, title, lines)}
    views, samples = list(of.values()), _samples(time, lines, gear_ratio, end)
    views[0]["layer"].append(_note({"name": "phases"}, "from", {"value": -7}, "phase"))
    if "pressure" in of:
        of["pressure"]["layer"] += _vacuum(lines.values())
    noted = of.get("speed", views[-1])
    noted["layer"].append(_note({"name": "locks"}, "t", {"value": noted["height"] - 10}, "note"))
    if "speed" in of:
        of["speed"]["layer"] += _shafts(list(lines), names, samples)
    for view in views:
        axis: Spec = {"grid": False, "title": None, "labels": False, "ticks": False}
        if view is views[-1]:
            axis = {"grid": False, "title": "time since the shift command [s]", "format": ".1f"}
        scale = {"domain": [0, theme.rounded(end)], "nice": False}
        view["encoding"] = {"x": {**_TIME, "scale": scale, "axis": {**axis, "tickCount": 12}}}
    return {"spacing": 10, "vconcat": views, "datasets": {
        "signals": samples, "phases": _phases(touch, locks[list(lines)[-1]], end),
        "locks": [{"series": series, "t": theme.rounded(lock),
                   "note": "shifting time" if lock == max(shifting_times.values()) else ""}
                  for series, lock in shifting_times.items()]}}


def _vacuum(lines: Iterable[Signals]) -> list[Spec]:
    """Return a note if a pressure is below vacuum, where it is not drawn."""
    lowest = min((value for signals in lines for value in signals.get("pressure", ()) if value is not None),
                 default=0.0)
    if lowest >= VACUUM:
        return []
    note = (f"below vacuum, down to {lowest:.2f} bar, not drawn: the linear valve of the model has no lower limit, and "
            "a sensor may be off").replace("-", "−")
    return [{"data": {"values": [{}]}, "encoding": {"x": {"value": theme.WIDTH - 4}, "y": {"datum": VACUUM}},
             "mark": {"type": "text", "text": note, "align": "right", "baseline": "bottom", "dy": -2, "fontSize": 10,
                      "color": theme.FAINT}}]


def _samples(time: Sequence[float], lines: Mapping[str, Signals], gear_ratio: float, end: float) -> list[Spec]:
    inside = [sample for sample, t in enumerate(time) if t <= end]
    scale = {"input_speed": 1 / gear_ratio, "piston_position": 1e3}  # m -> mm
    rows = []
    for sample in inside[::math.ceil(len(inside) / _SAMPLES)]:
        row: Spec = {"t": theme.rounded(time[sample])}
        for series, signals in lines.items():
            for name, values in signals.items():
                value = values[sample]
                if name == "pressure" and value is not None and value < VACUUM:
                    value = None
                row[f"{series} {name}"] = theme.rounded(None if value is None else value * scale.get(name, 1.0), 4)
        for name in dict.fromkeys(name for signals in lines.values() for name in signals):
            measured, simulated = (row.get(f"{series} {name}") for series in ("measured", "simulated"))
            if measured is not None and simulated is not None:
                row[f"difference {name}"] = theme.rounded(measured - simulated, 4)
        rows.append(row)
    return rows


def _phases(touch: float | None, lock: float | None, end: float) -> list[Spec]:
    bounds = [0.0, end if touch is None else touch, end if lock is None else lock, end]
    return [{"phase": phase, "colour": colour, "from": theme.rounded(begin), "to": theme.rounded(stop)}
            for (phase, colour), begin, stop in zip(theme.PHASES.items(), bounds[:-1], bounds[1:], strict=True)
            if stop > begin]


def _layers(name: str, title: str, height: int, lines: Mapping[str, Signals]) -> list[Spec]:
    colour = {**theme.series_colour({series: COLOURS[series] for series in lines}), "legend": {"symbolType": "stroke"}}
    y = {"type": "quantitative", "title": title, "axis": {"tickCount": max(2, height // 30)}, "scale": {"padding": 5}}
    below, above = {"strokeWidth": 3, "opacity": 0.6}, {"strokeWidth": 1.8}
    curves = [{"data": {"name": "signals"}, "mark": {"type": "line", **(below if series == "measured" else above)},
               "encoding": {"x": _TIME, "y": {**y, "field": f"{series} {signal}"},
                                                                     "color": {**colour, "datum": series}}}
              for series, signals in lines.items() for signal in (_SPEEDS if name == "speed" else (name,))
              if signal in signals]
    return [*_background(colour), *curves]


def _background(colour: Spec) -> list[Spec]:
    return [
        {"data": {"name": "phases"}, "mark": "rect", "encoding": {
            "x": {**_TIME, "field": "from"}, "x2": {"field": "to"},
            "color": {"field": "colour", "type": "nominal", "scale": None}}},
        {"data": {"name": "locks"}, "mark": {"type": "rule", "strokeDash": [4, 3], "strokeWidth": 1.2},
         "encoding": {"x": _TIME, "color": {**colour, "field": "series"}}}]


def _select_compared(panel: str, lines: Mapping[str, Signals]) -> list[str]:
    """Return the signals of a panel that are both measured and simulated."""
    return [signal for signal in (_SPEEDS if panel == "speed" else (panel,))
            if all(signal in lines.get(series, ()) for series in ("measured", "simulated"))]


def _differences(signals: Sequence[str], title: str, lines: Mapping[str, Signals]) -> list[Spec]:
    """Return the differences of the `signals` of a panel with this title, which has the unit; the second one dashed."""
    colour = {**theme.series_colour({series: COLOURS[series] for series in lines}), "legend": {"symbolType": "stroke"}}
    y = {"type": "quantitative", "title": ["measured −", f"simulated {title[title.index('['):]}"],
         "axis": {"tickCount": 3, "titleFontSize": 10}, "scale": {"padding": 3}}
    zero = {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.AXIS}, "encoding": {
        "x": {"value": 0}, "x2": {"value": theme.WIDTH}, "y": {"datum": 0}}}
    return [*_background(colour), zero, *(
        {"data": {"name": "signals"}, "encoding": {"x": _TIME, "y": {**y, "field": f"difference {signal}"}},
         "mark": {"type": "line", "strokeWidth": 1.4, "color": theme.INK,
                  **({"strokeDash": [5, 2]} if number else {})}} for number, signal in enumerate(signals))]


def _shafts(series: list[str], signals: Collection[str], samples: list[Spec]) -> list[Spec]:
    """Return the labels of the shaft speeds among `signals`, placed above their curves before lock-up."""
    sample = samples[len(samples) * 3 // 8]
    return [_note({"values": [{"t": sample["t"], "y": max(sample.get(f"{name} {signal}") or 0.0 for name in series),
                               "shaft": label}]}, "t", {"field": "y", "type": "quantitative"}, "shaft", side, -12)
            for signal, (label, side) in _SPEEDS.items() if signal in signals]


def _note(data: Spec, x_field: str, y: Spec, text: str, align: str = "left", dy: int = 0) -> Spec:
    return {"data": data,
            "mark": {"type": "text", "align": align, "dx": 4, "dy": dy, "fontStyle": "italic", "color": theme.FAINT},
            "encoding": {"x": {**_TIME, "field": x_field}, "y": y, "text": {"field": text}}}
