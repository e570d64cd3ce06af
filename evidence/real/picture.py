"""The pictures of what is measured, with 95 % bands, beside what is published or known otherwise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.pictures import theme
from slipstick.pictures.rendering import render

_COLOURS = (theme.AFTER, theme.BEFORE, theme.ALARM, theme.FAINT, theme.MEASURED, *theme.SHADES[1:4])
_SPACE = 40
"""Space in px between panels."""


@dataclass(frozen=True, eq=False)
class Band:
    """Values (m,) over x (m,) by the name of the legend, with standard errors (m,) where these are known."""

    name: str
    x: np.ndarray
    value: np.ndarray
    std: np.ndarray | None = None

    @classmethod
    def of_mean(cls, name: str, x: np.ndarray, values: np.ndarray) -> "Band":
        """Return the mean of independent curves (n, m) with its standard errors."""
        return cls(name, x, values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values)))


@dataclass(frozen=True, eq=False)
class Panel:
    """Bands over an axis with a title: `measured` ones are lines, `published` ones dashed."""

    x_title: str
    y_title: str
    measured: Sequence[Band]
    published: Sequence[Band] = ()


def draw_panels(title: str, subtitle: str, *panels: Panel) -> bytes:
    """Return panels beside each other, as SVG; bands of the same name have the same colour."""
    names = dict.fromkeys(band.name for panel in panels for band in (*panel.measured, *panel.published))
    colour = {"field": "name", "legend": {"symbolOpacity": 1},
              **theme.series_colour(dict(zip(names, _COLOURS, strict=False)))}
    width = (theme.WIDTH - _SPACE * (len(panels) - 1)) / len(panels)
    return render(theme.picture(title, subtitle, {
        "spacing": _SPACE, "hconcat": [_plot(panel, width, colour) for panel in panels]}), "svg")


def _plot(panel: Panel, width: float, colour: theme.Spec) -> theme.Spec:
    values = [{"x": theme.rounded(float(x)), "y": theme.rounded(float(y)), "name": band.name, "drawn": drawn,
               "lower": theme.rounded(float(y - 1.96 * std)), "upper": theme.rounded(float(y + 1.96 * std))}
              for drawn, bands in (("measured", panel.measured), ("published", panel.published)) for band in bands
              for x, y, std in zip(band.x, band.value, np.zeros(len(band.x)) if band.std is None else band.std,
                                   strict=True)]
    x = {"field": "x", "type": "quantitative", "title": panel.x_title, "scale": {"nice": False, "zero": False}}

    def y(field: str) -> theme.Spec:
        return {"field": field, "type": "quantitative", "title": panel.y_title, "scale": {"zero": False}}

    return {"width": width, "height": 260, "data": {"values": values}, "layer": [
        {"mark": {"type": "area", "opacity": 0.2},
         "encoding": {"x": x, "y": y("lower"), "y2": {"field": "upper"}, "color": colour}},
        {"mark": {"type": "line", "strokeWidth": 2}, "encoding": {
            "x": x, "y": y("y"), "color": colour, "strokeDash": {
                "field": "drawn", "type": "nominal", "legend": None,
                "scale": {"domain": ["measured", "published"], "range": [[1, 0], [5, 4]]}}}}]}
