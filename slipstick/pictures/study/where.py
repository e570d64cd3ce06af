"""Chi-square of the model against the test bench by block, phase and operating condition."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme
from slipstick.pictures.study.words import BLOCKS, model_series
from slipstick.pictures.theme import Spec, in_words

CAPTION = ("The model is cut at every measured signal, and each block is driven by measured inputs, so that an error "
           "of a"
           "block appears in its own row only. Each number is the mean squared residual after fitting all parameters, "
           "divided by its value for sensor noise alone. Torque that sets in too early or too late appears in the film "
           "phase: a fit that lacks an effect shifts this moment to compensate.")

_PHASES = ("fill", "film", "slip", "stick")
_CELL = (66, 36)
_UNITS = {"current_profile": "", "motor_speed": " [rad/s]", "load_inertia": " [kg m²]", "brake_torque": " [N m]",
          "run_order": ""}
_SHADES = ["#f5f2ee", "#f0b98c", "#c4552d", "#7a1f1f"]
_DARK = 30.0  # chi-square above which the text of a cell is white
_PANEL = 110
_MOST = 8  # values of a condition that fit on an axis
_FINE = 30.0  # chi-square below which the axis has ticks between powers of ten


def draw(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> Spec | None:
    """Return a matrix of blocks and phases for each model, and the worst cell by condition; None without signals."""
    misfit = figure_data["where"]
    if misfit is None:
        return None
    models = model_series(result, figure_data)
    worst = misfit["worst"]
    block = f"the block “{BLOCKS[worst['block']]}”"
    title = f"Model and test bench disagree most in {block}" if result["answer"]["effects"] else \
        f"No block indicates a missing effect: chi-square is at most {worst['chi_square']:.2g}"
    subtitle = (f"Chi-square per value; 1 corresponds to noise alone. Bottom: {block} in the {worst['phase']} phase, "
                "by condition.")
    columns = [name for name in _UNITS if 1 < len(misfit["before"]["by_condition"][name]) <= _MOST]
    above: Spec = {"spacing": 12, "hconcat": [_matrix(label, misfit[key]["chi_square"], first=key == "before")
                                              for key, (label, _) in models.items()]}
    below: Spec = {"spacing": 18, "resolve": {"scale": {"y": "shared"}}, "hconcat": [
        _by_condition(column, {label: misfit[key]["by_condition"][column] for key, (label, _) in models.items()},
                      dict(models.values()), first=column == columns[0]) for column in columns]}
    return theme.picture(title, subtitle, {"spacing": 34, "vconcat": [above, below] if columns else [above]})


def _matrix(label: str, table: Mapping[str, Mapping[str, float | None]], first: bool) -> Spec:
    rows = [{"block": BLOCKS[block], "phase": phase, "chi": theme.rounded(value, 3),
             "text": f"{value:.1f}" if value < 10 else f"{value:.0f}"}
            for block, row in table.items() for phase, value in row.items() if value is not None]
    encoding = {"x": {"field": "phase", "type": "nominal", "sort": list(_PHASES), "title": None,
                      "scale": {"domain": list(_PHASES)},
                      "axis": {"orient": "top", "labelAngle": 0, "domain": False, "ticks": False}},
                "y": {"field": "block", "type": "nominal", "sort": list(BLOCKS.values()), "title": None,
                      "scale": {"domain": list(BLOCKS.values())},
                      "axis": {"labels": first, "domain": False, "ticks": False, "labelLimit": 220}}}
    shade = {"field": "chi", "type": "quantitative", "legend": None,
             "scale": {"type": "log", "domain": [1, 10, 100, 1000], "range": _SHADES, "clamp": True}}
    ink = {"condition": {"test": f"datum.chi > {_DARK}", "value": "white"}, "value": theme.INK}
    return {"title": {"text": label, "anchor": "middle", "fontSize": 12, "fontWeight": "normal", "offset": 6},
            "width": _CELL[0] * len(_PHASES), "height": _CELL[1] * len(BLOCKS), "data": {"values": rows},
            "encoding": encoding, "layer": [
                {"mark": {"type": "rect", "stroke": "white", "strokeWidth": 2}, "encoding": {"color": shade}},
                {"mark": {"type": "text", "fontSize": 13}, "encoding": {"text": {"field": "text"}, "color": ink}}]}


def _by_condition(column: str, models: Mapping[str, list[dict[str, Any]]], colours: dict[str, str],
                  first: bool) -> Spec:
    groups = sorted(((label, group) for label, groups in models.items() for group in groups
                     if group["chi_square"] is not None), key=lambda entry: float(entry[1]["value"]))
    rows = [{"series": label, "value": _tick(column, group["value"]), "chi": theme.rounded(group["chi_square"], 4)}
            for label, group in groups]
    order = list(dict.fromkeys(row["value"] for row in rows))
    x: Spec = {"field": "value", "type": "ordinal", "sort": order, "title": f"{in_words(column)}{_UNITS[column]}",
               "axis": {"labelAngle": 0, "grid": False}}
    fine = max((group["chi_square"] for _, group in groups), default=1.0) < _FINE
    y: Spec = {"field": "chi", "type": "quantitative", "scale": {"type": "log", "nice": False, "padding": 10},
               "title": "chi-square" if first else None,
               "axis": {"values": [0.5, 1, 2, 5, 10, 20] if fine else [10**power for power in range(7)],
                        "format": "~f", "labels": first,
                        **({} if first else {"minExtent": 0})}}
    return {"width": _PANEL, "height": 120, "data": {"values": rows}, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "strokeDash": [4, 3], "color": theme.FAINT},
         "encoding": {"y": {"datum": 1}}},
        {"mark": {"type": "line", "point": {"size": 40, "filled": True}},
         "encoding": {"x": x, "y": y, "color": {**theme.series_colour(colours), "field": "series"}}}]}


def _tick(column: str, value: float) -> str:
    return ("first", "middle", "last")[int(value)] if column == "run_order" else f"{value:.3g}"
