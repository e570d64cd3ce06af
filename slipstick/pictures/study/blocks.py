"""What is left in the blocks of the model with all findings."""

import math

from slipstick.pictures import theme
from slipstick.pictures.study.evidence import LABEL, ROW, label_axis
from slipstick.pictures.theme import Spec
from slipstick.studies.figures import Figures
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings

_CAPTION = ("Reduced chi-square of each block{0}. Line: 1, if only noise is left. Dashed: from here on, at the "
            "earliest, a block counts as unexplained; one in which single engagements are far worse than the others "
            "does so anywhere.")
_LEAST_AXIS = 1.35
"""Reduced chi-square up to which the axis reaches at least."""


def draw(result: StudyResult, _: Figures, settings: StudySettings) -> Spec | None:
    """Return a row for each block; None where no block was tested."""
    if not result.blocks:
        return None
    rows: list[Spec] = [{"label": block.signals, "value": theme.rounded(block.chi_square),
                         "series": "explained" if block.is_explained else "not explained"} for block in result.blocks]
    limit = math.exp(settings.naming.errors * settings.naming.noise)
    values = [row["value"] for row in rows]
    x: Spec = {"field": "value", "type": "quantitative", "title": "reduced chi-square, logarithmic",
               "scale": {"type": "log", "domain": [min(0.9, *values), max(_LEAST_AXIS, 1.05 * max(values))],
                         "nice": False}, "axis": {"tickCount": 6, "format": ".2~f"}}
    y, shown = label_axis(), {row["series"] for row in rows}
    colours = {name: hue for name, hue in (("explained", theme.AFTER), ("not explained", theme.ALARM)) if name in shown}
    colour = {**theme.series_colour(colours), "field": "series"}
    return theme.picture(_title(result), "Every mark beyond the dashed line counts.", {
        "width": theme.WIDTH - LABEL, "height": ROW * len(rows), "data": {"values": rows}, "layer": [
            *({"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT, "strokeDash": dash},
               "encoding": {"x": {"datum": at}}} for at, dash in ((1.0, []), (limit, [4, 3]))),
            {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1},
             "encoding": {"x": x, "y": y, "color": colour}}]}, _CAPTION.format(
                 " with all findings" * bool(result.findings)))


def _title(result: StudyResult) -> str:
    left = sum(not block.is_explained for block in result.blocks)
    if left:
        return f"{left} of {len(result.blocks)} blocks {'is' if left == 1 else 'are'} not explained"
    return f"No {'tested ' * bool(result.closed)}block is left unexplained"
