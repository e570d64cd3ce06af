"""A signal of one run: measured, and simulated without and with what was found, over each other, and what is left."""

from collections.abc import Sequence
from dataclasses import dataclass

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

_SIGNAL, _DIFFERENCE = 230, 90  # px
_MEASURED = "measured"
_CAPTION = ("{0}. Wide: measured. Thin: simulated with the parameters that each fit estimates for {1}, so that "
            "no parameter removes what is left. Below: measured minus simulated. Shade: two standard deviations of the "
            "noise of a sample.{2}")


@dataclass(frozen=True)
class Overlay:
    """Curves of one signal over `time` in s: what was `measured`, and label -> values and colour of each model.

    `axis` is the title of the signal with its unit, `noise` the standard deviation of its noise, `lock` a time that is
    marked, `run` what is shown, and `what` the run in one word.
    """

    time: Sequence[float]
    measured: Sequence[float]
    models: dict[str, tuple[Sequence[float], str]]
    axis: str
    noise: float
    run: str
    what: str
    lock: float | None = None


def draw_overlay(title: str, subtitle: str, shown: Overlay) -> Spec:
    """Return the signal and, below, the differences to each model."""
    x: Spec = {"field": "t", "type": "quantitative", "title": None, "axis": {"grid": False, "labels": False,
                                                                          "ticks": False}, "scale": {"nice": False}}
    below: Spec = {**x, "title": "time [s]", "axis": {"grid": False}}
    y: Spec = {"field": "y", "type": "quantitative", "title": shown.axis, "scale": {"zero": False}}
    left: Spec = {**y, "title": "measured − simulated", "axis": {"tickCount": 4}}
    colours = {_MEASURED: theme.MEASURED, **{label: hue for label, (_, hue) in shown.models.items()}}
    colour = {**theme.series_colour(colours), "legend": {"symbolType": "stroke", "symbolOpacity": 1}}
    curves = {_MEASURED: shown.measured, **{label: values for label, (values, _) in shown.models.items()}}
    marks = {label: {"strokeWidth": 6, "opacity": 0.35} if label == _MEASURED else {"strokeWidth": 1.7}
             for label in curves}
    over = [_line(shown.time, values, marks[label], {"x": x, "y": y, "color": {**colour, "datum": label}})
            for label, values in curves.items()]
    rest = [_line(shown.time, [here - there for here, there in zip(shown.measured, values, strict=True)], marks[label],
                  {"x": below, "y": left, "color": {**colour, "datum": label}})
            for label, values in curves.items() if label != _MEASURED]
    shade = theme.band(-2 * shown.noise, 2 * shown.noise, left)

    def mark_lock(axis: Spec) -> list[Spec]:
        return [] if shown.lock is None else [
            {"data": {"values": [{"t": shown.lock}]}, "encoding": {"x": axis},
             "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT}}]

    return theme.picture(title, subtitle, {"spacing": 14, "vconcat": [
        {"width": theme.WIDTH, "height": _SIGNAL, "layer": [*mark_lock(x), *over]},
        {"width": theme.WIDTH, "height": _DIFFERENCE, "layer": [shade, *mark_lock(below), *rest]}]}, _CAPTION.format(
            shown.run, f"this {shown.what}", " Dashed: measured shifting time." * (shown.lock is not None)))


def _line(time: Sequence[float], values: Sequence[float], mark: Spec, encoding: Spec) -> Spec:
    return {"data": {"values": [{"t": theme.rounded(t, 4), "y": theme.rounded(value, 4)}
                                for t, value in zip(time, values, strict=True)]},
            "mark": {"type": "line", **mark}, "encoding": encoding}
