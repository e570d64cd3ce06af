"""What decided: the gain of each finding and its lead over the next explanations, in standard errors.

The intervals are those of the numbers in the report: of a gain or a lead in its own standard errors, not of the law.
"""

import scipy

from slipstick.pictures import theme
from slipstick.pictures.study.words import name_candidate
from slipstick.pictures.theme import Spec
from slipstick.studies.figures import Figures
from slipstick.studies.result import Candidate, FindingResult, StudyResult
from slipstick.studies.settings import StudySettings

_CAPTION = ("By how many standard errors over engagements {0} gains in likelihood, and leads over {1}, with 90 % "
            "intervals. Ticks: what is needed to be named, and to be told apart. {2}These are the numbers of the "
            "evidence, not the interval of the measured law.")
_CUT = "A dot at 100 stands for 100 or more. "

CERTAIN = 100.0
"""Standard errors above which no number is given: each engagement counts at most three."""
ROW, LABEL = 32, 300
"""Height of a row and width of its label in px."""
_GAIN, _LEAD, _SHORT = "gain", "lead", "below the threshold"


def draw(result: StudyResult, _: Figures, settings: StudySettings) -> Spec | None:
    """Return rows of gains and leads; None where no finding has another explanation to be compared with."""
    rows = []
    for finding in result.findings:
        rows.append(_row(finding.title, finding.errors, settings.naming.errors, _GAIN))
        rows += [_row(f"lead over {name_candidate(other)}", other.behind, settings.naming.apart, _LEAD)
                 for other in _list_others(finding)]
    if len(rows) == len(result.findings):
        return None
    x: Spec = {"field": "value", "type": "quantitative", "title": "standard errors over engagements", "scale": {
        "domain": [min(0.0, *(row["low"] for row in rows)), 1.05 * max(row["high"] for row in rows)], "nice": False}}
    colours = {_GAIN: theme.AFTER, _LEAD: theme.MEASURED, _SHORT: theme.ALARM}
    used = {row["series"] for row in rows}
    is_cut = any(abs(row["value"]) == CERTAIN for row in rows)
    others = "each rival" if any(finding.rivals for finding in result.findings) else "the next best explanation"
    return theme.picture(_title(result), "Every mark beyond its tick counts.", _intervals(
        rows, x, {name: hue for name, hue in colours.items() if name in used}), _CAPTION.format(
            "the finding" if len(result.findings) == 1 else "each finding", others, _CUT * is_cut))


def _list_others(finding: FindingResult) -> list[Candidate]:
    """The rivals of a finding, or else the next best explanation."""
    return finding.rivals or ([finding.next_best] if finding.next_best else [])


def _title(result: StudyResult) -> str:
    ties, named = sum(bool(finding.rivals) for finding in result.findings), len(result.findings)
    if named == 1:
        return "The finding is not told apart from its rivals" if ties else \
            "The finding is told apart from the next best explanation"
    return f"{named} findings, {f'{ties} of them not told apart from others' if ties else 'told apart from all others'}"


def _row(label: str, value: float, least: float, series: str) -> Spec:
    value = max(-CERTAIN, min(value, CERTAIN))
    half = float(scipy.special.ndtri(0.95))
    return {"label": label, "value": theme.rounded(value), "low": theme.rounded(value - half),
            "high": theme.rounded(value + half), "least": least, "series": series if value >= least else _SHORT}


def _intervals(rows: list[Spec], x: Spec, colours: dict[str, str]) -> Spec:
    y, colour = label_axis(), {**theme.series_colour(colours), "field": "series"}
    return {"width": theme.WIDTH - LABEL, "height": ROW * len(rows), "data": {"values": rows}, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"x": {"datum": 0}}},
        {"mark": {"type": "tick", "thickness": 2, "size": 20, "color": theme.INK},
         "encoding": {"x": {**x, "field": "least"}, "y": y}},
        {"mark": {"type": "rule", "strokeWidth": 2}, "encoding": {
            "x": {**x, "field": "low"}, "x2": {"field": "high"}, "y": y, "color": colour}},
        {"mark": {"type": "point", "filled": True, "size": 75, "opacity": 1},
         "encoding": {"x": x, "y": y, "color": colour}}]}


def label_axis() -> Spec:
    """Return the encoding of rows with labels."""
    return {"field": "label", "type": "nominal", "title": None, "sort": None,
            "axis": {"ticks": False, "domain": False, "grid": False, "labelLimit": LABEL}}
