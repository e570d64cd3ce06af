"""Two finished jobs of a kind side by side: what they are of, what they found, and their pictures."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Any

from slipstick.pictures import units
from slipstick.pictures.output import SHIFTING_TIME, Output
from slipstick.pictures.theme import in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import paragraph, section
from slipstick.report.words import duration, probability

from ..front.elements import Link, moment
from ..front.jobs import Active, Listed, describe_subject, name_of, page_of
from ..job_kind import JobKind
from .job_page import comparison_form

Row = tuple[str, str, str]
"""What is compared, and its value in both jobs."""
_NOTHING = "–"
_DIGITS = 4
"""Significant digits of estimates, those of the reports."""


@dataclass(frozen=True)
class Side:
    """A job of a comparison: its description, its answer in a sentence and its `result`."""

    job: Listed
    answer: str
    result: Mapping[str, Any]
    settings: Mapping[str, Any]
    physical: Sequence[Mapping[str, Any]] = ()
    """The fitted inputs in their units, of a fit."""
    output: Output = SHIFTING_TIME
    """What the model of a fit predicts."""


@dataclass(frozen=True)
class Pair:
    """A picture that both jobs have, as SVG elements."""

    name: str
    caption: str
    titles: tuple[str, str]
    elements: tuple[str, str]


def comparison_page(kind: JobKind[Listed, Active], jobs: Sequence[Listed], sides: tuple[Side, Side],
                    pairs: Iterable[Pair]) -> str:
    """Return the content of the page that compares two jobs; `jobs` are those to choose from."""
    rows = {"Overview": _overview(sides)}
    rows |= _ROWS[kind.name](sides)
    rows |= {"Settings that differ": _settings(sides)}
    heads = tuple(Link(name_of(side.job), page_of(side.job)).html() for side in sides)
    return "\n".join([
        paragraph("Comparison", "over"), f"<h1>Two {kind.plural} side by side</h1>",
        *(section(title, _table(heads, compared)) for title, compared in rows.items() if compared),
        section("Pictures", *(_pair(heads, pair) for pair in pairs)),
        section("Compare others", comparison_form(kind, jobs, sides[0].job.id, sides[1].job.id))])


def choice_page(kind: JobKind[Listed, Active], jobs: Sequence[Listed]) -> str:
    """Return the content of the page on which two jobs are chosen."""
    form = comparison_form(kind, jobs, jobs[1].id, jobs[0].id) if len(jobs) > 1 else \
        paragraph(f"A comparison needs two {kind.plural} that are done; there {'is' if len(jobs) == 1 else 'are'} "
                  f"{len(jobs)}.", "note")
    return f'{paragraph("Comparison", "over")}\n<h1>Compare two {kind.plural}</h1>\n{form}'


def _overview(sides: tuple[Side, Side]) -> list[Row]:
    def same_data(side: Side) -> str:
        return f"{side.job.recordings} ({str(side.job.recordings_digest)[:8]})"

    rows = [_row("answer", sides, lambda side: side.answer),
            _row("subject", sides, lambda side: describe_subject(side.job)), _row("recordings", sides, same_data),
            _row("ended", sides, lambda side: moment(side.job.ended))]
    if any(side.result.get("partial") for side in sides):
        rows.append(_row("complete", sides, lambda side: "no, the time limit ended it" if side.result.get("partial")
                         else "yes"))
    return rows


def _fit_rows(sides: tuple[Side, Side]) -> dict[str, list[Row]]:
    inputs: list[Row] = []
    for name in dict.fromkeys(entry["name"] for side in sides for entry in side.physical):
        for number, value in (("mean", "mean"), ("standard deviation", "std")):
            first, second = (_physical(side, name, value) for side in sides)
            inputs.append((f"{in_words(name)}, {number}", first, second))
    quality = [_row("log10 likelihood", sides, lambda side: _number(side.result["log10_likelihood"], 5)),
               _row("the same before the fit", sides,
                    lambda side: _number(side.result["before"]["log10_likelihood"], 5)),
               _row("output noise", sides, _noise),
               _row("outside the table", sides, lambda side: probability(side.result["mass_outside"])),
               _row("method", sides, lambda side: str(side.result["method"]))]
    return {"Fitted inputs": inputs, "Quality": quality}


def _noise(side: Side) -> str:
    shown = side.output
    return units.with_unit(units.fixed(shown.factor * side.result["output_std"], _DIGITS), shown.small)


def _physical(side: Side, name: str, value: str) -> str:
    entry = next((entry for entry in side.physical if entry["name"] == name), None)
    if entry is None:
        return _NOTHING
    unit, factor = units.scale(entry["unit"], entry["mean"])
    return units.with_unit(units.fixed(factor * entry[value], _DIGITS), unit)


def _study_rows(sides: tuple[Side, Side]) -> dict[str, list[Row]]:
    titles = dict.fromkeys(finding["title"] for side in sides for finding in side.result["findings"])
    findings = [_row(title, sides, partial(_finding, title=title)) for title in titles]
    return {"Findings": findings, "Error on held-out conditions, without and with the findings": _rows(sides, _gaps),
            "Chi-square of the blocks with the findings": _rows(sides, _blocks),
            "Parameters with the findings": _rows(sides, _parameters)}


def _calibration_rows(sides: tuple[Side, Side]) -> dict[str, list[Row]]:
    return {"Parameters": _rows(sides, _parameters), "Chi-square": _rows(sides, _misfits)}


def _misfits(side: Side) -> dict[str, str]:
    remaining = side.result.get("reduced_chi_square") or side.result["chi_square"]
    return {in_words(name): _number(value) for name, value in remaining.items()}


def _finding(side: Side, title: str) -> str:
    for finding in side.result["findings"]:
        if finding["title"] == title:
            confidence = finding.get("confidence")
            return "found" if confidence is None else f"found, confidence {confidence:.2f}"
    return "not found"


def _parameters(side: Side) -> dict[str, str]:
    """Each parameter: in its unit with its interval, or of a study of a bench relative to its nominal value."""
    given = side.result.get("parameters")
    if isinstance(given, Mapping):
        return {in_words(name): _estimate(entry["value"], entry["interval"][0], entry["interval"][1], entry["unit"])
                for name, entry in given.items()}
    if given is not None:
        return {entry["name"]: _estimate(entry["value"], entry["lower"], entry["upper"], entry["unit"])
                for entry in given}
    fit = side.result.get("after") or side.result.get("before")
    return {} if fit is None else {
        in_words(name): f"{units.signed(100 * value)} %" for name, value in fit["parameters"].items()}


def _estimate(value: float, lower: float, upper: float, unit: str) -> str:
    """A parameter with its interval, in the unit that suits its size."""
    shown, factor = units.scale(unit, value)
    low, middle, high = (units.fixed(factor * number, _DIGITS) for number in (lower, value, upper))
    return units.with_unit(f"{middle} ({low} to {high})", shown)


def _blocks(side: Side) -> dict[str, str]:
    return {f"{block['name']}: {block['signals']}": _number(block["chi_square"]) for block in side.result["blocks"]}


def _gaps(side: Side) -> dict[str, str]:
    gap = side.result.get("gap")
    if gap is None:
        return {}
    if "closures" not in gap:  # of a declared machine
        left = f"{_number(gap['before'])} to {_number(gap['after'])} squared residuals beyond noise"
        return {"whole machine": left if gap["converged"] else "a fit did not converge"}
    return {in_words(name): _closure(name, closure) for name, closure in gap["closures"].items()}


def _closure(name: str, closure: Mapping[str, Any]) -> str:
    factor, unit = (1e3, "ms") if name == "shifting_time" else (1.0, units.raised(SIGNAL_UNITS.get(name, "")))
    before, after = (_number(factor * closure[f"rms_{which}"]) for which in ("before", "after"))
    return units.with_unit(f"{before} to {after}", unit)


def _settings(sides: tuple[Side, Side]) -> list[Row]:
    flat = [dict(_flatten(side.settings)) for side in sides]
    budgets = [side.job.time_budget for side in sides]
    rows = [(in_words(name), *(_written(each.get(name)) for each in flat)) for name in {**flat[0], **flat[1]}
            if flat[0].get(name) != flat[1].get(name)]
    if budgets[0] != budgets[1]:
        rows.append(("time limit", *("none" if budget is None else duration(budget) for budget in budgets)))
    return [(name, first, second) for name, first, second in rows]


def _flatten(settings: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{prefix}{name}, ")
        else:
            yield f"{prefix}{name}", value


def _written(value: Any) -> str:
    return _NOTHING if value is None else ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _number(value: float | None, digits: int = 3) -> str:
    return _NOTHING if value is None else units.number(value, digits)


def _row(name: str, sides: tuple[Side, Side], value: Callable[[Side], str]) -> Row:
    return name, value(sides[0]), value(sides[1])


def _rows(sides: tuple[Side, Side], read: Callable[[Side], Mapping[str, str]]) -> list[Row]:
    """A row for each name of what is read of both sides."""
    first, second = (read(side) for side in sides)
    return [(name, first.get(name, _NOTHING), second.get(name, _NOTHING)) for name in {**first, **second}]


def _table(heads: Sequence[str], rows: Iterable[Row]) -> str:
    """A table of which the rows that differ are marked."""
    body = "\n".join(
        f'<tr{" class=differs" * (first != second)}><th scope="row">{escape(name)}</th><td>{escape(first)}</td>'
        f"<td>{escape(second)}</td></tr>" for name, first, second in rows)
    return (f'<table class="sides"><thead><tr><td></td><th scope="col">{heads[0]}</th><th scope="col">{heads[1]}</th>'
            f"</tr></thead><tbody>\n{body}\n</tbody></table>")


def _pair(heads: Sequence[str], pair: Pair) -> str:
    panels = "".join(f'<div><p class="note">{head}: {escape(title)}</p><div class="picture" tabindex="0">{element}'
                     "</div></div>" for head, title, element in zip(heads, pair.titles, pair.elements, strict=True))
    return (f'<figure class="pair"><h3>{escape(in_words(pair.name).capitalize())}</h3><div class="panels">{panels}'
            f"</div><figcaption>{escape(pair.caption)}</figcaption></figure>")


_ROWS: Mapping[str, Callable[[tuple[Side, Side]], dict[str, list[Row]]]] = {
    "fit": _fit_rows, "study": _study_rows, "calibration": _calibration_rows}
