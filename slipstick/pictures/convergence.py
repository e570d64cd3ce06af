"""How the search found its best, and what the refinement on the exact likelihood made of it."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

CAPTION = ("The best log10 likelihood after each generation of the genetic algorithm (or block of the classic grid), "
           "as the search approximates it, and the exact likelihood of its best before and after the refinement. The "
           "right half enlarges the end.")

_COLOURS = {"as searched": theme.BEFORE, "its best, exactly": theme.MEASURED, "after refinement, exactly": theme.AFTER}
_STEPS = {"genetic": ("generation", "generations"), "classic": ("block of the grid", "blocks of the grid")}
_LAST_DECADES = 4.0
_HEIGHT = 230


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """The whole search, and its last decades; None where there is no likelihood to follow."""
    searched, final = result["searched"]["log10_likelihood"], result["log10_likelihood"]
    history = [(number, value) for number, value in enumerate(result["history"], 1) if value is not None]
    if searched is None or final is None or not history:
        return None
    step, steps = _STEPS[result["method"]]
    gained = history[-1][1] - history[0][1]
    top = max(final, searched, *(value for _, value in history))
    last = {"domain": [theme.number(top - _LAST_DECADES, 6), theme.number(top + _LAST_DECADES / 8, 6)]}
    then = f"the refinement adds {final - searched:.2f}" if result["refined"] else "not refined"
    return theme.picture(
        f"{len(result['history'])} {steps} gain {gained:.1f} decades, {then}",
        "A decade: a factor of ten in likelihood. Densities are per ms, as in the paper's eq. 7.",
        {"spacing": 50, "hconcat": [_panel(step, {}), _panel(f"{step} (the last decades, enlarged)", last)],
         "datasets": {
            "history": [{"step": number, "likelihood": theme.number(value, 7)} for number, value in history],
            # The first is larger, so that it is seen where both coincide.
            "exact": [{"step": history[-1][0], "likelihood": theme.number(value, 7), "who": who, "size": size}
                      for who, value, size in zip(list(_COLOURS)[1:], (searched, final), (190, 60), strict=True)]}})


def _panel(title: str, scale: Spec) -> Spec:
    encoding: Spec = {
        "x": {"field": "step", "type": "quantitative", "title": title,
              "scale": {"nice": False, "padding": 10}, "axis": {"grid": False, "tickMinStep": 1, "format": "d"}},
        "y": {"field": "likelihood", "type": "quantitative", "title": "log10 likelihood",
              "scale": {"zero": False, "padding": 8, **scale}}}
    colour, search = theme.whose(_COLOURS), next(iter(_COLOURS))
    return {"width": (theme.WIDTH - 110) // 2, "height": _HEIGHT, "encoding": encoding, "layer": [
        {"data": {"name": "history"}, "mark": {"type": "line", "interpolate": "step-after", "strokeWidth": 2,
                                               "clip": True}, "encoding": {"color": {**colour, "datum": search}}},
        {"data": {"name": "exact"}, "mark": {"type": "point", "filled": True, "opacity": 1, "clip": True},
         "encoding": {"color": {**colour, "field": "who"}, "size": {"field": "size", "type": "quantitative",
                                                                    "scale": None}}}]}
