"""Measured minus predicted signals of the engagements that the model without the findings describes worst."""

import math
import textwrap
from collections.abc import Iterable, Iterator

from slipstick.pictures import theme
from slipstick.pictures.conditions import described
from slipstick.pictures.study.words import model_series, numbers
from slipstick.pictures.theme import Spec, in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.studies.figures import Engagement, Figures
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings

_CAPTION = ("The engagements that are described worst, each with a different current profile. {0}easured minus "
            "predicted signals, averaged over 8 samples. Shade: two standard deviations of the noise of a sample. Each "
            "simulation has the parameters that its fit estimates for that engagement, so that no parameter removes "
            "what is left. Dashed: measured shifting time, where the torque jumps: what is cut there is the error of "
            "the shifting time.")
_SHAFTS = ("Top: the measured shaft speeds{0}. Below: m")
_BOTH = "; the input speed is divided by the gear ratio, so that the clutch locks where both meet"

TITLES = {"pressure": "pressure [bar]", "input_speed": "input speed [rad/s]",
           "output_speed": "output speed [rad/s]", "output_torque": "output torque [N m]"}
"""Signal -> title of its axis."""
_SPEEDS, _DIFFERENCE = 90, 92  # px
AFTER_LOCK = 0.15
"""Time in s that is drawn after lock-up."""
_COLUMN_SPACING, _ROW_SPACING, _LABEL = 44, 14, 34  # px between panels, and above the first row
_CHARACTERS = 34  # per line above a column
_OUTSIDE = 0.03
"""Time in s about lock-up whose differences hardly set the range of a panel: the torque jumps."""
_CUT = 2.0
"""Multiple of the other differences up to which those about lock-up are drawn."""


def draw(result: StudyResult, figures: Figures, _: StudySettings) -> Spec | None:
    """Return a grid of panels with one column per engagement and one row per measured signal; None without engagements.
    """
    engagements, models = figures.engagements, model_series(result)
    if not engagements:
        return None
    width = (theme.WIDTH - _COLUMN_SPACING * (len(engagements) - 1)) // len(engagements)
    columns = []
    for engagement in engagements:
        is_first = engagement is engagements[0]
        speeds = _speeds(engagement, width, is_first)
        columns.append([speeds, *(_differences(result, engagement, models, signal, width, is_first)
                                  for signal in engagement.measured)])
        about = f"{numbers(result)[engagement.condition]}: {described(figures.conditions, engagement.condition)}"
        speeds["layer"].append({
            "data": {"values": [{}]}, "encoding": {"x": {"value": 0}, "y": {"value": -_LABEL}},
            "mark": {"type": "text", "align": "left", "baseline": "top", "color": theme.FAINT, "lineHeight": 14,
                     "text": textwrap.wrap(about, _CHARACTERS)}})
    rows = [{"spacing": _COLUMN_SPACING, "bounds": "flush", "hconcat": list(row)}
            for row in zip(*columns, strict=True)]
    return theme.picture(_title(result, engagements, list(models)),
                         "Root mean square. Below the shaft speeds: measured minus predicted. Shade: noise.",
                         {"spacing": _ROW_SPACING, "vconcat": rows}, _caption(engagements[0]))


def _caption(engagement: Engagement) -> str:
    speeds = {"input_speed", "output_speed"} & set(engagement.measured)
    return _CAPTION.format(_SHAFTS.format(_BOTH * (len(speeds) == 2)) if speeds else "M")


def _title(result: StudyResult, engagements: list[Engagement], models: list[str]) -> str:
    worst = max(engagements[0].measured,
                key=lambda signal: rms_error(engagements, "before", signal) / result.noise[signal])
    many = f"{len(engagements)} worst engagements" if len(engagements) > 1 else "worst engagement"
    return f"In the {many}, {describe_errors(engagements, models, worst)}"


