"""What is left in the block of an added effect, against the quantity that it depends on."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import BLOCKS, models
from slipstick.pictures.theme import Spec

CAPTION = ("Of the block that the effect acts in, and the phase in which it shows most: measured less predicted, over "
           "the quantity that the effect's own share depends on most. Lines: the median; shades: from a tenth below "
           "to a tenth above; grey: what noise alone fills. What bends before is what a refit of all parameters could "
           "not do away with.")

_FEWEST = 3  # bins that make a curve
_HEIGHT = 250
_PHASES = {"fill": "while the chamber fills", "film": "while oil is squeezed from between the plates",
           "slip": "while the plates slip", "stick": "while the plates stick"}
_PART = 1.28  # noise levels: the tenth above of what is noise alone


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """One panel a block; None where no effect was added, and without signals, or with too few."""
    shown = [one for one in figure_data["residual"]
             if min(len(bins["at"]) for bins in one["models"].values()) >= _FEWEST]
    if not shown:
        return None
    first = shown[0]
    bend = {who: max(bins["median"]) - min(bins["median"]) for who, bins in first["models"].items()}
    title = (f"Over {first['driver'].split(' [')[0]}, what is left bends by {bend['before']:.2g} noise levels, "
             f"with the effect by {bend['after']:.2g}")
    said = "; ".join(f"block “{BLOCKS[one['block']]}”, {_PHASES[one['phase']]}" for one in shown)
    return theme.picture(title, f"{said[0].upper()}{said[1:]}.", {
        "spacing": 24, "vconcat": [_panel(one, result, figure_data) for one in shown]})


def _panel(one: Mapping[str, Any], result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec:
    who = models(result, figure_data)
    colour = theme.whose(dict(who.values()))
    x: Spec = {"field": "at", "type": "quantitative", "title": one["driver"], "axis": {"grid": False},
               "scale": {"zero": False, "nice": False}}
    y: Spec = {"field": "median", "type": "quantitative", "title": "measured − predicted [noise levels]"}
    layers: list[Spec] = [{"data": {"values": [{"low": -_PART, "high": _PART}]},
                           "mark": {"type": "rect", "color": theme.PHASES["stick"]},
                           "encoding": {"y": {"field": "low", "type": "quantitative"}, "y2": {"field": "high"}}}]
    for key, (name, hue) in who.items():
        data = {"values": [{"at": at, "low": low, "median": median, "high": high}
                           for at, low, median, high in zip(*(one["models"][key][name] for name in (
                               "at", "low", "median", "high")), strict=True)]}
        layers += [{"data": data, "mark": {"type": "area", "opacity": 0.16, "color": hue},
                    "encoding": {"x": x, "y": {**y, "field": "low"}, "y2": {"field": "high"}}},
                   {"data": data, "mark": {"type": "line", "strokeWidth": 2.4, "point": {"size": 22}},
                    "encoding": {"x": x, "y": y, "color": {**colour, "datum": name}}}]
    return {"width": theme.WIDTH, "height": _HEIGHT, "layer": layers}
