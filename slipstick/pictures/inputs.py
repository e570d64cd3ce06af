"""The fitted distribution of two inputs, and the likelihood as a function of their means (Fig. 6 of the paper)."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import scipy

from slipstick.pictures import theme
from slipstick.pictures.multiples import unknown
from slipstick.pictures.theme import Spec
from slipstick.uncertainty import Inputs

CAPTION = ("With one input: its fitted density; dashed, its nominal value. With more: the plane of the two means "
           "that are hardest to separate. Shades: the decades of likelihood lost when the two means are moved to a "
           "point and all other unknowns keep their fitted values. Under that condition, the darkest shade is the 90 "
           "% region of the two means. Frame: the region in which the likelihood was computed. Curves: regions that "
           "contain the inputs of 50 % and 90 % of the runs, according to the fit.")

_BANDS = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
"""Decades below the best at which each shade begins; 1 bounds the 90 % region of two unknowns (chi-square: ln 10)."""
_LABELS = [f"{low:g} to {high:g}" for low, high in pairwise(_BANDS)] + [f"{_BANDS[-1]:g}+"]
_SUBTITLE = "Curves enclose the inputs of 50 % and 90 % of the runs. Dot: fitted means. Cross: nominal values."
_PROBABILITIES = (0.5, 0.9)
_CELLS = 285, 420  # of the shading, in x and y
_DEEPEST = 1000.0  # decades below the best: lower values are clipped
_WIDTH, _HEIGHT = 570, 420
SurfaceShape = Literal["ridge", "open", "peak"]
_TITLES: dict[SurfaceShape, str] = {
    "ridge": "A ridge: the recordings determine a combination of {0} and {1}, but hardly each alone",
    "open": "The recordings do not limit {0} and {1} within the frame",
    "peak": "The recordings determine both {0} and {1}"}
_RIDGE_RATIO = 3.0  # of length to width, above which a region is a ridge
_STEPS = 120  # per curve
_MARGIN = 0.03  # as a share of the axis


def draw(output: Mapping[str, Any]) -> Spec:
    """Return the plane of the inputs of the surface or, without one, of the first two; for one input, its density."""
    result, surface, physical = output["result"], output["figure_data"]["surface"], output["physical"]
    axes = list(result["axes"])
    pair = [axes.index(name) for name in (surface["axes"] if surface else axes[:2])]
    if len(pair) < 2:
        return _density(result, pair[0], physical)
    names = [theme.in_words(axes[index]) for index in pair]
    encoding: Spec = {
        channel: {"field": channel, "type": "quantitative", "title": f"{name} [multiple of nominal]",
                  "scale": {"nice": False, "zero": False},
                  "axis": unknown(f"mean of {axes[index]}", physical).axis(tickCount=6, grid=False)}
        for channel, name, index in zip("xy", names, pair, strict=True)}
    title, subtitle, layers = f"The fitted {names[0]} and {names[1]}", _SUBTITLE, curves(result, pair)
    if surface is not None:
        x, y, drops = interpolated_drops(surface)
        for channel, edges in (("x", x), ("y", y)):
            values = (edges[0], edges[-1], 1.0, *(row[channel] for row in layers[0]["data"]["values"]))
            encoding[channel]["scale"] |= {"domain": padded_domain(values)}
        layers[:0] = [shading(x, y, drops), frame(x, y)]
        title = _TITLES[surface_shape(x, y, drops)].format(*names)
        if len(axes) > 2:
            subtitle += " All other unknowns keep their fitted values."
    return theme.picture(title, subtitle, {"width": _WIDTH, "height": _HEIGHT, "encoding": encoding, "layer": layers})


def interpolated_drops(surface: Mapping[str, Any],
                       cells: tuple[int, int] = _CELLS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interpolate the log-likelihood on (c, r) fine `cells`.

    Returns their edges in x (c + 1,) and y (r + 1,), and the decades below the best in each cell (c, r), infinite if
    the likelihood at the nearest grid point is zero.
    """
    values = np.array([[-np.inf if value is None else value for value in row]
                       for row in surface["log10_likelihood"]], dtype=float)
    first, second = np.array(surface["first"]), np.array(surface["second"])
    x, y = (np.linspace(grid[0], grid[-1], n + 1) for grid, n in zip((first, second), cells, strict=True))
    x_centre, y_centre = (x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2
    # A cubic spline reproduces a quadratic drop exactly, even across a ridge narrower than the grid spacing.
    undefined = ~np.isfinite(values)
    filled = np.where(undefined, np.min(values[~undefined]), np.maximum(values, np.max(values) - _DEEPEST))
    fine = scipy.interpolate.RectBivariateSpline(first, second, filled)(x_centre, y_centre)
    nearest = np.ix_(np.abs(x_centre[:, None] - first).argmin(axis=1),
                     np.abs(y_centre[:, None] - second).argmin(axis=1))
    drops: np.ndarray = np.where(undefined[nearest], np.inf, np.max(fine) - fine)
    return x, y, drops


def surface_shape(x: np.ndarray, y: np.ndarray, drops: np.ndarray) -> SurfaceShape:
    """Classify the region within a decade of the best: ridge if elongated, open if it touches an edge, else peak."""
    inside = drops <= _BANDS[1]
    points = np.argwhere(inside) * [x[1] - x[0], y[1] - y[0]]
    if len(points) > 2:
        lengths = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points.T)), 0.0))
        if lengths[1] > _RIDGE_RATIO * lengths[0]:
            return "ridge"
    return "open" if inside[[0, -1]].any() or inside[:, [0, -1]].any() else "peak"


