"""The fitted inputs on the plane of two of them, over the likelihood of their means (Fig. 6 of the paper)."""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy.interpolate import RectBivariateSpline

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec
from slipstick.uncertainty import Inputs

CAPTION = ("Shades: how many decades of likelihood are lost where the two means are moved there and all else is kept "
           "as fitted; the darkest is their 90 % region, if all else is so. The frame: how far the likelihood was "
           "computed. Curves: half, and nine in ten, of the runs have their inputs inside, if the fit is right.")

_BANDS = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
"""Decades below the best at which a shade begins. Within 1 lie 90 % for two unknowns (chi-square: ln 10)."""
_LABELS = [f"{low:g} to {high:g}" for low, high in pairwise(_BANDS)] + [f"{_BANDS[-1]:g}+"]
_SUBTITLE = "Curves: half, and nine in ten, of the runs have their inputs inside. Dot: fitted means. Cross: nominal."
_MASSES = (0.5, 0.9)
_CELLS = 285, 420  # of the shading, across and up
_DEEPEST = 1000.0  # decades: further down all is alike
_WIDTH, _HEIGHT = 570, 420
Summit = Literal["ridge", "open", "peak"]
_TITLES: dict[Summit, str] = {
    "ridge": "A ridge: the recordings fix a combination of {0} and {1}, hardly each by itself",
    "open": "The recordings leave {0} and {1} open within the frame",
    "peak": "The recordings fix both {0} and {1}"}
_SLENDER = 3.0  # a region this many times as long as it is wide is a ridge
_STEPS = 120
_MARGIN = 0.03  # of an axis


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec:
    """The plane of the surface's two means, or of the first two inputs; with one input, its density."""
    axes, surface = list(result["axes"]), figure_data["surface"]
    pair = [axes.index(name) for name in (surface["axes"] if surface else axes[:2])]
    if len(pair) < 2:
        return _density(result, pair[0])
    names = [theme.plain(axes[place]) for place in pair]
    encoding: Spec = {at: {"field": at, "type": "quantitative", "title": f"{name} [multiple of nominal]",
                           "scale": {"nice": False, "zero": False}, "axis": {"tickCount": 6, "grid": False}}
                      for at, name in zip("xy", names, strict=True)}
    title, subtitle, layers = f"The fitted {names[0]} and {names[1]}", _SUBTITLE, curves(result, pair)
    if surface is not None:
        x, y, drops = smooth(surface)
        for at, edges in (("x", x), ("y", y)):
            held = (edges[0], edges[-1], 1.0, *(row[at] for row in layers[0]["data"]["values"]))
            encoding[at]["scale"] |= {"domain": reach(held)}
        layers[:0] = [shading(x, y, drops), frame(x, y)]
        title = _TITLES[summit(x, y, drops)].format(*names)
        if len(axes) > 2:
            subtitle += " All other inputs are kept as fitted."
    return theme.picture(title, subtitle, {"width": _WIDTH, "height": _HEIGHT, "encoding": encoding, "layer": layers})


