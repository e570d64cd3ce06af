"""Residuals in the block of an added effect, over the quantity on which the effect depends."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import BLOCKS, model_series
from slipstick.pictures.theme import Spec

CAPTION = ("Measured minus predicted values in the block where the effect acts, and in the phase where it contributes "
           "most, over the quantity on which its contribution depends most. Lines: median. Shades: from the 10 % to "
           "the 90 % quantile. Grey: the same range for noise alone. A trend that remains without the effect could not "
           "be removed by refitting all parameters.")

_FEWEST = 3  # bins of a curve
_HEIGHT = 250
_PHASES = {"fill": "while the chamber fills", "film": "while oil is squeezed out between the plates",
           "slip": "while the plates slip", "stick": "while the plates stick"}
_QUANTILE = 1.28  # noise levels: 90 % quantile of noise alone


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return one panel per block; None without an added effect, without signals, or with too few bins."""
    blocks = [block for block in figure_data["residual"]
              if min(len(bins["at"]) for bins in block["models"].values()) >= _FEWEST]
    if not blocks:
        return None
    first = blocks[0]
    trend = {key: max(bins["median"]) - min(bins["median"]) for key, bins in first["models"].items()}
    title = (f"Over {first['driver'].split(' [')[0]}, the median residual varies by {trend['before']:.2g} noise "
             f"levels, and by {trend['after']:.2g} with the effect")
    subtitle = "; ".join(f"block “{BLOCKS[block['block']]}”, {_PHASES[block['phase']]}" for block in blocks)
    return theme.picture(title, f"{subtitle[0].upper()}{subtitle[1:]}.", {
        "spacing": 24, "vconcat": [_panel(block, result, figure_data) for block in blocks]})


def _panel(block: Mapping[str, Any], result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec:
    models = model_series(result, figure_data)
    colour = theme.series_colour(dict(models.values()))
    x: Spec = {"field": "at", "type": "quantitative", "title": block["driver"], "axis": {"grid": False},
               "scale": {"zero": False, "nice": False}}
    y: Spec = {"field": "median", "type": "quantitative", "title": "measured − predicted [noise levels]"}
    layers: list[Spec] = [{"data": {"values": [{"low": -_QUANTILE, "high": _QUANTILE}]},
                           "mark": {"type": "rect", "color": theme.PHASES["stick"]},
                           "encoding": {"y": {"field": "low", "type": "quantitative"}, "y2": {"field": "high"}}}]
    for key, (label, hue) in models.items():
        data = {"values": [{"at": at, "low": low, "median": median, "high": high}
                           for at, low, median, high in zip(*(block["models"][key][column] for column in (
                               "at", "low", "median", "high")), strict=True)]}
        layers += [{"data": data, "mark": {"type": "area", "opacity": 0.16, "color": hue},
                    "encoding": {"x": x, "y": {**y, "field": "low"}, "y2": {"field": "high"}}},
                   {"data": data, "mark": {"type": "line", "strokeWidth": 2.4, "point": {"size": 22}},
                    "encoding": {"x": x, "y": y, "color": {**colour, "datum": label}}}]
    return {"width": theme.WIDTH, "height": _HEIGHT, "layer": layers}
