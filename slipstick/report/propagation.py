"""The page of a propagation: warnings, the distributions as table and picture, and where they come from; its text."""

from collections.abc import Mapping, Sequence
from typing import Any

from slipstick import __version__
from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.output import Output
from slipstick.pictures.propagation import MOST, caption, draw, summarize
from slipstick.pictures.theme import in_words
from slipstick.report.markup import definitions, paragraph, section, table
from slipstick.report.shell import document, figures
from slipstick.report.words import listed, number, signed

_NOTE = ("Std and quantiles contain the output noise. Alone, total: first-order and total Sobol index, the share of "
         "the variance without noise that the input causes alone and with interactions.")
_NOTABLE = 0.01
"""Probability outside the table from which on it is a warning."""
_OUTSIDE = {"clip": "There, the value at its nearest edge is used", "nan": "There, the {} is missing",
            "error": "Nothing outside is used"}


def propagation_page(answer: Mapping[str, Any], request: Mapping[str, Any], conditions: Columns) -> str:
    """Return the HTML page of an `answer` to a propagation; the same input gives the same page.

    `request` has the `inputs`, `output_std` in s, `quantiles` and `tolerance` in s that were asked for.
    """
    spec = draw(answer, request["quantiles"], conditions)
    shown, axes = Output.of(answer), [in_words(axis["name"]) for axis in answer["axes"]]
    return document("propagation", answer["table"], headline(answer), warnings(answer, request), [
        paragraph(inputs_text(answer, request), "lead"),
        *figures({"propagation": spec}, {"propagation": caption(answer)}).values(),
        section("Distributions", table(
            _headings(shown, request["quantiles"], "condition", axes, (": alone", ": total")),
            [_cells(row, f"{row['condition']}: {described(conditions, place)}", len(axes), shown)
             for place, row in enumerate(answer["conditions"])]),
            paragraph(_NOTE, "note")),
        section("Provenance", definitions([
            ("table", f"{answer['table']}, SHA-256 {answer['table_digest']}"),
            ("expansions", f"order {answer['order']}, {answer['nodes']} model runs for each condition"),
            ("largest estimated error", _largest_error(answer)), ("version", f"Slipstick {__version__}")]))])


def headline(answer: Mapping[str, Any]) -> str:
    """What was propagated to what, the title of the page."""
    n = len(answer["conditions"])
    title = (f"{listed([in_words(axis['name']) for axis in answer['axes']])} propagated to {n} "
             f"condition{'s' * (n > 1)} of “{answer['table']}”")
    return f"{title[0].upper()}{title[1:]}"


def warnings(answer: Mapping[str, Any], request: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What limits the result: cause and explanation."""
    shown = Output.of(answer)
    limits = outside_warning(answer["mass_outside"], answer["outside"], shown)
    if answer["reached"] is False:
        tolerance = f"{shown.factor * request['tolerance']:g} {shown.small}"
        limits.append(("The tolerance is not reached:",
                       f"the error exceeds {tolerance} with {answer['nodes']} model runs for each condition."))
    missing = sum(row["mean"] is None for row in answer["conditions"])
    if missing:
        limits.append((f"{missing} of {len(answer['conditions'])} conditions have no distribution:",
                       f"there are nodes of the expansion that {shown.missing}."))
    return limits


def propagation_text(answer: Mapping[str, Any], request: Mapping[str, Any], conditions: Columns) -> str:
    """The same as plain text, with a table of the first `MOST` conditions."""
    shown, axes = Output.of(answer), [in_words(axis["name"]) for axis in answer["axes"]]
    rows = [(*_headings(shown, request["quantiles"], "", axes, ("",)), "condition"), *(
        (*_cells(row, str(row["condition"]), len(axes), shown, ("total",)), described(conditions, place))
        for place, row in enumerate(answer["conditions"][:MOST]))]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join([*map(str.rjust, row[:-1], widths), row[-1]]) for row in rows]
    further = len(answer["conditions"]) - MOST
    return "\n".join([
        f"{headline(answer)}. {summarize(answer)}.", inputs_text(answer, request),
        *(" ".join(parts) for parts in warnings(answer, request)), "", *lines,
        *([f"and {further} more conditions"] if further > 0 else []), "",
        "Std and quantiles contain the output noise. Inputs: the share of the variance without noise that each causes, "
        "alone and with the others (total Sobol index)."])


def outside_warning(mass: float, outside: str, shown: Output) -> list[tuple[str, str]]:
    """The warning of a probability outside the table, where the policy is `outside`; none if it is negligible."""
    return [] if mass <= _NOTABLE else [(f"{100 * mass:.1f} % of the inputs lie outside the table.",
                                         f"{_OUTSIDE[outside].format(shown.words)}. Use a table with wider axes.")]


def inputs_text(answer: Mapping[str, Any], request: Mapping[str, Any]) -> str:
    """The distributions of the inputs and the output noise of a `request`, in a sentence."""
    axes, inputs = [in_words(axis["name"]) for axis in answer["axes"]], request["inputs"]
    families = inputs["families"] or ["normal"] * len(axes)
    stds = inputs["std"] or [None] * len(axes)
    parts = [f"{axis} {number(mean)}" + (f" ± {number(std)}" if std is not None else "") + f" ({family})"
             for axis, mean, std, family in zip(axes, inputs["mean"], stds, families, strict=True)]
    return (f"Inputs, mean ± std in multiples of nominal: {', '.join(parts)}. Output noise: "
            f"{number(request['output_std'], Output.of(answer).factor)} {Output.of(answer).small}.")


def _headings(shown: Output, probabilities: Sequence[float], first: str, axes: Sequence[str],
              shares: Sequence[str]) -> tuple[str, ...]:
    return (first, f"mean [{shown.small}]", f"std [{shown.small}]",
            *(f"{100 * level:g} % [{shown.small}]" for level in probabilities),
            *(f"{axis}{share}" for axis in axes for share in shares))


def _cells(row: Mapping[str, Any], first: str, axes: int, shown: Output,
           kinds: Sequence[str] = ("first_order", "total")) -> tuple[str, ...]:
    """The cells of a condition under `_headings`, in whose shares each of `axes` has those of all `kinds`."""
    def small(value: float | None) -> str:
        if value is None:
            return ""
        return signed(1e3 * value, 1) if shown.factor == 1e3 else number(shown.factor * value)

    shares = [share for shares in zip(*(row[kind] or [None] * axes for kind in kinds), strict=True) for share in shares]
    return (first, small(row["mean"]), small(row["std"]), *map(small, row["quantiles"]),
            *("" if share is None else f"{100 * share:.0f} %" for share in shares))


def _largest_error(answer: Mapping[str, Any]) -> str:
    errors = [row["error"] for row in answer["conditions"] if row["error"] is not None]
    shown = Output.of(answer)
    return f"{number(max(errors), shown.factor)} {shown.small}" if errors else "unknown"
