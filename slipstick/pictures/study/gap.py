"""The gap on held-out conditions: shifting-time errors of all engagements, and the closed share of each signal."""

from collections.abc import Mapping

from slipstick.pictures import theme, units
from slipstick.pictures.conditions import described
from slipstick.pictures.study.words import effect_title, model_series, numbers, within
from slipstick.pictures.theme import Spec, in_words
from slipstick.studies.figures import Figures
from slipstick.studies.result import Closure, Gap, StudyResult
from slipstick.studies.settings import StudySettings

_TOP = ("{0}easured minus predicted shifting time of every engagement. Each prediction comes from fits without the "
        "engagements of that motor speed or of that current profile. Shade: two standard deviations of what noise and "
        "scatter alone would leave.")
_BOTTOM = ("Bottom: the closed share of the gap with 90 % intervals. At 100 %, the remaining error is that of sensor "
           "noise and run-to-run scatter alone.")
_OMITTED = "Quantities without a significant gap are omitted."
_CUT = "Ends below −50 % or above 150 % are drawn there."
_CONTROL = ("The control is the best effect that acts on another quantity: a wrong effect, which must not close the "
            "gap.")

_HEIGHT = 210
_DEVIATIONS = 2.0  # half width of the shade
_LOWEST, _HIGHEST = -50.0, 150.0  # percent: values beyond are drawn at these values
_ROW = 30  # px
_MOST = 10  # motor speeds that can be labelled without overlap
_ORDER = "engagements, ordered by motor speed, current profile, load inertia and brake torque"
_COLUMNS = ("motor_speed", "current_profile", "load_inertia", "brake_torque")


def draw(result: StudyResult, figures: Figures, _: StudySettings) -> Spec | None:
    """Return errors by engagement and closed shares by signal; None if nothing was added to the simulation."""
    gap = result.gap
    if gap is None:
        return None
    time = gap.closures["shifting_time"]
    before, after = 1e3 * time.rms_before, 1e3 * time.rms_after
    verb = "falls" if after < before else "grows"
    return theme.picture(
        f"On held-out conditions, the shifting-time error {verb} from {units.fixed(before)} to {units.fixed(after)} ms",
        f"Root-mean-square error. Noise and scatter alone would cause {units.fixed(1e3 * time.rms_expected)} ms.",
        {"spacing": 26, "resolve": {"scale": {"color": "independent"}},
         "vconcat": [_differences(result, gap, figures), *(below := _closures(result, gap))]}, _caption(gap, below))


def _caption(gap: Gap, below: list[Spec]) -> str:
    """Return what the drawn parts are."""
    if not below:
        return _TOP.format("M")
    closures = [*gap.closures.values(), *(gap.control.closures.values() if gap.control else [])]
    ends = [100 * value for each in closures for value in (each.lower, each.upper) if value is not None]
    return " ".join([_TOP.format("Top: m"), _BOTTOM,
                     *([_OMITTED] if any(each.closure is None for each in gap.closures.values()) else []),
                     *([_CUT] if min(ends) < _LOWEST or max(ends) > _HIGHEST else []),
                     *([_CONTROL] if gap.control else [])])


def _differences(result: StudyResult, gap: Gap, figures: Figures) -> Spec:
    expected = _DEVIATIONS * 1e3 * gap.closures["shifting_time"].rms_expected
    models, number = model_series(result), numbers(result)
    columns = [figures.conditions[name] or [0.0] * len(figures.measured) for name in _COLUMNS]
    order = sorted(range(len(figures.measured)), key=lambda index: [column[index] for column in columns])
    speeds = [columns[0][index] for index in order]
    rows = [{"position": position, "engagement": number[index], "series": label,
             "conditions": described(figures.conditions, index), "difference": theme.rounded(
                1e3 * (figures.measured[index] - figures.predicted[key].mean[index]), 4)}
            for key, (label, _) in models.items() for position, index in enumerate(order)]
    starts = [position for position, speed in enumerate(speeds) if position == 0 or speed != speeds[position - 1]]
    starts = starts if len(starts) <= _MOST else []
    x: Spec = {"field": "position", "type": "quantitative", "title": _ORDER,
               "scale": {"nice": False, "padding": 8}, "axis": {"labels": False, "ticks": False, "grid": False}}
    y: Spec = {"field": "difference", "type": "quantitative", "title": "measured − predicted [ms]"}
    return {"width": theme.WIDTH, "height": _HEIGHT, "layer": [
        theme.band(-expected, expected, y),
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        {"data": {"values": [{"position": start - 0.5} for start in starts[1:]]}, "encoding": {"x": x},
         "mark": {"type": "rule", "color": theme.EDGE}},
        {"data": {"values": [{"position": start, "label": f"{speeds[start]:.0f} rad/s"} for start in starts]},
         "mark": {"type": "text", "align": "left", "color": theme.FAINT, "dx": 2},
         "encoding": {"x": x, "y": {"value": -8}, "text": {"field": "label"}}},
        {"data": {"values": rows}, "mark": {"type": "point", "filled": True, "size": 22, "opacity": 0.85},
         "encoding": {"x": x, "y": y, "color": {**theme.series_colour(dict(models.values())), "field": "series",
                                                     "legend": {"offset": 24}},
                      "tooltip": [{"field": "engagement", "type": "quantitative"},
                                  {"field": "conditions", "type": "nominal"},
                                  {"field": "difference", "type": "quantitative"}]}}]}


def _closures(result: StudyResult, gap: Gap) -> list[Spec]:
    """Return one row per channel with a significant gap; empty without one."""
    series: dict[str, tuple[Mapping[str, Closure], str]] = {
        model_series(result)["after"][0]: (gap.closures, theme.AFTER)}
    if gap.control is not None:
        series[f"control: {within(effect_title(gap.control.effect))}"] = (gap.control.closures, theme.FAINT)
    rows = [{"channel": in_words(channel), "series": label, **_percent(closure)}
            for label, (closures, _) in series.items() for channel, closure in closures.items()
            if closure.closure is not None]
    if not rows:
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


def _percent(closure: Closure) -> Spec:
    values = {"closure": closure.closure, "lower": closure.lower, "upper": closure.upper}
    percent = {name: 100 * (0.0 if value is None else value) for name, value in values.items()}
    if percent["closure"] < _LOWEST:
        return {**dict.fromkeys(values, _LOWEST), "beyond": "larger error than without it"}
    ends = {name: theme.rounded(min(max(_LOWEST, value), _HIGHEST), 4) for name, value in percent.items()}
    return {**ends, "beyond": ""}
