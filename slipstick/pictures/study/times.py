"""Shifting times over the conditions, beyond what the parameters of the bench explain."""

import scipy

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec, in_words
from slipstick.pictures.units import fixed, raised
from slipstick.studies.figures import Figures
from slipstick.studies.result import StudyResult, TimesOver
from slipstick.studies.settings import StudySettings

_CAPTION = ("Measured minus predicted shifting time over each condition, with mean 0 over the engagements. The "
           "parameters of the simulation are fitted to the shifting times: what they explain is not in it. Bars: "
           "90 % intervals, wide where the parameters could explain a change as well.")

_COLUMNS = 3
_WIDTH, _HEIGHT = 196, 170  # px
_COLOURS = {True: ("more than noise", theme.ALARM), False: ("no more than noise", theme.AFTER)}


def draw(result: StudyResult, _: Figures, settings: StudySettings) -> Spec | None:
    """Return a panel for each condition; None where signals were recorded."""
    if not result.times:
        return None
    colours = dict(_COLOURS[trend.shown] for trend in result.times)
    shown = [in_words(trend.condition) for trend in result.times if trend.shown]
    worst = max(result.times, key=lambda trend: trend.distance)
    place = worst.furthest
    return theme.picture(
        f"Beyond the parameters, shifting times change with the {' and the '.join(shown)}" if shown else
        "Beyond the parameters, no condition changes the shifting times by more than noise",
        f"Furthest from zero: {fixed(worst.change[place])} ± {fixed(worst.error[place])} ms (standard error), over the "
        f"{in_words(worst.condition)}.".replace("-", "−"),
        {"columns": _COLUMNS, "spacing": {"row": 26, "column": 30},
         "concat": [_panel(trend, settings.level, column, colours) for column, trend in enumerate(result.times)]},
        _CAPTION)


def _panel(trend: TimesOver, level: float, place: int, colours: dict[str, str]) -> Spec:
    half, series = float(scipy.special.ndtri((1 + level) / 2)), _COLOURS[trend.shown][0]
    rows = [{"level": float(f"{at:.4g}"), "change": theme.rounded(change, 4), "series": series,
             "low": theme.rounded(change - half * error, 4), "high": theme.rounded(change + half * error, 4)}
            for at, change, error in zip(trend.levels, trend.change, trend.error, strict=True)]
    unit = "" if trend.unit == "1" else f" [{raised(trend.unit)}]"
    x: Spec = {"field": "level", "type": "ordinal", "title": f"{in_words(trend.condition)}{unit}",
               "axis": {"labelAngle": 0, "grid": False}}
    y: Spec = {"type": "quantitative", "axis": {"tickCount": 5},
               "title": "measured − predicted [ms]" if place % _COLUMNS == 0 else None}
    colour = {**theme.series_colour(colours), "field": "series"}
    return {"width": _WIDTH, "height": _HEIGHT, "data": {"values": rows}, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        {"mark": {"type": "rule", "strokeWidth": 2.5},
         "encoding": {"x": x, "y": {**y, "field": "low"}, "y2": {"field": "high"}, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 50, "opacity": 1},
         "encoding": {"x": x, "y": {**y, "field": "change"}, "color": colour,
                      "tooltip": [{"field": "change", "type": "quantitative", "title": "measured − predicted [ms]"}]}}]}
