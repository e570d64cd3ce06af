"""Likelihood surfaces of the same fit on the tables of the models before and after, with common axes and shades."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import inputs, theme, units
from slipstick.pictures.study.words import model_series
from slipstick.pictures.theme import Spec, in_words
from slipstick.studies.result import StudyResult

_CAPTION = ("The same fit to the same shifting times, on the table of each model. Shades, common to both panels: the "
            "decades (factors of ten) of likelihood below the better of the two fits when the two means are moved to a "
            "point and all other unknowns keep their fitted values. Frame: the region in which the likelihood was "
            "computed. Curves: regions that contain the inputs of 50 % and 90 % of the runs, according to each fit; "
            "they show the scatter that each model needs.")

_SIZE = 275
_CELLS = 190, 240  # of the shading, in x and y


def draw(result: StudyResult, fits: Mapping[str, Mapping[str, Any]]) -> Spec | None:
    """Return the surfaces of both fits side by side; None if one is undefined or they differ in axes.

    None as well if nothing was added to the simulation.
    `fits`: `before` and `after` -> `result` and `figure_data` of the fit on the table of that model of the study.
    """
    if result.gap is None:
        return None
    surfaces = [fit["figure_data"]["surface"] for fit in fits.values()]
    likelihoods = {key: fit["result"]["log10_likelihood"] for key, fit in fits.items()}
    if None in surfaces or None in likelihoods.values() or surfaces[0]["axes"] != surfaces[1]["axes"]:
        return None
    best, improvement = max(likelihoods.values()), likelihoods["after"] - likelihoods["before"]
    models, labels = result.models, model_series(result)
    shown = {axis: units.scale(models["before"]["units"][axis], models["before"]["parameters"][axis])
             for axis in surfaces[0]["axes"]}
    panels = {key: _panel(fit, {axis: factor * models[key]["parameters"][axis] for axis, (_, factor) in shown.items()},
                          best - likelihoods[key]) for key, fit in fits.items()}
    rows = [row for panel in panels.values() for layer in panel["layer"] for row in layer["data"]["values"]]
    for channel, axis in zip("xy", surfaces[0]["axes"], strict=True):
        values = [row[name] for row in rows for name in (channel, f"{channel}2") if name in row]
        for key, panel in panels.items():
            panel["encoding"][channel] = {
                "field": channel, "type": "quantitative", "title": f"{in_words(axis)} [{shown[axis][0]}]",
                "scale": {"domain": inputs.padded_domain(values), "nice": False, "zero": False},
                "axis": {"tickCount": 5, "grid": False}}
            panel["title"] = {"text": labels[key][0], "fontSize": 12, "fontWeight": "normal", "offset": 6}
    noise = {key: f"{1e3 * fit['result']['output_std']:.3g} ms" for key, fit in fits.items()}
    return theme.picture(
        f"With the extended model, the same fit makes the recordings {abs(improvement):.1f} decades "
        f"{'more' if improvement > 0 else 'less'} likely",
        f"Output noise: {noise['before']} before, {noise['after']} after. Dot: fitted means. Cross: parameters of the "
        "study.",
        {"spacing": 24, "hconcat": list(panels.values())}, _CAPTION)


def _panel(fit: Mapping[str, Any], nominal: Mapping[str, float], deficit: float) -> Spec:
    """Return the surface of one fit with axes in units. `deficit`: decades below the better fit."""
    result, surface = fit["result"], fit["figure_data"]["surface"]
    x, y, drops = inputs.interpolated_drops(surface, _CELLS)
    first, second = (nominal[axis] for axis in surface["axes"])
    pair = [result["axes"].index(axis) for axis in surface["axes"]]
    x, y = first * x, second * y
    return {"width": _SIZE, "height": _SIZE, "encoding": {}, "layer": [
        inputs.shading(x, y, deficit + drops), inputs.frame(x, y), *inputs.curves(result, pair, (first, second))]}
