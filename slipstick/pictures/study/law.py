"""The measured law of every finding with its band, and the formula of the catalogue beside it."""

import textwrap
from collections.abc import Sequence

from slipstick.pictures import theme, units
from slipstick.pictures.study.words import argument, changed, subject
from slipstick.pictures.theme import Spec
from slipstick.studies.figures import Figures
from slipstick.studies.finding import Changed
from slipstick.studies.result import Law, StudyResult
from slipstick.studies.settings import StudySettings

_DOTS = "Dots: the change as it is measured in all {0} at once, without a formula."
_BAND = "Shade: its interval at each point."
_BLUE = "Blue: the same change by the formula of the effect, with the coefficients that the report states."
_PART = "Where a law is known up to a constant or a straight line, parameters of the model take that part as well{0}."
_FITTED_PART = ", and the same part of the formula is fitted to the dots"
_BAR = "Dot and bar: a law that is a single number, with its interval."

_HEIGHT, _SEVERAL = 300, 220  # px, of one law and of each of several
_NUMBER = 44  # px, of a law that is a single number
_MEASURED, _FORMULA = "measured", "formula of the effect"
_BEYOND = 0.15
"""Share of the span of the law by which the drawn range may exceed it for points that are hardly known."""
_MONOTONIC = 0.8  # share of the span between first and last point above which a law rises or falls
_COLUMNS = 100  # characters per line
_UP_TO = {"constant": "Known up to a constant, which parameters of the model take as well: drawn about its mean.",
          "line": "Known up to a straight line, which parameters of the model take as well.", "nothing": ""}
_ZERO = ("It contains zero: how large the change is remains open, because parameters may take its part. The "
         "evidence for it is the gain in likelihood.")
_LINEARISED = "The interval is that of a linear model and may be several times too narrow."


def draw(result: StudyResult, _: Figures, settings: StudySettings) -> Spec | None:
    """Return a panel for each finding with a law; None without one."""
    return draw_laws(result.findings, settings.level, "engagements")


def draw_laws(findings: Sequence[Changed], level: float, runs: str) -> Spec | None:
    """Return a panel for each of the findings that has a law; None without one. `runs` is what was recorded."""
    laws = [(finding, finding.law) for finding in findings if finding.law is not None]
    if not laws:
        return None
    if len(laws) == 1:
        return draw_law(*laws[0], level, runs)
    panels = [{"title": {"text": headline(finding, law), "fontSize": 13, "offset": 8,
                         "subtitle": textwrap.wrap(remarks(law, level), _COLUMNS)},
               **_panel(finding, law, _SEVERAL)} for finding, law in laws]
    return theme.picture(f"The recordings show {len(laws)} laws", "One panel for each finding.",
                         {"spacing": 30, "vconcat": panels}, _caption([law for _, law in laws], runs))


def draw_law(finding: Changed, law: Law, level: float, runs: str = "engagements") -> Spec:
    """Return the law of one finding, with its band of confidence `level`."""
    return theme.picture(headline(finding, law), remarks(law, level), _panel(finding, law, _HEIGHT),
                         _caption([law], runs))


def _caption(laws: Sequence[Law], runs: str) -> str:
    """Return what the drawn parts are; a part that no law has is not spoken of."""
    curves = [law for law in laws if law.x is not None]
    has_formula = any(law.formula is not None for law in curves)
    has_part = any(law.up_to != "nothing" for law in curves)
    return " ".join([*([_DOTS.format(runs), _BAND] if curves else []), *([_BLUE] if has_formula else []),
                     *([_PART.format(_FITTED_PART * has_formula)] if has_part else []),
                     *([_BAR] if len(curves) < len(laws) else [])])


def headline(finding: Changed, law: Law) -> str:
    """The law in one sentence."""
    unit, factor = _choose_unit(law)
    if law.x is None or (finding.depends_on == "gain" and law.relative):  # a share, which is the same at all readings
        size = factor * sum(law.change) / len(law.change)
        text = units.number(size) if finding.depends_on == "lag" else units.signed(size)
        return f"{finding.title}: {units.with_unit(text, unit)}"
    if law.up_to == "line":
        return f"The {subject(finding)} varies with the {argument(finding)}, other than by a straight line"
    change, net = describe_change(law, law.change)
    if not net:
        return f"The {subject(finding)} varies by {change} with the {argument(finding)}"
    return (f"The {subject(finding)} {'rises' if net > 0 else 'falls'} by {change} as the {argument(finding)} grows "
            f"{describe_range(law)}")


def describe_change(law: Law, values: Sequence[float]) -> tuple[str, int]:
    """Return by how much the `values` of a law change over its known points, and whether they rise (1) or fall (-1).

    They are those of the measured law or of its formula; 0 stands for a change that goes to and fro. What is relative
    and known up to a constant has no reference beside the law itself: its change is a share of its first known value,
    which does not depend on the constant.
    """
    unit, factor = _choose_unit(law)
    known = [values[place] for place in _select_known(law)]
    of_itself = law.relative and law.up_to == "constant"
    if of_itself:
        known = [(1 + value) / (1 + known[0]) - 1 for value in known]
    span, net = max(known) - min(known), known[-1] - known[0]
    size = units.with_unit(units.number(factor * span), unit) + " of the model's value" * (
        law.relative and not of_itself)
    return size, 0 if abs(net) < _MONOTONIC * span else 1 if net > 0 else -1


