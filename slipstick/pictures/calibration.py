"""The probability integral transform: where each measured time lies in its predicted distribution.

If the predicted distributions are right, the probabilities are uniform between 0 and 1 (Dawid 1984; Gneiting,
Balabdaoui and Raftery 2007). The band of their distribution function is that of Kolmogorov's statistic, at all values
together.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from slipstick.pictures import theme
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec

CAPTION = ("Each measurement is replaced by the probability that the fit predicts below it (probability integral "
           "transform, PIT). For right predictions these are uniform. Left: their histogram; shade: where each bar "
           "lies in 9 of 10 cases. Right: their distribution function minus that of uniform ones; shade: where the "
           "whole curve lies in 9 of 10 cases. A hump in the middle: the predicted scatter is too wide; high ends: "
           "too narrow; a slope: later or earlier than predicted. The fit was made to the same recordings, "
           "so that a right model leaves the shade in fewer than 1 of 10 cases.")

LEVEL = 0.9
_BINS = 12
_HEIGHT = 220
_HALF = (theme.WIDTH - 84) // 2
_CENTRAL = 0.5
"""Share of the predicted probability about the median by whose count scatter is called too wide or too narrow."""


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return the histogram and the distribution function; None without predictions."""
    values = transformed(output["figure_data"]["prediction"])
    n = len(values)
    if n == 0:
        return None
    (furthest, band), shown = distance(values), Output.of(output["figure_data"])
    return theme.picture(
        f"The measured {shown.plural} " + ("are spread as predicted" if furthest <= band else verdict(values, shown)),
        f"The distribution function of {n} probabilities is up to {furthest:.3f} from a uniform one; the limit of the "
        f"{100 * LEVEL:.0f} % band is {band:.3f}.",
        {"spacing": 40, "hconcat": [_histogram(values, shown), _difference(values, band)]})


def distance(values: np.ndarray, level: float = LEVEL) -> tuple[float, float]:
    """The largest distance of the distribution function of probabilities (n,) from uniform, and its limit at `level`.

    Each side exceeds the limit with half of the probability 1 - `level`, both together practically never: at 0.9 it
    differs from Kolmogorov's by 2e-5 of itself.
    """
    n = len(values)
    furthest = max(np.max(np.arange(1, n + 1) / n - values), np.max(values - np.arange(n) / n))
    return float(furthest), float(scipy.special.smirnovi(n, (1 - level) / 2))


def transformed(prediction: Mapping[str, Any]) -> np.ndarray:
    """The predicted probability below each measured time, ascending; engagements that may never lock are left out."""
    rows = [probability_below(prediction, place) for place, mean in enumerate(prediction["mean"]) if mean is not None]
    return np.sort(np.array(rows))


def probability_below(prediction: Mapping[str, Any], place: int) -> float:
    """The predicted probability below the measured time of the engagement at this place."""
    return _integrate(tuple(prediction["density_time"][place]), tuple(prediction["density"][place]),
                      prediction["measured"][place])


@lru_cache(maxsize=1024)  # two pictures and the doubts of a page ask for the same ones
def _integrate(time: tuple[float, ...], density: tuple[float, ...], end: float) -> float:
    """The share of the integral of a density, known at times in s, up to an end in s."""
    with np.errstate(over="ignore"):  # PCHIP divides by slopes that nearly vanish; its derivative there is correctly 0
        integral = scipy.interpolate.PchipInterpolator(time, density).antiderivative()
    return float(integral(np.clip(end, time[0], time[-1])) / integral(time[-1]))


def verdict(values: np.ndarray, output: Output) -> str:
    """How the measured outputs differ from the predicted ones: by their level if it is significant, else by scatter."""
    n = len(values)
    shift = (values.mean() - 0.5) * np.sqrt(12 * n)
    central = np.count_nonzero(np.abs(values - 0.5) < _CENTRAL / 2)
    spread = (central - _CENTRAL * n) / np.sqrt(n * _CENTRAL * (1 - _CENTRAL))
    if abs(shift) > abs(spread):
        return f"are {output.more if shift > 0 else output.less} than predicted"
    return f"scatter {'less' if spread > 0 else 'more'} than predicted"


def _histogram(values: np.ndarray, shown: Output) -> Spec:
    counts, edges = np.histogram(values, _BINS, (0, 1))
    n = len(values)
    low, high = (math.ceil(scipy.special.bdtrik(share, n, 1 / _BINS)) for share in ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    bars = [{"from": theme.rounded(first), "to": theme.rounded(last), "count": int(count)}
            for first, last, count in zip(edges[:-1], edges[1:], counts, strict=True)]
    x: Spec = {"field": "from", "type": "quantitative", "title": "predicted probability below what was measured",
               "scale": {"domain": [0, 1]}, "axis": {"grid": False, "tickCount": 5}}
    y: Spec = {"field": "count", "type": "quantitative", "title": shown.measured}
    return {"width": _HALF, "height": _HEIGHT, "layer": [
        {"data": {"values": bars}, "mark": {"type": "rect", "color": theme.AFTER, "opacity": 0.75, "stroke": "white"},
         "encoding": {"x": x, "x2": {"field": "to"}, "y": y, "y2": {"datum": 0}}},
        theme.band(low, high, y, 0.2),
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.MEASURED, "strokeDash": [4, 3]},
         "encoding": {"y": {"datum": n / _BINS}}}]}


def _difference(values: np.ndarray, band: float) -> Spec:
    n = len(values)
    steps: list[Spec] = [{"p": 0.0, "d": 0.0}]
    for place, value in enumerate(values):
        steps += [{"p": theme.rounded(value), "d": theme.rounded(share / n - value, 4)} for share in (place, place + 1)]
    steps.append({"p": 1.0, "d": 0.0})
    y: Spec = {"field": "d", "type": "quantitative", "title": "distribution function − uniform",
               "axis": {"tickCount": 5}}
    x: Spec = {"field": "p", "type": "quantitative", "title": "predicted probability below what was measured",
               "scale": {"domain": [0, 1]}, "axis": {"grid": False, "tickCount": 5}}
    return {"width": _HALF, "height": _HEIGHT, "layer": [
        theme.band(-band, band, y, 0.2),
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        {"data": {"values": steps}, "mark": {"type": "line", "color": theme.AFTER, "strokeWidth": 1.8},
         "encoding": {"x": x, "y": y, "order": {"field": "p", "type": "quantitative"}}}]}
