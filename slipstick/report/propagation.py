"""The page of a propagation: warnings, the distributions as table and picture, and where they come from."""

from collections.abc import Mapping
from typing import Any

from slipstick import __version__
from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.output import Output
from slipstick.pictures.propagation import caption, draw
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
    probabilities = request["quantiles"]
    spec = draw(answer, probabilities, conditions)
    shown = Output.of(answer)
    axes = [in_words(axis["name"]) for axis in answer["axes"]]
    return document("propagation", answer["table"], headline(answer), warnings(answer, request), [
        paragraph(inputs_text(answer, request), "lead"),
        *figures({"propagation": spec}, {"propagation": caption(answer)}).values(),
        section("Distributions", table(
            ("condition", f"mean [{shown.small}]", f"std [{shown.small}]",
             *(f"{100 * level:g} % [{shown.small}]" for level in probabilities),
             *(f"{axis}: {kind}" for axis in axes for kind in ("alone", "total"))),
            [_row(row, described(conditions, place), len(axes), shown.factor)
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
    limits, shown = [], Output.of(answer)
    if answer["mass_outside"] > _NOTABLE:
        limits.append((f"{100 * answer['mass_outside']:.1f} % of the inputs lie outside the table.",
                      f"{_OUTSIDE[answer['outside']].format(shown.words)}. Use a table with wider axes."))
    if answer["reached"] is False:
        tolerance = f"{shown.factor * request['tolerance']:g} {shown.small}"
        limits.append(("The tolerance is not reached:",
                      f"the error exceeds {tolerance} with {answer['nodes']} model runs for each condition."))
    missing = sum(row["mean"] is None for row in answer["conditions"])
    if missing:
        limits.append((f"{missing} of {len(answer['conditions'])} conditions have no distribution:",
                      f"there are nodes of the expansion that {shown.missing}."))
    return limits


def inputs_text(answer: Mapping[str, Any], request: Mapping[str, Any]) -> str:
    """The distributions of the inputs and the output noise of a `request`, in a sentence."""
    axes, inputs = [in_words(axis["name"]) for axis in answer["axes"]], request["inputs"]
    families = inputs["families"] or ["normal"] * len(axes)
    stds = inputs["std"] or [None] * len(axes)
    parts = [f"{axis} {number(mean)}" + (f" ± {number(std)}" if std is not None else "") + f" ({family})"
             for axis, mean, std, family in zip(axes, inputs["mean"], stds, families, strict=True)]
    return (f"Inputs, mean ± std in multiples of nominal: {', '.join(parts)}. Output noise: "
            f"{number(request['output_std'], Output.of(answer).factor)} {Output.of(answer).small}.")


def _row(row: Mapping[str, Any], conditions: str, axes: int, factor: float) -> tuple[str, ...]:
    def small(value: float | None) -> str:
        return "" if value is None else signed(1e3 * value, 1) if factor == 1e3 else number(factor * value)

    shares = [share for pair in zip(row["first_order"] or [None] * axes, row["total"] or [None] * axes, strict=True)
              for share in pair]
    return (f"{row['condition']}: {conditions}", small(row["mean"]), small(row["std"]), *map(small, row["quantiles"]),
            *("" if share is None else f"{100 * share:.0f} %" for share in shares))


def _largest_error(answer: Mapping[str, Any]) -> str:
    errors = [row["error"] for row in answer["conditions"] if row["error"] is not None]
    shown = Output.of(answer)
    return f"{number(max(errors), shown.factor)} {shown.small}" if errors else "unknown"
