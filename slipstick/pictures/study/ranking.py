"""The candidates against each other, with what each gains on conditions that its fit has not seen."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import chosen, phrase
from slipstick.pictures.theme import Spec

CAPTION = ("Each candidate is fitted together with the parameters and the scatter, then predicts experiments of a "
           "motor speed or a current profile left out of its fit. The gain counts from the best fit without it, bars "
           "are two standard errors over experiments; a wide scale is logarithmic. Candidates that trail the best by "
           "less than two standard errors, each experiment counted as log(1 + nats), are tied with what that round has "
           "added. Share: how often a candidate is the best when experiments are drawn again at random.")

_DECADE = 2.302585  # natural units of log-likelihood
_ROW = 26
_WIDE = 5.0  # decades: from there on the scale is logarithmic, linear about zero
_TICKS = [0, *(sign * 10**power for sign in (-1, 1) for power in range(5))]
_WIDTH = 330
_ADDED, _BEST, _TIED, _BEHIND = "added", "best, but not added", "tied with the best", "behind"
_COLOURS = {_ADDED: theme.AFTER, _BEST: theme.BEFORE, _TIED: theme.ALARM, _BEHIND: theme.FAINT}


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """One panel a round that fitted candidates; None where none did."""
    rounds = [one for one in result["rounds"] if one["ranking"]]
    if not rounds:
        return None
    shown = [([_row(each, place, added) for place, each in enumerate(one["ranking"])], one["added"])
             for one, added in zip(result["rounds"], chosen(result), strict=True) if one["ranking"]]
    there = {row["place"] for rows, _ in shown for row in rows}
    colour = {**theme.whose({place: hue for place, hue in _COLOURS.items() if place in there}), "field": "place"}
    panels = [_panel(rows, colour, f"With {phrase(figure_data, added)} added" if added else "") for rows, added in shown]
    caption = "Held-out log10 likelihood gained per experiment over the fit without the candidate."
    return theme.picture(_title(result), caption, {"spacing": 30, "vconcat": panels})


def _title(result: Mapping[str, Any]) -> str:
    """What the rankings come to: what was added first, and what is not told apart from it."""
    ranking, (group, *_) = result["rounds"][0]["ranking"], result["answer"]["tied"] or [[]]
    named = next((one for one in ranking if group and one["effect"] == group[0]), None)
    if named is None:
        return f"{ranking[0]['title']} predicts best"
    alike = len(group) - 1
    word = "predicts best" if named is ranking[0] else "explains most with what comes after it"
    return f"{named['title']} {word}" + (f", but {alike} more cannot be told from it" if alike else "")


def _panel(rows: list[Spec], colour: Spec, title: str) -> Spec:
    y: Spec = {"field": "title", "type": "nominal", "sort": [row["title"] for row in rows], "title": None,
               "axis": {"labelLimit": 230, "ticks": False, "domain": False, "grid": True}}
    wide = max(abs(row[end]) for row in rows for end in ("low", "high")) > _WIDE
    x: Spec = {"field": "gain", "type": "quantitative", "title": "decades gained per held-out experiment",
               "scale": {"type": "symlog" if wide else "linear", "nice": False, "padding": 8},
               "axis": {"values": _TICKS, "format": "~f"} if wide else {"tickCount": 6}}
    height = _ROW * len(rows)
    bars: Spec = {"width": _WIDTH, "height": height, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"x": {"datum": 0}}},
        {"mark": {"type": "rule", "strokeWidth": 2}, "encoding": {
            "x": {**x, "field": "low"}, "x2": {"field": "high"}, "y": y, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 80, "opacity": 1},
         "encoding": {"x": x, "y": y, "color": colour}}]}
    notes = [{"width": 62, "height": height, "title": {"text": head, "fontSize": 11, "fontWeight": "normal",
                                                       "color": theme.FAINT, "anchor": "middle", "offset": 4},
              "mark": {"type": "text", "color": theme.MEASURED},
              "encoding": {"y": {**y, "axis": None}, "text": {"field": name}}}
             for name, head in (("share", "share"), ("behind", "behind"), ("bic", "BIC"))]
    panel: Spec = {"data": {"values": rows}, "spacing": 4, "hconcat": [bars, *notes]}
    return {**panel, "title": {"text": title, "fontSize": 13}} if title else panel


def _row(one: Mapping[str, Any], place: int, added: str | None) -> Spec:
    gain, error = one["held_out_gain"] / _DECADE, one["error"] / _DECADE
    return {"title": one["title"], "gain": theme.number(gain, 4), "low": theme.number(gain - 2 * error, 4),
            "high": theme.number(gain + 2 * error, 4), "share": f"{100 * one['bootstrap_share']:.0f} %",
            "behind": f"{one['behind']:.1f} s.e." if place else "",
            "bic": f"{one['bic']:,.0f}".replace("-", "−").replace(",", "\u202f"),
            "place": _ADDED if one["effect"] == added else _BEST if place == 0 else
                     _TIED if one["tied"] else _BEHIND}
