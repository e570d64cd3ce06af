"""Where model and bench disagree: chi-square by block, phase and operating condition."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import BLOCKS, models
from slipstick.pictures.theme import Spec, plain

CAPTION = ("The model is cut at every measured signal, and each block is driven by what was measured, so that a block "
           "that is wrong shows in its own row. Each number is the mean square of what is left over what sensor noise "
           "would leave there; the parameters have already done what they can. Torque that sets in too early or too "
           "late shows in the film phase: a fit that lacks something moves that moment to make up for it.")

_PHASES = ("fill", "film", "slip", "stick")
_CELL = (66, 36)
_UNITS = {"current_profile": "", "motor_speed": " [rad/s]", "load_inertia": " [kg m²]", "brake_torque": " [N m]",
          "run_order": ""}
_SHADES = ["#f5f2ee", "#f0b98c", "#c4552d", "#7a1f1f"]
_DARK = 30.0  # times the noise: the cell takes white letters
_PANEL = 110
_MOST = 8  # values of a condition that can be read side by side
_FINE = 30.0  # times the noise: up to there the axis counts finer than in tens


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """A matrix of blocks and phases for each model, and the worst cell by condition; None without signals."""
    shown = figure_data["where"]
    if shown is None:
        return None
    who = models(result, figure_data)
    worst = shown["worst"]
    block = f"the block “{BLOCKS[worst['block']]}”"
    title = f"Model and bench disagree most in {block}" if result["answer"]["effects"] else \
        f"Nothing that asks for an effect: {worst['chi_square']:.2g} times the noise at most"
    subtitle = (f"Mean square of what is left; 1 is what noise would leave. Below: {block}, {worst['phase']} phase, by "
                "condition.")
    columns = [name for name in _UNITS if 1 < len(shown["before"]["by_condition"][name]) <= _MOST]
    above: Spec = {"spacing": 12, "hconcat": [_matrix(name, shown[key]["chi_square"], first=key == "before")
                                              for key, (name, _) in who.items()]}
    below: Spec = {"spacing": 18, "resolve": {"scale": {"y": "shared"}}, "hconcat": [
        _by(column, {name: shown[key]["by_condition"][column] for key, (name, _) in who.items()}, dict(who.values()),
            first=column == columns[0]) for column in columns]}
    return theme.picture(title, subtitle, {"spacing": 34, "vconcat": [above, below] if columns else [above]})


def _matrix(name: str, table: Mapping[str, Mapping[str, float | None]], first: bool) -> Spec:
    rows = [{"block": BLOCKS[block], "phase": phase, "chi": theme.number(value, 3),
             "shown": f"{value:.1f}" if value < 10 else f"{value:.0f}"}
            for block, row in table.items() for phase, value in row.items() if value is not None]
    place = {"x": {"field": "phase", "type": "nominal", "sort": list(_PHASES), "title": None,
                   "scale": {"domain": list(_PHASES)},
                   "axis": {"orient": "top", "labelAngle": 0, "domain": False, "ticks": False}},
             "y": {"field": "block", "type": "nominal", "sort": list(BLOCKS.values()), "title": None,
                   "scale": {"domain": list(BLOCKS.values())},
                   "axis": {"labels": first, "domain": False, "ticks": False, "labelLimit": 220}}}
    shade = {"field": "chi", "type": "quantitative", "legend": None,
             "scale": {"type": "log", "domain": [1, 10, 100, 1000], "range": _SHADES, "clamp": True}}
    ink = {"condition": {"test": f"datum.chi > {_DARK}", "value": "white"}, "value": theme.INK}
    return {"title": {"text": name, "anchor": "middle", "fontSize": 12, "fontWeight": "normal", "offset": 6},
            "width": _CELL[0] * len(_PHASES), "height": _CELL[1] * len(BLOCKS), "data": {"values": rows},
            "encoding": place, "layer": [
                {"mark": {"type": "rect", "stroke": "white", "strokeWidth": 2}, "encoding": {"color": shade}},
                {"mark": {"type": "text", "fontSize": 13}, "encoding": {"text": {"field": "shown"}, "color": ink}}]}


def _by(column: str, models: Mapping[str, list[dict[str, Any]]], colours: dict[str, str], first: bool) -> Spec:
    known = sorted(((who, one) for who, groups in models.items() for one in groups if one["chi_square"] is not None),
                   key=lambda entry: float(entry[1]["value"]))
    rows = [{"who": who, "value": _said(column, one["value"]), "chi": theme.number(one["chi_square"], 4)}
            for who, one in known]
    order = list(dict.fromkeys(row["value"] for row in rows))
    x: Spec = {"field": "value", "type": "ordinal", "sort": order, "title": f"{plain(column)}{_UNITS[column]}",
         "axis": {"labelAngle": 0, "grid": False}}
    fine = max((one["chi_square"] for _, one in known), default=1.0) < _FINE
    y: Spec = {"field": "chi", "type": "quantitative", "scale": {"type": "log", "nice": False, "padding": 10},
               "title": "chi-square" if first else None,
               "axis": {"values": [0.5, 1, 2, 5, 10, 20] if fine else [10**power for power in range(7)],
                        "format": "~f", "labels": first,
                        **({} if first else {"minExtent": 0})}}
    return {"width": _PANEL, "height": 120, "data": {"values": rows}, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT},
         "encoding": {"y": {"datum": 1}}},
        {"mark": {"type": "line", "point": {"size": 40, "filled": True}},
         "encoding": {"x": x, "y": y, "color": {**theme.whose(colours), "field": "who"}}}]}


def _said(column: str, value: float) -> str:
    return ("first", "middle", "last")[int(value)] if column == "run_order" else f"{value:.3g}"
