"""The likelihood around the same fit on the tables of the models before and after: one plane, one scale of shades."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import inputs, theme
from slipstick.pictures.study.words import models
from slipstick.pictures.theme import Spec, plain

CAPTION = ("The same fit to the same shifting times, on the table of each model. Shades, the same for both: how many "
           "decades of likelihood lie between there and the better of the two fits where the two means are moved "
           "and all else is kept as fitted. The frame: how far the likelihood was computed. Curves: half, and nine in "
           "ten, of the runs have their inputs inside, if the fit is right: the scatter that each model needs.")

_SIZE = 275
_CELLS = 190, 240  # of the shading, across and up


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any], fits: Mapping[str, Mapping[str, Any]]) -> Spec | None:
    """The planes of both fits side by side; None where they have none, not of the same means, or no likelihood.

    `fits`: `before` and `after` -> `result` and `figure_data` of the fit on the table of that model of the study.
    """
    planes = [fit["figure_data"]["surface"] for fit in fits.values()]
    levels = {key: fit["result"]["log10_likelihood"] for key, fit in fits.items()}
    if None in planes or None in levels.values() or planes[0]["axes"] != planes[1]["axes"]:
        return None
    best, gained = max(levels.values()), levels["after"] - levels["before"]
    spec, who = result["models"], models(result, figure_data)
    panels = {key: _panel(fit, spec[key]["parameters"], best - levels[key]) for key, fit in fits.items()}
    rows = [row for panel in panels.values() for layer in panel["layer"] for row in layer["data"]["values"]]
    for at, axis in zip("xy", planes[0]["axes"], strict=True):
        held = [row[name] for row in rows for name in (at, f"{at}2") if name in row]
        for key, panel in panels.items():
            panel["encoding"][at] = {
                "field": at, "type": "quantitative", "title": f"{plain(axis)} [{spec[key]['units'][axis]}]",
                "scale": {"domain": inputs.reach(held), "nice": False, "zero": False},
                "axis": {"tickCount": 5, "grid": False}}
            panel["title"] = {"text": who[key][0], "fontSize": 12, "fontWeight": "normal", "offset": 6}
    noise = {key: f"{1e3 * fit['result']['output_std']:.3g} ms" for key, fit in fits.items()}
    return theme.picture(
        f"On the extended model the same fit makes the recordings {abs(gained):.0f} decades "
        f"{'more' if gained > 0 else 'less'} likely",
        f"Output noise {noise['before']} before, {noise['after']} after. Dot: fitted means. Cross: those of the study.",
        {"spacing": 24, "hconcat": list(panels.values())})


def _panel(fit: Mapping[str, Any], nominal: Mapping[str, float], behind: float) -> Spec:
    """One plane with its axes in units, of a fit that many decades behind the better one."""
    result, surface = fit["result"], fit["figure_data"]["surface"]
    x, y, drops = inputs.smooth(surface, _CELLS)
    first, second = (nominal[axis] for axis in surface["axes"])
    pair = [result["axes"].index(axis) for axis in surface["axes"]]
    x, y = first * x, second * y
    return {"width": _SIZE, "height": _SIZE, "encoding": {}, "layer": [
        inputs.shading(x, y, behind + drops), inputs.frame(x, y), *inputs.curves(result, pair, (first, second))]}
