"""The candidates ranked by their improvement of the held-out likelihood."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import added_effects, phrase
from slipstick.pictures.theme import Spec

CAPTION = ("Each candidate is fitted together with the parameters and the scatter. It then predicts the experiments "
           "of a motor speed or a current profile left out of its fit. The improvement is relative to the best fit "
           "without the candidate. Bars: two standard errors over experiments. Wide ranges have a logarithmic scale. "
           "Share: share of bootstrap samples of the experiments in which the candidate is the best. Behind: standard "
           "errors by which it trails the best, with each experiment counted as log(1 + nats); candidates below two "
           "are tied with the effect added in that round. BIC: change relative to the fit without the candidate.")

_DECADE = 2.302585  # nats per decade
_ROW = 26
_WIDE = 5.0  # decades: for wider ranges the scale is logarithmic, and linear about zero
_TICKS = [0, *(sign * 10**power for sign in (-1, 1) for power in range(5))]
_WIDTH = 330
_ADDED, _BEST, _TIED, _BEHIND = "added", "best, but not added", "tied with the best", "behind"
_COLOURS = {_ADDED: theme.AFTER, _BEST: theme.BEFORE, _TIED: theme.ALARM, _BEHIND: theme.FAINT}


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return one panel per round that fitted candidates; None if no round did."""
    rounds = [([_row(candidate, rank, effect) for rank, candidate in enumerate(entry["ranking"])], entry["added"])
              for entry, effect in zip(result["rounds"], added_effects(result), strict=True) if entry["ranking"]]
    if not rounds:
        return None
    present = {row["status"] for rows, _ in rounds for row in rows}
    colours = {status: colour for status, colour in _COLOURS.items() if status in present}
    encoding = {**theme.series_colour(colours), "field": "status"}
    panels = [_panel(rows, encoding, f"With {phrase(figure_data, added)} added" if added else "")
              for rows, added in rounds]
    subtitle = "Improvement of the held-out log10 likelihood per experiment over the fit without the candidate."
    return theme.picture(_title(result), subtitle, {"spacing": 30, "vconcat": panels})


def _title(result: Mapping[str, Any]) -> str:
    """Return a sentence on the effect added first, and on candidates that cannot be distinguished from it."""
    ranking, (group, *_) = result["rounds"][0]["ranking"], result["answer"]["tied"] or [[]]
    named = next((candidate for candidate in ranking if group and candidate["effect"] == group[0]), None)
    if named is None:
        return f"{ranking[0]['title']} predicts best"
    tied = len(group) - 1
    verb = "predicts best" if named is ranking[0] else "explains most together with the effects added later"
    return f"{named['title']} {verb}" + (f", but {tied} more cannot be distinguished from it" if tied else "")


def _panel(rows: list[Spec], colour: Spec, title: str) -> Spec:
    y: Spec = {"field": "title", "type": "nominal", "sort": [row["title"] for row in rows], "title": None,
               "axis": {"labelLimit": 230, "ticks": False, "domain": False, "grid": True}}
    wide = max(abs(row[end]) for row in rows for end in ("low", "high")) > _WIDE
    x: Spec = {"field": "improvement", "type": "quantitative", "title": "improvement per held-out experiment [decades]",
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


def _row(candidate: Mapping[str, Any], rank: int, added: str | None) -> Spec:
    improvement, error = candidate["held_out_gain"] / _DECADE, candidate["error"] / _DECADE
    return {"title": candidate["title"], "improvement": theme.rounded(improvement, 4),
            "low": theme.rounded(improvement - 2 * error, 4), "high": theme.rounded(improvement + 2 * error, 4),
            "share": f"{100 * candidate['bootstrap_share']:.0f} %",
            "behind": f"{candidate['behind']:.1f} s.e." if rank else "",
            "bic": f"{candidate['bic']:,.0f}".replace("-", "−").replace(",", "\u202f"),
            "status": _ADDED if candidate["effect"] == added else _BEST if rank == 0 else
                      _TIED if candidate["tied"] else _BEHIND}
