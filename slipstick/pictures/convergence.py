"""Progress of the search, and the exact likelihood before and after refinement."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec

CAPTION = ("Line: the best log10 likelihood after each generation of the genetic algorithm (or block of the classic "
           "grid), as approximated by the search. Points: the exact log10 likelihood of the best candidate before and "
           "after refinement. The right panel enlarges the last decades.")

_COLOURS = {"search, approximate": theme.BEFORE, "best of the search, exact": theme.MEASURED,
            "after refinement, exact": theme.AFTER}
_STEPS = {"genetic": ("generation", "generations"), "classic": ("block of the grid", "blocks of the grid")}
_LAST_DECADES = 4.0  # shown in the right panel
_HEIGHT = 230


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return the search and an enlargement of its last decades; None if a log-likelihood is undefined."""
    result = output["result"]
    searched, final = result["searched"]["log10_likelihood"], result["log10_likelihood"]
    history = [(index, value) for index, value in enumerate(result["history"], 1) if value is not None]
    if searched is None or final is None or not history:
        return None
    step, steps = _STEPS[result["method"]]
    improvement = history[-1][1] - history[0][1]
    top = max(final, searched, *(value for _, value in history))
    last = {"domain": [theme.rounded(top - _LAST_DECADES, 6), theme.rounded(top + _LAST_DECADES / 8, 6)]}
    refinement = f"refinement adds {final - searched:.2f}" if result["refined"] else "no refinement"
    return theme.picture(
        f"{len(result['history'])} {steps} improve the best candidate by {improvement:.1f} decades; {refinement}",
        f"A decade is a factor of ten in likelihood. Densities are per {Output.of(output['figure_data']).per}"
        ", as in eq. 7 of the paper.",
        {"spacing": 50, "hconcat": [_panel(step, {}), _panel(f"{step} (last decades enlarged)", last)],
         "datasets": {
            "history": [{"step": index, "likelihood": theme.rounded(value, 7)} for index, value in history],
            # The first point is larger, so that it stays visible where both coincide.
            "exact": [{"step": history[-1][0], "likelihood": theme.rounded(value, 7), "series": series, "size": size}
                      for series, value, size in zip(list(_COLOURS)[1:], (searched, final), (190, 60), strict=True)]}})


def _panel(title: str, scale: Spec) -> Spec:
    encoding: Spec = {
        "x": {"field": "step", "type": "quantitative", "title": title,
              "scale": {"nice": False, "padding": 10}, "axis": {"grid": False, "tickMinStep": 1, "format": "d"}},
        "y": {"field": "likelihood", "type": "quantitative", "title": "log10 likelihood",
              "scale": {"zero": False, "padding": 8, **scale}}}
    colour, search = theme.series_colour(_COLOURS), next(iter(_COLOURS))
    return {"width": (theme.WIDTH - 110) // 2, "height": _HEIGHT, "encoding": encoding, "layer": [
        {"data": {"name": "history"}, "mark": {"type": "line", "interpolate": "step-after", "strokeWidth": 2,
                                               "clip": True}, "encoding": {"color": {**colour, "datum": search}}},
        {"data": {"name": "exact"}, "mark": {"type": "point", "filled": True, "opacity": 1, "clip": True},
         "encoding": {"color": {**colour, "field": "series"}, "size": {"field": "size", "type": "quantitative",
                                                                    "scale": None}}}]}