def padded_domain(values: Iterable[float]) -> list[float | None]:
    """Return the domain of an axis that contains the values, with a margin."""
    low, high = min(values := list(values)), max(values)
    margin = _MARGIN * (high - low)
    return [theme.rounded(low - margin), theme.rounded(high + margin)]


def frame(x: np.ndarray, y: np.ndarray) -> Spec:
    """Return the outline of a plane whose cells have the edges x and y."""
    corners = dict(zip(("x", "x2", "y", "y2"), map(theme.rounded, (x[0], x[-1], y[0], y[-1])), strict=True))
    return {"data": {"values": [corners]}, "mark": {"type": "rect", "fill": None, "stroke": theme.FAINT,
                                                    "strokeWidth": 0.6},
            "encoding": {"x2": {"field": "x2"}, "y2": {"field": "y2"}}}


def shading(x: np.ndarray, y: np.ndarray, drops: np.ndarray) -> Spec:
    """Return rectangles of constant shade for cells with edges x and y and `drops` (c, r) in decades below the best."""
    # Each row extends below the next one, so that the background does not show between them.
    tops, rectangles = [*y[2:], y[-1]], []
    for band, low, high in zip((np.searchsorted(_BANDS, drops, side="right") - 1).T, y[:-1], tops, strict=True):
        cuts = [0, *(np.flatnonzero(np.diff(band)) + 1), len(band)]
        rectangles += [{"x": theme.rounded(x[begin]), "x2": theme.rounded(x[end]), "y": theme.rounded(low),
                        "y2": theme.rounded(high), "band": _LABELS[band[begin]]} for begin, end in pairwise(cuts)]
    shade = {"field": "band", "type": "nominal", "scale": {"domain": _LABELS, "range": list(theme.SHADES)},
             "legend": {"orient": "right", "title": ["decades below", "the best"], "symbolType": "square",
                        "symbolSize": 160, "titleFontWeight": "normal", "titleColor": theme.MEASURED,
                        "symbolStrokeWidth": 0}}
    return {"data": {"values": rectangles}, "mark": "rect",
            "encoding": {"x2": {"field": "x2"}, "y2": {"field": "y2"}, "color": shade}}