def describe_range(law: Law) -> str:
    """Return the range of the points over which the law is known."""
    assert law.x is not None
    points = [law.x[place] for place in _select_known(law)]
    unit, factor = units.scale(law.x_unit, max(map(abs, law.x)))
    return f"from {units.number(factor * points[0])} to " + units.with_unit(units.number(factor * points[-1]), unit)


def remarks(law: Law, level: float, is_drawn: bool = True) -> str:
    """What the band is, where it is drawn or that of a single number, and what it and the law leave open."""
    interval, zero = f"Shade: {100 * level:.0f} % interval at each point." if is_drawn else "", ""
    if law.x is None:
        unit, factor = _choose_unit(law)
        ends = f"{units.fixed(factor * law.lower[0])} to {units.fixed(factor * law.upper[0])}"
        interval = f"{100 * level:.0f} % interval of the size: {units.with_unit(ends, unit)}."
        zero = _ZERO if law.lower[0] <= 0 <= law.upper[0] else ""
    sentences = (interval, zero, _UP_TO[law.up_to], _LINEARISED if law.linearised else "")
    return " ".join(sentence for sentence in sentences if sentence)


def _select_known(law: Law) -> list[int]:
    """The places of points whose interval is no wider than the span of the law; of all if these are too few."""
    span = max(law.change) - min(law.change)
    known = [place for place, (low, high) in enumerate(zip(law.lower, law.upper, strict=True)) if high - low <= span]
    return known if len(known) > 1 else list(range(len(law.change)))


def _choose_unit(law: Law) -> tuple[str, float]:
    """The unit in which changes are shown, and the factor to it."""
    return units.scale(law.unit, max(map(abs, law.change)), law.relative)


def _panel(finding: Changed, law: Law, height: int) -> Spec:
    if law.x is None:
        return _single(finding, law)
    unit, factor = _choose_unit(law)
    x_unit, x_factor = units.scale(law.x_unit, max(map(abs, law.x)))
    x: Spec = {"field": "x", "type": "quantitative", "title": _axis(argument(finding), x_unit),
               "axis": {"grid": False, "tickCount": 10}, "scale": {"nice": False, "zero": False, "padding": 6}}
    y: Spec = {"field": "y", "type": "quantitative", "title": _axis(changed(finding), unit),
               "scale": {"domain": _domain(law, factor), "nice": False}}
    colour = theme.series_colour({_MEASURED: theme.MEASURED, _FORMULA: theme.AFTER} if law.formula else
                                 {_MEASURED: theme.MEASURED})
    columns = {"y": law.change, "low": law.lower, "high": law.upper}
    rows = [{"x": theme.rounded(x_factor * at), **{name: theme.rounded(factor * values[place])
                                                  for name, values in columns.items()}}
            for place, at in enumerate(law.x)]
    measured = {**colour, "datum": _MEASURED}
    layers: list[Spec] = [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"y": {"datum": 0}}},
        {"mark": {"type": "area", "color": theme.MEASURED, "opacity": 0.16, "clip": True},
         "encoding": {"x": x, "y": {**y, "field": "low"}, "y2": {"field": "high"}}},
        {"mark": {"type": "line", "strokeWidth": 1.2, "clip": True},
         "encoding": {"x": x, "y": y, "color": measured}},
        {"mark": {"type": "point", "filled": True, "size": 34, "opacity": 1, "clip": True},
         "encoding": {"x": x, "y": y, "color": measured}}]
    if law.formula is not None:
        curve = [{"x": theme.rounded(x_factor * at), "y": theme.rounded(factor * value)}
                 for at, value in zip(law.x, law.formula, strict=True)]
        layers.insert(2, {"data": {"values": curve}, "mark": {"type": "line", "strokeWidth": 3.2, "clip": True},
                          "encoding": {"x": x, "y": y, "color": {**colour, "datum": _FORMULA}}})
    return {"width": theme.WIDTH, "height": height, "data": {"values": rows}, "layer": layers}


def _single(finding: Changed, law: Law) -> Spec:
    """Return an interval on an axis that contains 0."""
    unit, factor = _choose_unit(law)
    row = {name: theme.rounded(factor * values[0])
           for name, values in (("x", law.change), ("low", law.lower), ("high", law.upper))}
    x: Spec = {"field": "x", "type": "quantitative", "title": _axis(finding.title, unit),
               "scale": {"zero": True, "padding": 12}, "axis": {"tickCount": 10}}
    return {"width": theme.WIDTH, "height": _NUMBER, "data": {"values": [row]}, "layer": [
        {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT}, "encoding": {"x": {"datum": 0}}},
        {"mark": {"type": "rule", "strokeWidth": 3, "color": theme.MEASURED},
         "encoding": {"x": {**x, "field": "low"}, "x2": {"field": "high"}}},
        {"mark": {"type": "point", "filled": True, "size": 90, "opacity": 1, "color": theme.MEASURED},
         "encoding": {"x": x}}]}


def _axis(name: str, unit: str) -> str:
    return name if unit in ("", "1") else f"{name} [{unit}]"


def _domain(law: Law, factor: float) -> list[float | None]:
    """Return the drawn range: 0, the law and its formula, their band, and little of the band of points hardly known."""
    values = [0.0, *law.change, *(law.formula or []),
              *(band[place] for band in (law.lower, law.upper) for place in _select_known(law))]
    low, high = min(values), max(values)
    margin = _BEYOND * (high - low)
    low, high = max(min(*law.lower, low), low - margin), min(max(*law.upper, high), high + margin)
    edge = 0.04 * (high - low)
    return [theme.rounded(factor * (low - edge)), theme.rounded(factor * (high + edge))]
