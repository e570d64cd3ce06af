"""Draw the picture of the README, the course of a study of the shipped recordings: `python docs/picture.py`."""

from pathlib import Path

import slipstick
from slipstick.interface.picture import Picture
from slipstick.interface.study import Study
from slipstick.pictures import theme, units
from slipstick.pictures.study.law import draw_law
from slipstick.pictures.theme import Spec

_WIDTH, _HEIGHT = 250, 190
_LEGEND = 31  # px of the legend that the other panels have below their titles
_SHOWN = 1.4  # end of the time axis in shifting times
_SERIES = {"measured": theme.MEASURED, "model without the effect": theme.BEFORE, "with it": theme.AFTER}
_CAPTION = ("Left: output torque of one engagement. Middle: the measured law with its band, and the formula of the "
            "named effect. Right: error of shifting times that the fits have not seen.")


def draw(study: Study) -> Spec:
    """Return three panels: where model and recordings disagree, what is missing, and what adding it is worth."""
    return {"$schema": theme.SCHEMA, "background": "white", "padding": 12, "spacing": 34,
            "config": theme.picture("", "", {})["config"],
            "title": {"text": f"{study.answer}: the model of the bench without it and with it", "subtitle": []},
            "resolve": {"scale": {"color": "independent"}},
            "hconcat": [_signals(study), _law(study), _errors(study)]}


def _signals(study: Study) -> Spec:
    """The output torque of the engagement that the model without the effect describes worst."""
    worst = study.figures.engagements[0]
    curves = {"measured": worst.measured, "model without the effect": worst.models["before"],
              "with it": worst.models["after"]}
    rows = [{"time": theme.rounded(time), "torque": theme.rounded(value / 1e3), "series": name}
            for name, signals in curves.items()
            for time, value in zip(worst.time, signals["output_torque"], strict=True) if time < _SHOWN * worst.lock]
    encoding = {"x": {"field": "time", "type": "quantitative", "title": "time [s]", "axis": {"grid": False}},
                "y": {"field": "torque", "type": "quantitative", "title": "output torque [kN m]"},
                "color": {**theme.series_colour(_SERIES), "field": "series", "legend": {"symbolOpacity": 1}}}
    wide, narrow = ({"transform": [{"filter": f"datum.series {is_or_not} 'measured'"}], "encoding": encoding,
                     "mark": {"type": "line", **mark}}
                    for is_or_not, mark in (("==", {"strokeWidth": 5, "opacity": 0.35}), ("!=", {"strokeWidth": 1.5})))
    return _panel("1. Where they disagree", {"data": {"values": rows}, "layer": [wide, narrow]})


def _law(study: Study) -> Spec:
    """The measured law and the formula of the named effect."""
    finding = study.result.findings[0]
    assert finding.law is not None
    drawn = draw_law(finding, finding.law, study.settings.level)
    return _panel("2. What is missing", {name: drawn[name] for name in ("data", "layer")})


def _errors(study: Study) -> Spec:
    """Held-out errors of the shifting time: without the effect, with a wrong one, with it, and of a correct model."""
    gap = study.result.gap
    assert gap is not None
    assert gap.control is not None
    time, control = gap.closures["shifting_time"], gap.control.closures["shifting_time"]
    bars = {"without the effect": (time.rms_before, theme.BEFORE),
            "with a wrong effect": (control.rms_after, theme.FAINT), "with the effect": (time.rms_after, theme.AFTER),
            "noise and scatter alone": (time.rms_expected, theme.EDGE)}
    rows = [{"model": name, "error": theme.rounded(1e3 * value), "text": units.fixed(1e3 * value), "colour": colour}
            for name, (value, colour) in bars.items()]
    y: Spec = {"field": "model", "type": "nominal", "sort": None, "title": None, "axis": {"labelLimit": 160}}
    x: Spec = {"field": "error", "type": "quantitative", "title": "held-out error of the shifting time [ms]",
               "axis": {"grid": False}}
    return _panel("3. What adding it is worth", {"data": {"values": rows}, "encoding": {"y": y, "x": x}, "layer": [
        {"mark": {"type": "bar", "height": 20}, "encoding": {"color": {"field": "colour", "type": "nominal",
                                                                       "scale": None}}},
        {"mark": {"type": "text", "align": "left", "dx": 4, "color": theme.INK},
         "encoding": {"text": {"field": "text", "type": "nominal"}}}]}, _LEGEND)


def _panel(title: str, body: Spec, offset: int = 10) -> Spec:
    return {"title": {"text": title, "fontSize": 13, "offset": offset, "anchor": "start"}, "width": _WIDTH,
            "height": _HEIGHT, **body}


def study_of_sample() -> Study:
    """The study that the README shows."""
    return slipstick.study(slipstick.Bench.open("heavy"), slipstick.Recordings.open("sample"), name="sample")


if __name__ == "__main__":
    Picture("workflow", draw(study_of_sample()), _CAPTION).save(Path(__file__).with_name("workflow.svg"))
