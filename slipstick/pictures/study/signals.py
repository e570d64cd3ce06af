"""Measured and simulated signals of the experiments that the model without the effect describes worst."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import model_series
from slipstick.pictures.theme import Spec, in_words

CAPTION = ("The worst experiments, each with a different current profile. All signals are averages over 16 ms. Each "
           "simulation has the scatter estimated for its run, so the remaining differences cannot be removed by "
           "parameters. The input speed is divided by the gear ratio: the clutch locks where it meets the output "
           "speed. Dashed: measured shifting time.")

_PANELS = (("pressure", "pressure [bar]", 70), ("speed", "shaft speed [rad/s]", 130),
           ("output_torque", "output torque [N m]", 140))
_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}
_AFTER_LOCK = 0.15  # s drawn after lock-up
_COLUMN_SPACING, _ROW_SPACING, _LABEL = 54, 12, 34  # px between panels, and above the first row
_WIDE, _LIGHT = 5.0, "#aab4bc"  # width and colour of the measured line, visible behind a simulated one


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return a grid of panels with one column per experiment and one row per signal; None without signals."""
    experiments, models = figure_data["signals"], model_series(result, figure_data)
    if not experiments:
        return None
    width = (theme.WIDTH - _COLUMN_SPACING * (len(experiments) - 1)) // len(experiments)
    rows: list[Spec] = [{"spacing": _COLUMN_SPACING, "bounds": "flush", "hconcat": [
        _panel(experiment, models, panel, width, first=experiment is experiments[0]) for experiment in experiments]}
            for panel in _PANELS]
    for column, experiment in enumerate(experiments):
        rows[0]["hconcat"][column]["layer"].append({
            "data": {"values": [{}]}, "encoding": {"x": {"value": 0}, "y": {"value": -_LABEL}},
            "mark": {"type": "text", "align": "left", "baseline": "top", "color": theme.FAINT, "lineHeight": 14,
                     "text": _conditions(figure_data["conditions"], experiment["condition"])}})
    return theme.picture(_title(result, experiments, list(models)),
                         "Measured signals, and simulations with the fitted models.",
                         {"spacing": _ROW_SPACING, "vconcat": rows})


def _title(result: Mapping[str, Any], experiments: Sequence[Mapping[str, Any]], models: list[str]) -> str:
    def rms_error(model: str, signal: str) -> float:
        squares = [(experiment[model][signal][index] - value) ** 2 for experiment in experiments
                   for index, value in enumerate(experiment["measured"][signal])]
        return math.sqrt(sum(squares) / len(squares))

    worst = max(_UNITS, key=lambda signal: rms_error("before", signal) / result["noise"][signal])
    before, *after = (f"{rms_error(model, worst):.2g} {_UNITS[worst]}" for model in models)
    added = "with the effect" if len(result["answer"]["effects"]) == 1 else "with the added effects"
    return f"RMS error of the {in_words(worst)} in the worst experiments: {before}" + "".join(
        f", {error} {added}" for error in after) + f" (noise: {result['noise'][worst]:.2g})"


def _panel(experiment: Mapping[str, Any], models: Mapping[str, tuple[str, str]], panel: tuple[str, str, int],
           width: float, first: bool) -> Spec:
    signal, title, height = panel
    last = panel is _PANELS[-1]
    colour = {**theme.series_colour({"measured": _LIGHT, **dict(models.values())}), "legend": {"symbolType": "stroke"}}
    end = min(experiment["time"][-1], experiment["lock"] + _AFTER_LOCK)
    x: Spec = {"field": "t", "type": "quantitative", "title": "time [s]" if last else None,
               "scale": {"domain": [0, theme.rounded(end)], "nice": False},
               "axis": {"grid": False, "labels": last, "ticks": last, "tickCount": 5}}
    y: Spec = {"field": "y", "type": "quantitative", "title": title if first else None,
               "axis": {"tickCount": 4, "format": "~f"}}
    layers: list[Spec] = [{"data": {"values": [{"t": experiment["lock"]}]}, "encoding": {"x": x},
                           "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT}}]
    for key, label, stroke in [("measured", "measured", _WIDE),
                               *((key, label, 1.6) for key, (label, _) in models.items())]:
        for values in _curves(experiment, key, signal):
            rows = [{"t": t, "y": theme.rounded(value, 4)} for t, value in zip(experiment["time"], values, strict=True)
                    if t <= end]
            layers.append({"data": {"values": rows}, "mark": {"type": "line", "strokeWidth": stroke},
                           "encoding": {"x": x, "y": y, "color": {**colour, "datum": label}}})
    return {"width": width, "height": height, "layer": layers}


def _curves(experiment: Mapping[str, Any], key: str, signal: str) -> list[Sequence[float]]:
    signals = experiment[key]
    if signal != "speed":
        return [signals[signal]]
    return [[value / experiment["gear_ratio"] for value in signals["input_speed"]], signals["output_speed"]]


def _conditions(conditions: Mapping[str, Any], index: int) -> list[str]:
    profile, speed, inertia, brake = (conditions[name][index] for name in (
        "current_profile", "motor_speed", "load_inertia", "brake_torque"))
    return [f"{index}: profile {profile}, motor {speed:.0f} rad/s", f"{inertia:.3g} kg m², brake {brake:.3g} N m"]
