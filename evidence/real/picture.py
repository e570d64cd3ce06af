"""The pictures of what is measured, with 95 % bands, beside what is published or known otherwise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.pictures import theme
from slipstick.pictures.rendering import render

_COLOURS = (theme.AFTER, theme.BEFORE, theme.ALARM, theme.FAINT, theme.MEASURED, *theme.SHADES[1:4])


@dataclass(frozen=True, eq=False)
class Band:
    """Values (m,) over x (m,) by the name of the legend, with standard errors (m,) where these are known."""

    name: str
    x: np.ndarray
    value: np.ndarray
    std: np.ndarray | None = None


def draw_bands(title: str, subtitle: str, x_title: str, y_title: str, measured: Sequence[Band],
               published: Sequence[Band] = ()) -> bytes:
    """Return measured bands as lines, published ones dashed, as SVG; those of the same name have the same colour."""
    names = dict.fromkeys(band.name for band in (*measured, *published))
    colours = dict(zip(names, _COLOURS, strict=False))
    values = [{"x": theme.rounded(float(x)), "y": theme.rounded(float(y)), "name": band.name, "drawn": drawn,
               "lower": theme.rounded(float(y - 1.96 * std)), "upper": theme.rounded(float(y + 1.96 * std))}
              for drawn, bands in (("measured", measured), ("published", published)) for band in bands
              for x, y, std in zip(band.x, band.value, np.zeros(len(band.x)) if band.std is None else band.std,
                                   strict=True)]
    x = {"field": "x", "type": "quantitative", "title": x_title, "scale": {"nice": False, "zero": False}}
    colour = {"field": "name", **theme.series_colour(colours)}

    def y(field: str) -> theme.Spec:
        return {"field": field, "type": "quantitative", "title": y_title, "scale": {"zero": False}}

    return render(theme.picture(title, subtitle, {
        "width": theme.WIDTH, "height": 260, "data": {"values": values}, "layer": [
            {"mark": {"type": "area", "opacity": 0.2},
             "encoding": {"x": x, "y": y("lower"), "y2": {"field": "upper"}, "color": colour}},
            {"mark": {"type": "line", "strokeWidth": 2}, "encoding": {
                "x": x, "y": y("y"), "color": colour, "strokeDash": {
                    "field": "drawn", "type": "nominal", "legend": None,
                    "scale": {"domain": ["measured", "published"], "range": [[1, 0], [5, 4]]}}}}]}), "svg")
