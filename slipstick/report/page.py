"""The report of a fit: fitted values, combinations of unknowns, pictures, Table II, provenance and limitations."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import CAPTIONS, pictures
from slipstick.pictures.output import Output
from slipstick.report import costs, words
from slipstick.report.doubts import doubts
from slipstick.report.markup import listing, paragraph, section, table
from slipstick.report.shell import (
    SIGN,
    are_simulated,
    document,
    figures,
    home_of,
    provenance,
    tell_facts,
    tell_recordings,
)

_COMBINATIONS = ("In a combination, each unknown is measured as a share of its search range. At most three unknowns "
                 "are listed, and only those whose weight exceeds a fifth of the largest. Intervals come from the "
                 "profile likelihood and are relative to the estimate. Combinations without an interval have a "
                 "standard error, computed from the information in the recordings.")
_SIMULATED = ("These recordings are shipped and simulated:", "they are the output of an independent simulation of a "
              "test bench, with noise, scatter and a physical effect that the model lacks.")
_LIMITATIONS = (
    ("Shifting times hardly constrain single inputs:", "without other measurements, one input can compensate for "
     "another, for example pressure bias for initial position. Read the combinations above before the individual "
     "means."),
    ("The scatter absorbs model errors:", "the fit represents parametric uncertainty only. If the model lacks a "
     "physical effect, the fitted scatter and the output noise grow to compensate."),
    ("The intervals are conditional on the model:", "they hold if the model is correct and the inputs follow the "
     "chosen families of distributions."),
)


def page(fit: Mapping[str, Any], output: Mapping[str, Any], other_method: Mapping[str, Any] | None = None,
         description: str = "") -> str:
    """Return the HTML page of a fit. The same input gives the same page.

    `fit` is the JSON of the fit (id, table, recordings, digests, settings, times), and `output` the output of its job
    (`result`, `physical`, `figure_data` and times). `other_method` is the output of the same fit by the other method,
    for Table II, and `description` describes the recordings.
    """
    result = output["result"]
    predicted = Output.of(output["figure_data"])
    title = words.headline(result, fit["recordings"], predicted)
    compared = other_method is not None or costs.is_case_of_paper(output)
    return document("fit to", fit["recordings"], title, [*words.warnings(result), *doubts(output["figure_data"])], [
        section("Fitted values", _numbers(output), listing(words.identified(result))),
        section("Combinations of unknowns", listing(words.combinations(result)), paragraph(_COMBINATIONS, "note")),
        section("Pictures", *figures(pictures(output), CAPTIONS).values()),
        section("Comparison with Table II of the paper", table(costs.HEAD, costs.rows(output, other_method)), *(
            paragraph(note, "note") for note in costs.notes(output, other_method))) if compared else "",
        _provenance(fit, output, description),
        section("Limitations", listing([*([_SIMULATED] if are_simulated(fit) else []), *_LIMITATIONS]))],
        facts=[paragraph(words.improvement(result, predicted), "lead"),
               tell_facts(fit, [f"Table {fit['table']}", tell_recordings(fit),
                                words.measured(result, predicted)]),
               paragraph(SIGN, "note")], home=home_of(fit))


def _numbers(output: Mapping[str, Any]) -> str:
    head = ("unknown [multiple of nominal unless stated]", "before the fit", "fitted", "in its unit")
    result = output["result"]
    rows = list(words.numbers(result, output["physical"], Output.of(output["figure_data"])))
    if not result["intervals"]:
        return table(head, [row[:-2] for row in rows])
    level = f"{100 * result['intervals'][0]['level']:.0f} % interval"
    return table((*head, level, f"{level} in its unit"), rows) + paragraph(
        "Open: within the bounds of the search, the recordings do not limit the unknown on that side. Not found: the "
        "computation stopped before it reached the end of the interval.", "note")


def _provenance(fit: Mapping[str, Any], output: Mapping[str, Any], description: str) -> str:
    table_name = f"{fit['table']}, SHA-256 {fit['table_digest']}"
    if fit["simulate"]:
        model, bounds = f"simulator with the parameters of the table {table_name}", "parameter bounds"
    else:
        model, bounds = f"table {table_name}; outside of it: {words.OUTSIDE[fit['outside']]}", "table"
    of_output = Output.of(output["figure_data"])
    settings = words.settings_of(fit["settings"], output["result"]["axes"], of_output.unit)
    return provenance({**fit, "settings": {}}, output, [
        ("model", model), ("recordings", f"{fit['recordings']}, SHA-256 {fit['recordings_digest']}"),
        ("description of the recordings", description), ("settings", settings),
        (f"probability outside the {bounds}", words.probability(output["result"]["mass_outside"]))])