def describe_errors(engagements: list[Engagement], models: Iterable[str], signal: str) -> str:
    """Return by how much a signal of these engagements is off (root mean square) in each of the models."""
    before, *after = (f"{rms_error(engagements, model, signal):.2g} {SIGNAL_UNITS[signal]}" for model in models)
    return f"the {in_words(signal)} is off by {before}" + "".join(
        f", and by {error} with what was found" for error in after)


def rms_error(engagements: list[Engagement], model: str, signal: str) -> float:
    """Return the root mean square of measured minus simulated."""
    squares = [value**2 for engagement in engagements for _, value in _difference(engagement, model, signal)]
    return math.sqrt(sum(squares) / len(squares))


def _x(engagement: Engagement, labels: bool) -> Spec:
    end = min(engagement.time[-1], engagement.lock + AFTER_LOCK)
    return {"field": "t", "type": "quantitative", "title": "time [s]" if labels else None,
            "scale": {"domain": [0, theme.rounded(end)], "nice": False},
            "axis": {"grid": False, "labels": labels, "ticks": labels, "tickCount": 5}}


def _lock(engagement: Engagement, x: Spec) -> Spec:
    return {"data": {"values": [{"t": engagement.lock}]}, "encoding": {"x": x},
            "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT}}


def _speeds(engagement: Engagement, width: float, first: bool) -> Spec:
    x = _x(engagement, False)
    y: Spec = {"field": "y", "type": "quantitative", "title": "speeds [rad/s]" if first else None,
               "axis": {"tickCount": 4, "format": "~f"}}
    over = {"input_speed": engagement.gear_ratio, "output_speed": 1.0}
    curves = [[value / over[name] for value in engagement.measured[name]] for name in over
              if name in engagement.measured]
    end = x["scale"]["domain"][1]
    return {"width": width, "height": _SPEEDS, "layer": [_lock(engagement, x), *(
        {"data": {"values": [{"t": t, "y": theme.rounded(value, 4)} for t, value in
                             zip(engagement.time, curve, strict=True) if t <= end]},
         "mark": {"type": "line", "strokeWidth": 1.6, "color": theme.MEASURED}, "encoding": {"x": x, "y": y}}
        for curve in curves)]}


def _differences(result: StudyResult, engagement: Engagement, models: dict[str, tuple[str, str]], signal: str,
                 width: float, first: bool) -> Spec:
    """Return the differences of a signal to each model; what exceeds the range at lock-up is cut."""
    x, noise = _x(engagement, signal == list(engagement.measured)[-1]), 2 * result.noise[signal]
    end = x["scale"]["domain"][1]
    curves = {label: [(t, value) for t, value in _difference(engagement, key, signal) if t <= end]
              for key, (label, _) in models.items()}
    sizes = [(abs(value), abs(t - engagement.lock)) for curve in curves.values() for t, value in curve]
    away = max([1.5 * noise, *(size for size, distance in sizes if distance > _OUTSIDE)])
    largest = 1.1 * min(max([away, *(size for size, _ in sizes)]), _CUT * away)
    y: Spec = {"field": "y", "type": "quantitative", "title": TITLES[signal] if first else None,
               "scale": {"domain": [theme.rounded(-largest), theme.rounded(largest)], "nice": False},
               "axis": {"tickCount": 4, "format": "~f"}}
    colour = {**theme.series_colour(dict(models.values())), "legend": {"symbolType": "stroke"}}
    layers: list[Spec] = [
        theme.band(-noise, noise, y),
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        _lock(engagement, x)]
    layers += [{"data": {"values": [{"t": t, "y": theme.rounded(value, 4)} for t, value in curve]},
                "mark": {"type": "line", "strokeWidth": 1.6, "clip": True},
                "encoding": {"x": x, "y": y, "color": {**colour, "datum": label}}} for label, curve in curves.items()]
    return {"width": width, "height": _DIFFERENCE, "layer": layers}


def _difference(engagement: Engagement, model: str, signal: str) -> Iterator[tuple[float, float]]:
    """Yield times, and the measured minus the simulated signal."""
    for t, measured, simulated in zip(engagement.time, engagement.measured[signal], engagement.models[model][signal],
                                      strict=True):
        yield t, measured - simulated
