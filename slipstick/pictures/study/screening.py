"""How much of each effect of the catalogue the residuals ask for, before anything is added and after."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import models, title
from slipstick.pictures.theme import Spec

CAPTION = ("Every effect that is known is tried for a first small step, with the parameters and the scatter free to "
           "make up for it. A signature of 1 would change each compared value by as much as its noise. Effects "
           "resemble each other, so the missing one drags others along; which of them it is, the ranking decides. "
           "An effect that was added is not tried again.")

_ROW = 19  # px of an effect
_LEAST = 1e-3  # noise levels: what is below is drawn there


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """A dot an effect, of the first screening and of the last; None where none was made."""
    rounds = [one for one in result["rounds"] if one["screening"]]
    if not rounds:
        return None
    who = models(result, figure_data)
    shown = {"before": rounds[0]} | ({"after": rounds[-1]} if len(rounds) > 1 and "after" in who else {})
    asked = [(probe["signature"], probe["effect"], key) for key, one in shown.items() for probe in one["screening"]]
    rows = [{"effect": title(figure_data, effect), "who": who[key][0],
             "signature": theme.number(max(_LEAST, signature), 4)} for signature, effect, key in asked]
    order = list(dict.fromkeys(title(figure_data, effect) for _, effect, _ in sorted(asked, reverse=True)))
    y = {"field": "effect", "type": "nominal", "sort": order, "title": None,
         "axis": {"labelLimit": 260, "grid": True, "ticks": False, "domain": False}}
    x = {"field": "signature", "type": "quantitative", "scale": {"type": "log"},
         "title": "signature that the residuals ask for [noise levels]", 
         "axis": {"format": "~g", "values": [10.0**power for power in range(-3, 3)]}}
    colour = {**theme.whose({name: hue for key, (name, hue) in who.items() if key in shown}), "field": "who"}
    return theme.picture(_title(result, figure_data, rounds), _subtitle(rounds), {
        "width": theme.WIDTH - 200, "height": _ROW * len(order), "data": {"values": rows},
        "encoding": {"x": x, "y": y}, "layer": [
            {"transform": [{"filter": {"field": "who", "equal": who["before"][0]}}],
             "mark": {"type": "rule", "strokeWidth": 1.2},
             "encoding": {"color": colour, "x2": {"datum": _LEAST}}},
            {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1}, "encoding": {"color": colour}}]})


def _title(result: Mapping[str, Any], figure_data: Mapping[str, Any], rounds: list[Mapping[str, Any]]) -> str:
    if not result["answer"]["effects"] and not rounds[0]["ranking"]:
        return "The residuals ask for no effect beyond chance, or enough to matter"
    return f"Of the catalogue, the residuals ask most for: {title(figure_data, rounds[0]['screening'][0]['effect'])}"


def _subtitle(rounds: list[Mapping[str, Any]]) -> str:
    said = f"A model that lacks nothing would ask for as much in {_share(rounds[0]['p_value'])}"
    if len(rounds) > 1:
        said += f"; for as much as is still asked for in the end, in {_share(rounds[-1]['p_value'])}"
    return f"{said}. Each experiment counts as one observation."


def _share(p: float) -> str:
    """In words: replicates tell no less than one in a thousand."""
    return f"{100 * p:.2g} % of cases" if p > 1e-3 else "0.1 % of cases or less"
