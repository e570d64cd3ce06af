"""The page: what was found in words and numbers, the pictures, Table II, where it comes from, and its limits."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import CAPTIONS, pictures
from slipstick.report import costs, words
from slipstick.report.markup import listing, paragraph, section, table
from slipstick.report.shell import document, figures, origin

_SHARES = ("Each unknown counts as a share of its range in the search; only the three largest are named, if above a "
           "fifth of the largest. Where the profile likelihood was followed its ends are given, from the estimate; "
           "else ± is one standard error, by the information in the recordings.")
_LIMITS = (
    ("The shipped recordings are simulated:", "“measured” comes from an independent implementation of a test bench, "
     "with noise, scatter and a physical effect that the model lacks. The recordings of the paper are not public."),
    ("Shifting times say little about each input alone:", "with nothing else measured, one input can stand in for "
     "another, as pressure bias for initial position. Read the combinations above, not the means one by one."),
    ("The scatter stands for whatever the model lacks:", "parametric uncertainty is the only kind there is here. Where "
     "a physical effect is missing, the fitted std and the output noise grow to cover it."),
    ("An interval holds for the model as it is:", "it says what the recordings allow if the model is right and the "
     "families of the inputs are the true ones."),
)


def page(fit: Mapping[str, Any], output: Mapping[str, Any], beside: Mapping[str, Any] | None = None,
         about: str = "") -> str:
    """The whole page.

    `fit` is the JSON of a fit (id, table, recordings, digests, settings, times), `output` what its job left (`result`,
    `figure_data`, `seconds`, `processor_seconds`), `beside` the output of the same fit by the other method, and `about`
    what the recordings say about themselves. The same input gives the same page.
    """
    result, drawn = output["result"], pictures(output["result"], output["figure_data"])
    conditions = len(result["log10_likelihood_per_condition"])
    title = words.headline(result, conditions, fit["recordings"])
    return document("fit", fit["id"], title, [
        paragraph(words.gain(result), "lead"),
        section("What was found", _numbers(result), listing(words.identified(result))),
        section("Combinations of unknowns", listing(words.combinations(result)), paragraph(_SHARES, "note")),
        section("What to know about it", listing(words.remarks(result))),
        figures(drawn, CAPTIONS),
        section("Table II of the paper, and this fit", table(costs.HEAD, costs.rows(output, beside)),
                *(paragraph(note, "note") for note in costs.notes(output, beside))),
        _origin(fit, output, about),
        section("What it cannot say", listing(_LIMITS))], drawn)


def _numbers(result: Mapping[str, Any]) -> str:
    head, rows = ("unknown, multiples of nominal", "before", "fitted"), list(words.numbers(result))
    if not result["intervals"]:
        return table(head, [row[:-1] for row in rows])
    return table((*head, f"{100 * result['intervals'][0]['level']:.0f} % interval"), rows) + paragraph(
        "Open: the recordings do not limit the unknown on that side within the bounds of the search. Not found: the "
        "computation stopped before it met an end.", "note")


def _origin(fit: Mapping[str, Any], output: Mapping[str, Any], about: str) -> str:
    kind = "the simulator at the parameters of the table" if fit["simulate"] else "the table"
    model = f"{kind} {fit['table']}, SHA-256 {fit['table_digest']}" + (
        "" if fit["simulate"] else f", {fit['outside']} outside")
    return origin(fit, output, [
        ("model", model), ("recordings", f"{fit['recordings']}, SHA-256 {fit['recordings_digest']}"),
        ("they say", about), ("mass outside", f"{100 * output['result']['mass_outside']:.3g} % of the runs")])
