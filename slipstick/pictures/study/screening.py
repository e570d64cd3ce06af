"""The screening of the effects in the catalogue, before and after effects are added."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import model_series, title
from slipstick.pictures.theme import Spec

CAPTION = ("Each effect of the catalogue is tested with a small step from its neutral value, while parameters and "
           "scatter are free to compensate. A signature of 1 changes each compared value by its noise level. Effects "
           "resemble each other, so a missing effect also raises the signatures of similar ones; the ranking decides "
           "between them. Added effects are not tested again.")

_ROW = 19  # px per effect
_LEAST = 1e-3  # noise levels: smaller values are drawn at this value


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return one dot per effect for the first and the last screening; None without a screening."""
    rounds = [entry for entry in result["rounds"] if entry["screening"]]
    if not rounds:
        return None
    models = model_series(result, figure_data)
    screenings = {"before": rounds[0]} | ({"after": rounds[-1]} if len(rounds) > 1 and "after" in models else {})
    signatures = [(probe["signature"], probe["effect"], key)
                  for key, entry in screenings.items() for probe in entry["screening"]]
    rows = [{"effect": title(figure_data, effect), "series": models[key][0],
             "signature": theme.rounded(max(_LEAST, signature), 4)} for signature, effect, key in signatures]
    order = list(dict.fromkeys(title(figure_data, effect) for _, effect, _ in sorted(signatures, reverse=True)))
    y = {"field": "effect", "type": "nominal", "sort": order, "title": None,
         "axis": {"labelLimit": 260, "grid": True, "ticks": False, "domain": False}}
    x = {"field": "signature", "type": "quantitative", "scale": {"type": "log"},
         "title": "estimated signature [noise levels]",
         "axis": {"format": "~g", "values": [10.0**power for power in range(-3, 3)]}}
    colours = {label: hue for key, (label, hue) in models.items() if key in screenings}
    colour = {**theme.series_colour(colours), "field": "series"}
    return theme.picture(_title(result, figure_data, rounds), _subtitle(rounds), {
        "width": theme.WIDTH - 200, "height": _ROW * len(order), "data": {"values": rows},
        "encoding": {"x": x, "y": y}, "layer": [
            {"transform": [{"filter": {"field": "series", "equal": models["before"][0]}}],
             "mark": {"type": "rule", "strokeWidth": 1.2},
             "encoding": {"color": colour, "x2": {"datum": _LEAST}}},
            {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1}, "encoding": {"color": colour}}]})


def _title(result: Mapping[str, Any], figure_data: Mapping[str, Any], rounds: list[Mapping[str, Any]]) -> str:
    if not result["answer"]["effects"] and not rounds[0]["ranking"]:
        return "No effect of the catalogue is both significant and large enough to matter"
    return f"Largest estimated likelihood improvement: {title(figure_data, rounds[0]['screening'][0]['effect'])}"


def _subtitle(rounds: list[Mapping[str, Any]]) -> str:
    text = f"Probability of such an improvement if no effect is missing: {_percentage(rounds[0]['p_value'])}"
    if len(rounds) > 1:
        text += f" at first, {_percentage(rounds[-1]['p_value'])} in the last round"
    return f"{text}. Each experiment counts as one observation."


def _percentage(p_value: float) -> str:
    """Return a p-value in percent; the number of replicates limits it to 0.1 %."""
    if p_value <= 1e-3:
        return "at most 0.1 %"
    return f"{100 * p_value:.0f} %" if p_value >= 0.1 else f"{100 * p_value:.2g} %"