def curves(result: Mapping[str, Any], pair: list[int], nominal: tuple[float, float] = (1.0, 1.0)) -> list[Spec]:
    """Return curves that enclose a share of the runs, and points at the fitted means and the nominal values.

    The curves are the images of circles of standard normals. Multiples of nominal are scaled by `nominal`, the nominal
    values in the units of the axes.
    """
    inputs, scale, rows = _inputs(result, pair), np.array(nominal), []
    angles = np.linspace(0, 2 * np.pi, _STEPS + 1)
    for probability in _PROBABILITIES:
        circle = np.sqrt(-2 * np.log(1 - probability)) * np.column_stack([np.cos(angles), np.sin(angles)])
        rows += [{"x": theme.rounded(x), "y": theme.rounded(y), "share": f"{100 * probability:.0f} %", "order": order}
                 for order, (x, y) in enumerate(scale * inputs.points(circle))]
    order = {"order": {"field": "order", "type": "quantitative"}, "detail": {"field": "share"}}
    # A white line below the dark one keeps the curve visible on every shade.
    lines = [{"data": {"values": rows}, "mark": {"type": "line", "color": colour, "strokeWidth": width,
                                                 "strokeJoin": "round"}, "encoding": order}
             for colour, width in (("white", 4), (theme.INK, 1.6))]
    at_nominal, mean = ({"x": theme.rounded(x), "y": theme.rounded(y)} for x, y in (scale, scale * inputs.mean))
    marks = [{"data": {"values": [point]}, "mark": {"type": "point", "filled": True, "stroke": "white", "opacity": 1,
                                                 "strokeWidth": 1.2, **look}}
             for point, look in ((at_nominal, {"shape": "cross", "size": 130, "color": theme.BEFORE}),
                              (mean, {"shape": "circle", "size": 110, "color": theme.INK}))]
    return [*lines, *marks]


def _inputs(result: Mapping[str, Any], columns: list[int]) -> Inputs:
    """Return the fitted joint distribution of the inputs in these columns."""
    correlation, support = result.get("correlation"), result.get("support")
    return Inputs(np.array(result["mean"])[columns], np.array(result["std"])[columns],
                  families=tuple(result["families"][column] for column in columns),
                  correlation=None if correlation is None else np.array(correlation)[np.ix_(columns, columns)],
                  support=None if support is None else np.array(support)[columns])


def _density(result: Mapping[str, Any], column: int, physical: Sequence[Mapping[str, Any]]) -> Spec:
    """Return the density of one input, with its nominal value marked."""
    normals, name = np.linspace(-3.5, 3.5, 201)[:, None], theme.in_words(result["axes"][column])
    values = _inputs(result, [column]).points(normals)[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        density = np.exp(-normals[:, 0] ** 2 / 2) / np.sqrt(2 * np.pi) / np.gradient(values, normals[:, 0])
    rows = [{"x": float(x), "density": theme.rounded(y)} for x, y in zip(values, density, strict=True)]
    shown = unknown(f"mean of {result['axes'][column]}", physical)
    x = {"field": "x", "type": "quantitative", "title": f"{name} [multiple of nominal]", "scale": {"zero": False},
         "axis": shown.axis(tickCount=8)}
    mean, std = (shown.text(result[kind][column]) for kind in ("mean", "std"))
    return theme.picture(
        f"Fitted {name}: mean {result['mean'][column]:.3g}, scatter {result['std'][column]:.3g} (multiples of "
        f"nominal); {mean} and {std}",
        "Density of the fitted input. Dashed: nominal value.",
        {"width": theme.WIDTH, "height": 240, "layer": [
            {"data": {"values": rows}, "mark": {"type": "area", "color": theme.AFTER, "opacity": 0.25, "line": {
                "color": theme.AFTER}}, "encoding": {"x": x, "y": {
                    "field": "density", "type": "quantitative", "stack": None,
                    "title": "density [1 / multiple of nominal]"}}},
            {"data": {"values": [{"x": 1}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.BEFORE,
                                                      "strokeWidth": 1.6}, "encoding": {"x": x}}]})
