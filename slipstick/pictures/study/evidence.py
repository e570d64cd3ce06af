"""What decided: the gain of each finding and its lead over rivals in standard errors, and what the blocks leave.

The intervals are those of the numbers in the report: of a gain or a lead in its own standard errors, not of the law.
"""

import math

import scipy

from slipstick.pictures import theme
from slipstick.pictures.study.words import effect_title, within
from slipstick.pictures.theme import Spec
from slipstick.studies.figures import Figures
from slipstick.studies.result import Candidate, StudyResult
from slipstick.studies.settings import StudySettings

CAPTION = ("Top, if anything was found: gain of every finding in likelihood, and its lead over each rival that the "
           "recordings do not rule out, in standard errors over engagements, with 90 % intervals. Ticks: what a "
           "finding must gain to be named, and by how much it must lead to be told apart. These are the numbers of the "
           "evidence; the shade of a measured law is the interval of its size. Blocks: reduced chi-square of each with "
           "all findings. Line: 1, if only noise is left. Dashed: from here on, at the earliest, a block counts as "
           "unexplained; one in which single engagements are far worse than the others does so anywhere.")

CERTAIN = 100.0
"""Standard errors above which no number is given: each engagement counts at most three."""
_ROW = 32  # px
_LABEL = 300  # px
_GAIN, _LEAD, _SHORT = "gain", "lead over a rival", "below the threshold"
_LEAST_AXIS = 1.35
"""Reduced chi-square up to which the axis reaches at least."""


def draw(result: StudyResult, _: Figures, settings: StudySettings) -> Spec | None:
    """Return rows of gains and leads, and of blocks; None where no block was tested."""
    if not result.blocks:
        return None
    views = [_gains(result, settings), _blocks(result, settings)] if result.findings else [_blocks(result, settings)]
    return theme.picture(_title(result), "Every mark beyond its tick or dashed line counts.", {
        "spacing": 30, "resolve": {"scale": {"color": "independent"}}, "vconcat": views})


def _title(result: StudyResult) -> str:
    left = sum(not block.is_explained for block in result.blocks)
    blocks = f"{left} of {len(result.blocks)} blocks {'is' if left == 1 else 'are'} not explained" if left else \
        f"no {'tested ' * bool(result.closed)}block is left unexplained"
    if not result.findings:
        return f"No change of any quantity reaches the thresholds, and {blocks}"
    ties = sum(bool(finding.rivals) for finding in result.findings)
    apart = "told apart from all others" if not ties else f"{ties} of them not told apart from others"
    named = f"{len(result.findings)} finding{'s' * (len(result.findings) > 1)}"
    return f"{named}, {apart}; {blocks}"


def _gains(result: StudyResult, settings: StudySettings) -> Spec:
    rows = []
    for finding in result.findings:
        rows.append(_row(finding.title, finding.errors, settings.naming.errors, _GAIN))
        rows += [_row(f"lead over {_name(rival)}", rival.behind, settings.naming.apart, _LEAD)
                 for rival in finding.rivals]
    high = max(row["high"] for row in rows)
    x: Spec = {"field": "value", "type": "quantitative", "title": "standard errors over engagements",
               "scale": {"domain": [min(0.0, *(row["low"] for row in rows)), 1.05 * high], "nice": False}}
    colours = {_GAIN: theme.AFTER, _LEAD: theme.MEASURED, _SHORT: theme.ALARM}
    return _intervals(rows, x, {name: hue for name, hue in colours.items() if name in {row["series"] for row in rows}})


def _row(label: str, value: float, least: float, series: str) -> Spec:
    value = max(-CERTAIN, min(value, CERTAIN))
    half = float(scipy.special.ndtri(0.95))
    return {"label": label, "value": theme.rounded(value), "low": theme.rounded(value - half),
            "high": theme.rounded(value + half), "least": least, "series": series if value >= least else _SHORT}


def _name(rival: Candidate) -> str:
    return within(effect_title(rival.effect)) if rival.effect else f"{rival.quantity} over {rival.depends_on}"


def _blocks(result: StudyResult, settings: StudySettings) -> Spec:
    rows: list[Spec] = [{"label": block.signals, "value": theme.rounded(block.chi_square),
                         "series": "explained" if block.is_explained else "not explained"} for block in result.blocks]
    limit = math.exp(settings.naming.errors * settings.naming.noise)
    values = [row["value"] for row in rows]
    x: Spec = {"field": "value", "type": "quantitative", "title": "reduced chi-square, logarithmic",
               "scale": {"type": "log", "domain": [min(0.9, *values), max(_LEAST_AXIS, 1.05 * max(values))],
                         "nice": False}, "axis": {"tickCount": 6, "format": ".2~f"}}
    y = _label()
    colour = {**theme.series_colour({"explained": theme.AFTER, "not explained": theme.ALARM}), "field": "series"}
    return {"width": theme.WIDTH - _LABEL, "height": _ROW * len(rows), "data": {"values": rows}, "layer": [
        *({"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT, "strokeDash": dash},
           "encoding": {"x": {"datum": at}}} for at, dash in ((1.0, []), (limit, [4, 3]))),
        {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1},
         "encoding": {"x": x, "y": y, "color": colour}}]}


def _intervals(rows: list[Spec], x: Spec, colours: dict[str, str]) -> Spec:
    y, colour = _label(), {**theme.series_colour(colours), "field": "series"}
    return {"width": theme.WIDTH - _LABEL, "height": _ROW * len(rows), "data": {"values": rows}, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"x": {"datum": 0}}},
        {"mark": {"type": "tick", "thickness": 2, "size": 20, "color": theme.INK},
         "encoding": {"x": {**x, "field": "least"}, "y": y}},
        {"mark": {"type": "rule", "strokeWidth": 2}, "encoding": {
            "x": {**x, "field": "low"}, "x2": {"field": "high"}, "y": y, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1},
         "encoding": {"x": x, "y": y, "color": colour}}]}


def _label() -> Spec:
    return {"field": "label", "type": "nominal", "title": None, "sort": None,
            "axis": {"ticks": False, "domain": False, "grid": False, "labelLimit": _LABEL}}
