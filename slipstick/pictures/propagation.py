"""Distributions of propagated shifting times, one row for each condition: density, quantiles, and Sobol indices."""

from collections.abc import Mapping, Sequence
from typing import Any

from slipstick.pictures import theme, units
from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec

MOST = 24
"""Largest number of conditions in a picture."""
_WIDTH, _SOBOL, _HEIGHT = 420, 150, 84
_FIRST, _TOTAL = "alone (first order)", "with interactions (total)"
_DOMINANT = 0.5
"""First-order index from which on an input causes most of a variance."""


def caption(answer: Mapping[str, Any], probabilities: Sequence[float]) -> str:
    """Return what is drawn of an answer: its density, quantiles and shares where it has them."""
    rows = [row for row in answer["conditions"] if row["mean"] is not None]
    has_shares, has_density = any(row["total"] for row in rows), any(row["density"] for row in rows)
    marks = [*(["curve: predicted density, with the output noise"] if has_density else []),
             *(["dashed lines: quantiles"] if probabilities else []), "dot: mean",
             "bar: one standard deviation to either side"]
    left = "; ".join(marks)
    return " ".join([
        "One row for each condition.", f"Left, {left}." if has_shares else f"{left[0].upper()}{left[1:]}.",
        *(["Right: share of the variance that each input causes alone (first-order Sobol index, solid) and together "
           "with all others (total, light), without the output noise. Where the light bar is well above the solid one, "
           "inputs act together, and the shares do not add to one."] if has_shares else []),
        *([f"The first {MOST} of {len(rows)} conditions are shown."] if len(rows) > MOST else [])])


def summarize(answer: Mapping[str, Any]) -> str:
    """The result of all conditions in a sentence without its full stop: the title of the picture."""
    rows = [row for row in answer["conditions"] if row["mean"] is not None]
    return _title(rows, [axis["name"] for axis in answer["axes"]], Output.of(answer))


def missing_runs(shown: Output, outside: str) -> str:
    """Which runs leave a condition without an expansion, in words; `outside` is the policy outside the table."""
    return (f"model runs, at nodes of the expansion or to check its error, that {shown.missing}"
            + ", or lie outside the table" * (outside == "nan"))


def draw(answer: Mapping[str, Any], probabilities: Sequence[float], conditions: Columns, part: int = MOST) -> Spec:
    """Return the picture of an answer to a propagation, of its first `MOST` conditions that have a distribution.

    The axes have titles below the last one, and below each `part` of so many rows.

    `answer` has the `axes` (name), and for each of its `conditions` their index, `mean` and `std` in s, `quantiles` in
    s at the `probabilities`, and, or null, `first_order` and `total` for each axis and `density` over `density_time`.
    `conditions` are their columns, in the order of the answer. An answer for another machine has name and unit of its
    `output`.
    """
    axes = [axis["name"] for axis in answer["axes"]]
    rows = [(place, row) for place, row in enumerate(answer["conditions"]) if row["mean"] is not None]
    omitted = len(answer["conditions"]) - len(rows)
    drawn, shown = rows[:MOST], Output.of(answer)
    titles = [f"{row['condition']}: {described(conditions, place)}" for place, row in drawn]
    views = [_row(row, probabilities, axes, title, shown, number == len(drawn) or number % part == 0)
             for number, ((_, row), title) in enumerate(zip(drawn, titles, strict=True), 1)]
    levels = ", ".join(f"{100 * probability:g} %" for probability in probabilities)
    return theme.picture(
        summarize(answer),
        (f"Lines: quantiles at {levels}. " if levels else "")
        + ("" if any(row["total"] for row in answer["conditions"])  # also where no condition has an expansion
           else "Without Sobol indices, because the inputs are dependent. ")
        + (f"Not drawn: {omitted} without an expansion: there are {missing_runs(shown, answer['outside'])}."
           if omitted else ""),
        {"spacing": 18, "vconcat": views}, caption(answer, probabilities))


def _title(rows: Sequence[Mapping[str, Any]], axes: Sequence[str], shown: Output) -> str:
    if not rows:
        return "No condition has a distribution"
    if len(rows) == 1:
        row = rows[0]
        mean, std = (units.with_unit(units.fixed(shown.factor * row[name], digits), shown.small)
                     for name, digits in (("mean", 4), ("std", 3)))
        does = "locks at" if shown.name == "shifting_time" else f"has a {shown.words} of"
        return f"Condition {row['condition']} {does} {mean}, with a standard deviation of {std}"
    stds = [shown.factor * row["std"] for row in rows]
    least, most = units.fixed(min(stds)), units.fixed(max(stds))
    text = f"Standard deviations of {least} to {units.with_unit(most, shown.small)} in {len(rows)} conditions"
    shares = [row["first_order"] for row in rows if row["first_order"]]
    counts = [sum((share[axis] or 0.0) >= _DOMINANT for share in shares) for axis in range(len(axes))]
    best = max(range(len(axes)), key=lambda axis: counts[axis])
    if not counts[best]:
        return text
    where = "all" if counts[best] == len(rows) else f"{counts[best]}"
    return f"{text}; the {theme.in_words(axes[best])} causes most of the variance in {where} of them"


