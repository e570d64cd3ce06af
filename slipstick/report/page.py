"""The page: what was found in words and numbers, the pictures, Table II, where it comes from, and its limits."""

import json
from collections.abc import Mapping
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from slipstick import __version__
from slipstick.pictures import CAPTIONS, pictures
from slipstick.report import costs, words
from slipstick.report.markup import data, listing, pairs, paragraph, section, table

_HERE = Path(__file__).parent
_LIBRARIES = ("vega", "vega-lite", "vega-embed")
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Nothing is fetched from anywhere, whatever a name in the data may hold."""

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
    `evidence`, `seconds`, `processor_seconds`), `beside` the output of the same fit by the other method, and `about`
    what the recordings say about themselves. The same input gives the same page.
    """
    result, drawn = output["result"], pictures(output["result"], output["evidence"])
    conditions = len(result["log10_likelihood_per_condition"])
    title = words.headline(result, conditions, fit["recordings"])
    return "\n".join([
        "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(fit['id'])}: {escape(title)}</title>", f"<style>{_file('style.css')}</style>", "</head>",
        "<body>", "<main>", paragraph(f"Slipstick · fit {fit['id']}", "over"), f"<h1>{escape(title)}</h1>",
        paragraph(words.gain(result), "lead"),
        section("What was found", _numbers(result), listing(words.identified(result))),
        section("Combinations of unknowns", listing(words.combinations(result)), paragraph(_SHARES, "note")),
        section("What to know about it", listing(words.remarks(result))),
        section("Pictures", *(_figure(name) for name in drawn)),
        section("Table II of the paper, and this fit", table(costs.HEAD, costs.rows(output, beside)),
                *(paragraph(note, "note") for note in costs.notes(output, beside))),
        section("Where it comes from", pairs(_origin(fit, output, about))),
        section("What it cannot say", listing(_LIMITS)),
        "</main>", data("pictures", drawn),
        *(f"<script>{_file(f'vega/{name}.min.js')}</script>" for name in _LIBRARIES),
        f"<script>{_file('draw.js')}</script>", f"<!--\n{_licences()}\n-->", "</body>", "</html>", ""])


def _numbers(result: Mapping[str, Any]) -> str:
    head, rows = ("unknown, multiples of nominal", "before", "fitted"), list(words.numbers(result))
    if not result["intervals"]:
        return table(head, [row[:-1] for row in rows])
    return table((*head, f"{100 * result['intervals'][0]['level']:.0f} % interval"), rows) + paragraph(
        "Open: the recordings do not limit the unknown on that side within the bounds of the search. Not found: the "
        "computation stopped before it met an end.", "note")


def _figure(name: str) -> str:
    return (f'<figure>\n<div class="picture" id="picture-{escape(name)}"></div>\n'
            f"<figcaption>{escape(CAPTIONS[name])}</figcaption>\n</figure>")


def _origin(fit: Mapping[str, Any], output: Mapping[str, Any], about: str) -> list[tuple[str, str]]:
    spent = {name: ", ".join(f"{stage} {words.duration(seconds)}" for stage, seconds in output[name].items())
             for name in ("seconds", "processor_seconds")}
    settings = ", ".join(f"{name} {json.dumps(value)}" for name, value in fit["settings"].items())
    kind = "the simulator at the parameters of the table" if fit["simulate"] else "the table"
    model = f"{kind} {fit['table']}, SHA-256 {fit['table_digest']}" + (
        "" if fit["simulate"] else f", {fit['outside']} outside")
    said: list[tuple[str, str | None]] = [
        ("model", model), ("recordings", f"{fit['recordings']}, SHA-256 {fit['recordings_digest']}"),
        ("they say", about), ("mass outside", f"{100 * output['result']['mass_outside']:.3g} % of the runs"),
        ("settings", settings), ("time", spent["seconds"]), ("processor time", spent["processor_seconds"]),
        ("submitted", fit["submitted"]), ("ended", fit["ended"]),
        ("version", f"Slipstick {__version__}")]
    return [(name, value) for name, value in said if value]


@cache
def _file(name: str) -> str:
    return (_HERE / name).read_text()


@cache
def _licences() -> str:
    """The terms under which the scripts of the page may travel with it."""
    files = [_HERE / "vega" / "NOTICE", *sorted((_HERE / "vega").glob("*.LICENSE"))]
    return "\n\n".join(f"{file.name}\n\n{file.read_text()}" for file in files)