def smooth(surface: Mapping[str, Any],
           cells: tuple[int, int] = _CELLS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of fine `cells` c, r along both axes, (c + 1,) and (r + 1,), and decades below the best in each, (c, r).

    Infinitely many where the nearest point has no likelihood.
    """
    values = np.array([[-np.inf if value is None else value for value in row]
                       for row in surface["log10_likelihood"]], dtype=float)
    first, second = np.array(surface["first"]), np.array(surface["second"])
    x, y = (np.linspace(along[0], along[-1], n + 1) for along, n in zip((first, second), cells, strict=True))
    across, up = (x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2
    # Cubic: what drops as a square is then interpolated as it is, also across a ridge narrower than the grid.
    lost = ~np.isfinite(values)
    filled = np.where(lost, np.min(values[~lost]), np.maximum(values, np.max(values) - _DEEPEST))
    fine = RectBivariateSpline(first, second, filled)(across, up)
    nearest = np.ix_(np.abs(across[:, None] - first).argmin(axis=1), np.abs(up[:, None] - second).argmin(axis=1))
    drops: np.ndarray = np.where(lost[nearest], np.inf, np.max(fine) - fine)
    return x, y, drops


def summit(x: np.ndarray, y: np.ndarray, drops: np.ndarray) -> Summit:
    """A ridge where the region within a decade of the best is much longer than wide, open where it meets an edge."""
    inside = drops <= _BANDS[1]
    points = np.argwhere(inside) * [x[1] - x[0], y[1] - y[0]]
    if len(points) > 2:
        lengths = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points.T)), 0.0))
        if lengths[1] > _SLENDER * lengths[0]:
            return "ridge"
    return "open" if inside[[0, -1]].any() or inside[:, [0, -1]].any() else "peak"


def reach(held: Iterable[float]) -> list[float | None]:
    """The domain of an axis that holds these values, with a margin."""
    low, high = min(held := list(held)), max(held)
    margin = _MARGIN * (high - low)
    return [theme.number(low - margin), theme.number(high + margin)]


def frame(x: np.ndarray, y: np.ndarray) -> Spec:
    """The outline of a plane whose cells have the edges x and y."""
    corners = dict(zip(("x", "x2", "y", "y2"), map(theme.number, (x[0], x[-1], y[0], y[-1])), strict=True))
    return {"data": {"values": [corners]}, "mark": {"type": "rect", "fill": None, "stroke": theme.FAINT,
                                                    "strokeWidth": 0.6},
            "encoding": {"x2": {"field": "x2"}, "y2": {"field": "y2"}}}


def shading(x: np.ndarray, y: np.ndarray, drops: np.ndarray) -> Spec:
    """Rows of the plane, cut where the shade changes: cells of the edges x and y, so many decades below the best."""
    # Each row reaches under the next one, or the background is seen between them.
    tops, runs = [*y[2:], y[-1]], []
    for band, low, high in zip((np.searchsorted(_BANDS, drops, side="right") - 1).T, y[:-1], tops, strict=True):
        cuts = [0, *(np.flatnonzero(np.diff(band)) + 1), len(band)]
        runs += [{"x": theme.number(x[begin]), "x2": theme.number(x[end]), "y": theme.number(low),
                  "y2": theme.number(high), "band": _LABELS[band[begin]]} for begin, end in pairwise(cuts)]
    shade = {"field": "band", "type": "nominal", "scale": {"domain": _LABELS, "range": list(theme.SHADES)},
             "legend": {"orient": "right", "title": ["decades below", "the best"], "symbolType": "square",
                        "symbolSize": 160, "titleFontWeight": "normal", "titleColor": theme.MEASURED,
                        "symbolStrokeWidth": 0}}
    return {"data": {"values": runs}, "mark": "rect",
            "encoding": {"x2": {"field": "x2"}, "y2": {"field": "y2"}, "color": shade}}


def curves(result: Mapping[str, Any], pair: list[int], nominal: tuple[float, float] = (1.0, 1.0)) -> list[Spec]:
    """The curves that hold a share of the runs, as images of circles of the normal scores; the means; nominal.

    Values are multiples of nominal, times what `nominal` is to be on the axes.
    """
    inputs, scale, rows = _inputs(result, pair), np.array(nominal), []
    angles = np.linspace(0, 2 * np.pi, _STEPS + 1)
    for mass in _MASSES:
        circle = np.sqrt(-2 * np.log(1 - mass)) * np.column_stack([np.cos(angles), np.sin(angles)])
        rows += [{"x": theme.number(x), "y": theme.number(y), "mass": f"{100 * mass:.0f} %", "order": order}
                 for order, (x, y) in enumerate(scale * inputs.points(circle))]
    order = {"order": {"field": "order", "type": "quantitative"}, "detail": {"field": "mass"}}
    # White below ink: seen on the darkest shade and on the lightest.
    lines = [{"data": {"values": rows}, "mark": {"type": "line", "color": colour, "strokeWidth": width,
                                                 "strokeJoin": "round"}, "encoding": order}
             for colour, width in (("white", 4), (theme.INK, 1.6))]
    at_nominal, mean = ({"x": theme.number(x), "y": theme.number(y)} for x, y in (scale, scale * inputs.mean))
    marks = [{"data": {"values": [at]}, "mark": {"type": "point", "filled": True, "stroke": "white", "opacity": 1,
                                                 "strokeWidth": 1.2, **look}}
             for at, look in ((at_nominal, {"shape": "cross", "size": 130, "color": theme.BEFORE}),
                              (mean, {"shape": "circle", "size": 110, "color": theme.INK}))]
    return [*lines, *marks]


def _inputs(result: Mapping[str, Any], chosen: list[int]) -> Inputs:
    correlation, support = result.get("correlation"), result.get("support")
    return Inputs(np.array(result["mean"])[chosen], np.array(result["std"])[chosen],
                  families=tuple(result["families"][place] for place in chosen),
                  correlation=None if correlation is None else np.array(correlation)[np.ix_(chosen, chosen)],
                  support=None if support is None else np.array(support)[chosen])


def _density(result: Mapping[str, Any], place: int) -> Spec:
    """The density of one input over its value, nominal marked."""
    scores, name = np.linspace(-3.5, 3.5, 201)[:, None], theme.plain(result["axes"][place])
    values = _inputs(result, [place]).points(scores)[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        density = np.exp(-scores[:, 0] ** 2 / 2) / np.sqrt(2 * np.pi) / np.gradient(values, scores[:, 0])
    rows = [{"x": float(x), "density": theme.number(y)} for x, y in zip(values, density, strict=True)]
    x = {"field": "x", "type": "quantitative", "title": f"{name} [multiple of nominal]", "scale": {"zero": False}}
    return theme.picture(
        f"The fitted {name} scatters by {result['std'][place]:.3g} about {result['mean'][place]:.3g} times nominal",
        "Density of the fitted input. Dashed: nominal.",
        {"width": theme.WIDTH, "height": 240, "layer": [
            {"data": {"values": rows}, "mark": {"type": "area", "color": theme.AFTER, "opacity": 0.25, "line": {
                "color": theme.AFTER}}, "encoding": {"x": x, "y": {
                    "field": "density", "type": "quantitative", "stack": None,
                    "title": "density [1 / multiple of nominal]"}}},
            {"data": {"values": [{"x": 1}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.BEFORE,
                                                      "strokeWidth": 1.6}, "encoding": {"x": x}}]})