def _row(row: Mapping[str, Any], probabilities: Sequence[float], axes: Sequence[str], title: str, shown: Output,
         last: bool) -> Spec:
    views = [_density(row, probabilities, shown, last)]
    if row["total"] is not None:
        views.append(_shares(row, axes, last))
    return {"title": {"text": title, "fontSize": 12, "fontWeight": "normal", "offset": 6, "anchor": "start"},
            "spacing": 40, "hconcat": views}


def _density(row: Mapping[str, Any], probabilities: Sequence[float], shown: Output, last: bool) -> Spec:
    x: Spec = {"field": "t", "type": "quantitative", "scale": {"zero": False, "nice": False, "padding": 6},
               "title": f"{shown.words} [{shown.small}]" if last else None, "axis": {"grid": False, "tickCount": 8}}
    y: Spec = {"type": "quantitative", "axis": None}
    mean, std = shown.factor * row["mean"], shown.factor * row["std"]
    center = {"t": theme.rounded(mean, 6), "low": theme.rounded(mean - std, 6), "high": theme.rounded(mean + std, 6),
              "std": theme.rounded(std, 4)}
    layers: list[Spec] = []
    if row["density"]:
        rows = [{"t": theme.rounded(shown.factor * t, 6), "p": theme.rounded(p)} for t, p in
                zip(row["density_time"], row["density"], strict=True) if t is not None]
        layers.append({"data": {"values": rows}, "encoding": {"x": x, "y": {**y, "field": "p"}},
                       "mark": {"type": "area", "color": theme.AFTER, "opacity": 0.3, "line": {
                           "color": theme.AFTER, "strokeWidth": 1.4}}})
    lines = [{"t": theme.rounded(shown.factor * value, 6), "level": f"{100 * level:g} %"}
             for level, value in zip(probabilities, row["quantiles"], strict=True) if value is not None]
    return {"width": _WIDTH, "height": _HEIGHT, "layer": [
        *layers,
        {"data": {"values": lines}, "mark": {"type": "rule", "color": theme.MEASURED, "strokeDash": [4, 3]},
         "encoding": {"x": x, "tooltip": [{"field": "level", "type": "nominal"}]}},
        {"data": {"values": [center]}, "mark": {"type": "rule", "color": theme.INK, "strokeWidth": 2.5},
         "encoding": {"x": {**x, "field": "low"}, "x2": {"field": "high"}, "y": {"value": _HEIGHT - 8}}},
        {"data": {"values": [center]}, "mark": {"type": "point", "filled": True, "size": 60, "color": theme.INK,
                                                "opacity": 1},
         "encoding": {"x": x, "y": {"value": _HEIGHT - 8}, "tooltip": [
             {"field": "t", "type": "quantitative", "title": f"mean [{shown.small}]"},
             {"field": "std", "type": "quantitative", "title": f"std [{shown.small}]"}]}}]}


def _shares(row: Mapping[str, Any], axes: Sequence[str], last: bool) -> Spec:
    rows = [{"input": theme.in_words(axis), "first": theme.rounded(row["first_order"][place]),
             "total": theme.rounded(row["total"][place]), "kind": kind}
            for kind in (_FIRST, _TOTAL) for place, axis in enumerate(axes)]
    x: Spec = {"type": "quantitative", "scale": {"domain": [0, 1]}, "title": "share of the variance" if last else None,
               "axis": {"tickCount": 4}}
    y = {"field": "input", "type": "nominal", "title": None, "sort": None,
         "axis": {"ticks": False, "domain": False, "labelLimit": 160}}
    colour = {**theme.series_colour({_FIRST: theme.AFTER, _TOTAL: theme.SHADES[3]}), "field": "kind"}
    return {"width": _SOBOL, "height": _HEIGHT, "data": {"values": rows}, "encoding": {"y": y, "color": colour},
            "layer": [
                {"transform": [{"filter": f"datum.kind == '{_TOTAL}'"}],
                 "mark": {"type": "bar", "height": {"band": 0.62}}, "encoding": {"x": {**x, "field": "total"}}},
                {"transform": [{"filter": f"datum.kind == '{_FIRST}'"}],
                 "mark": {"type": "bar", "height": {"band": 0.34}}, "encoding": {"x": {**x, "field": "first"}}}]}
