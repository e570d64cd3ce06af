"""The page of a propagation: warnings, the distributions as table and picture, and where they come from; its text."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from slipstick import __version__
from slipstick.pictures import units
from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.output import Output
from slipstick.pictures.propagation import MOST, draw, missing_runs, summarize
from slipstick.pictures.theme import captions, in_words
from slipstick.report.markup import definitions, paragraph, section, table
from slipstick.report.shell import document, figures
from slipstick.report.words import listed, number, signed
from slipstick.uncertainty.inputs import split_mixing

_NOTE = ("Std: standard deviation. It and the quantiles contain the output noise. Alone: share of the variance without "
         "that noise that the input causes by itself (first-order Sobol index). Total: together with the other inputs.")
_NOTABLE = 0.01
"""Probability outside the table from which on it is a warning."""
_ROWS = 4
"""Conditions in a part of the picture: two parts fit a printed page."""
_OUTSIDE = {"clip": "There, the value at its nearest edge is used", "nan": "There, the {} is missing",
            "error": "Nothing outside is used"}


def propagation_page(answer: Mapping[str, Any], request: Mapping[str, Any], conditions: Columns, home: str = "") -> str:
    """Return the HTML page of an `answer` to a propagation; the same input gives the same page.

    `request` has the `inputs`, `output_std` in s, `quantiles` and `tolerance` in s that were asked for. `home` is the
    relative address of the service, if it shows the page.
    """
    specs = {"propagation": draw(answer, request["quantiles"], conditions, _ROWS)}
    shown, axes = Output.of(answer), [in_words(axis["name"]) for axis in answer["axes"]]
    return document("propagation of", answer["table"], headline(answer), warnings(answer, request), [
        section("Distributions", *figures(specs, captions(specs), _ROWS).values()),
        section("Numbers", table(
            _headings(shown, request["quantiles"], "condition", axes, (": alone", ": total")),
            [_cells(row, f"{row['condition']}: {described(conditions, place)}", len(axes), shown)
             for place, row in enumerate(answer["conditions"])]),
            paragraph(_NOTE, "note")),
        section("Inputs", table(("input", "distribution", "mean", "standard deviation", "mean in its unit",
                                 "standard deviation in its unit"), _list_inputs(answer, request), words=(1,)),
                paragraph("Means and standard deviations are multiples of the nominal value unless a unit is stated. "
                          f"{_correlations_text(answer, request)}Output noise: {_noise(answer, request)}.", "note")),
        section("Provenance", definitions([
            ("table", f"{answer['table']}, SHA-256 {answer['table_digest']}"),
            ("expansions", f"polynomials of order {answer['order']}, from {answer['nodes']} model runs for each "
             "condition"),
            ("largest estimated error", _largest_error(answer)), ("version", f"Slipstick {__version__}")]))],
        facts=[paragraph(f"{summarize(answer)}.", "lead")], home=home)


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
        tolerance = units.with_unit(f"{shown.factor * request['tolerance']:g}", shown.small)
        limits.append(("The tolerance is not reached:",
                       f"the error exceeds {tolerance} with {answer['nodes']} model runs for each condition."))
    missing = sum(row["mean"] is None for row in answer["conditions"])
    if missing:
        limits.append((f"{missing} of {len(answer['conditions'])} conditions have no distribution:",
                       f"there are {missing_runs(shown, answer['outside'])}."))
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
        f"{headline(answer)}. {summarize(answer)}.", inputs_text(answer, request), expansions_text(answer),
        *(" ".join(parts) for parts in warnings(answer, request)), "", *lines,
        *([f"and {further} more conditions"] if further > 0 else []), "",
        "Std (standard deviation) and quantiles contain the output noise. Inputs: the share of the variance without "
        "noise that each causes, alone and with the others (total Sobol index)."])


def outside_warning(mass: float, outside: str, shown: Output) -> list[tuple[str, str]]:
    """The warning of a probability outside the table, where the policy is `outside`; none if it is negligible."""
    return [] if mass <= _NOTABLE else [(f"{100 * mass:.1f} % of the inputs lie outside the table.",
                                         f"{_OUTSIDE[outside].format(shown.words)}. Use a table with wider axes.")]


def inputs_text(answer: Mapping[str, Any], request: Mapping[str, Any]) -> str:
    """The distributions of the inputs and the output noise of a `request`, in a sentence."""
    parts = [f"{axis} {mean}" + (f" ± {std}" if std else "") + f" ({family})"
             for axis, family, mean, std, *_ in _list_inputs(answer, request)]
    return (f"Inputs, mean ± standard deviation in multiples of nominal: {', '.join(parts)}. "
            f"{_correlations_text(answer, request)}Output noise: {_noise(answer, request)}.")


def expansions_text(answer: Mapping[str, Any]) -> str:
    """What the expansions are, and how far they are off, in a sentence."""
    return (f"Polynomials of order {answer['order']}, from {answer['nodes']} model runs for each condition; largest "
            f"estimated error (RMS over the inputs): {_largest_error(answer)}.")


def _list_inputs(answer: Mapping[str, Any], request: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return the name of each input, its distribution, mean and standard deviation, and both in its unit."""
    inputs, rows = request["inputs"], list[tuple[str, ...]]()
    families = inputs["families"] or ["normal"] * len(answer["axes"])
    mixing = inputs.get("mixing")
    stds = inputs.get("std") if mixing is None else split_mixing(np.array(mixing))[0].tolist()
    for axis, mean, std, family in zip(answer["axes"], inputs["mean"], stds, families, strict=True):
        nominal = axis.get("nominal")
        unit, factor = units.scale(axis.get("unit", "1"), (nominal or 0.0) * mean)
        rows.append((in_words(axis["name"]), family, number(mean), number(std), *(
            "" if nominal is None or value is None else units.with_unit(number(factor * nominal * value), unit)
            for value in (mean, std))))
    return rows


def _correlations_text(answer: Mapping[str, Any], request: Mapping[str, Any]) -> str:
    """Say which inputs depend on each other, and how much, in a sentence; empty if they are independent."""
    inputs, axes = request["inputs"], [in_words(axis["name"]) for axis in answer["axes"]]
    matrix = inputs.get("correlation")
    if inputs.get("mixing") is not None:
        _, factor = split_mixing(np.array(inputs["mixing"]))
        matrix = factor @ factor.T
    pairs = [] if matrix is None else [
        f"{axes[first]} and {axes[second]} {number(float(matrix[first][second]))}"
        for first, second in combinations(range(len(axes)), 2) if matrix[first][second] != 0]
    return f"Correlation of their normal scores: {', '.join(pairs)}. " if pairs else ""


def _noise(answer: Mapping[str, Any], request: Mapping[str, Any]) -> str:
    shown = Output.of(answer)
    return units.with_unit(number(request["output_std"], shown.factor), shown.small)


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
    std = "" if row["std"] is None else units.fixed(shown.factor * row["std"])
    return (first, small(row["mean"]), std, *map(small, row["quantiles"]),
            *("" if share is None else f"{100 * share:.0f} %" for share in shares))


def _largest_error(answer: Mapping[str, Any]) -> str:
    errors = [row["error"] for row in answer["conditions"] if row["error"] is not None]
    shown = Output.of(answer)
    return units.with_unit(number(max(errors), shown.factor), shown.small) if errors else "unknown"
