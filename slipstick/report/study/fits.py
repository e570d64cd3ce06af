"""The same fit on the tables of a study's two models: what the scatter and the noise had to make up for before."""

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.pictures.study import CAPTIONS
from slipstick.pictures.theme import plain
from slipstick.report.markup import pairs, paragraph, section, table
from slipstick.report.shell import figure
from slipstick.report.words import number, signed

Fits = Mapping[str, Mapping[str, Any]]

_TITLE = "The same fit on both tables"
_NOTE = ("Shifting times only, fitted alike on the table of each model. What a model lacks, scatter of its inputs and "
         "output noise make up for.")
_HOW = ("Not in this report yet: build a table of each model (GET {0}/model?which=before and ?which=after) with "
        "“python -m worker build --model FILE --conditions RECORDINGS --out TABLE”, submit the same fit on both by "
        "POST /v1/fits, and ask for GET {0}/report?before=FIT&after=FIT.")


def same_fit(study: Mapping[str, Any], result: Mapping[str, Any], fits: Fits | None, drawn: bool) -> str:
    """The section: numbers, where they come from, and the picture where it is `drawn`; without `fits`, how to get it.

    `fits`: `before` and `after` -> id, table, table_digest and `result` of a fit. Nothing where nothing was added.
    """
    if not result["answer"]["effects"]:
        return ""
    if fits is None:
        address = study.get("links", {}).get("self", "/v1/studies/ID")  # the command line knows no address
        return section(_TITLE, paragraph(_HOW.format(address), "note"))
    return section(
        _TITLE, table(("", *fits), numbers(result, fits)), paragraph(_NOTE, "note"),
        pairs((key, f"fit {fit['id']}, table {fit['table']}, SHA-256 {fit['table_digest']}")
              for key, fit in fits.items()),
        figure("surfaces", CAPTIONS["surfaces"]) if drawn else "")


def numbers(result: Mapping[str, Any], fits: Fits) -> Iterator[tuple[str, ...]]:
    """Rows of: quantity, its value in each fit. Inputs in their units: the two models differ in what is nominal."""
    levels = [fit["result"]["log10_likelihood"] for fit in fits.values()]
    yield "log10 likelihood", *("−∞" if level is None else signed(level) for level in levels)
    for kind in ("mean", "std"):
        for place, axis in enumerate(next(iter(fits.values()))["result"]["axes"]):
            values = (result["models"][key]["parameters"][axis] * fit["result"][kind][place]
                      for key, fit in fits.items())
            yield f"{kind} of {plain(axis)} [{result['models']['before']['units'][axis]}]", *map(number, values)
    yield "output noise [ms]", *(number(fit["result"]["output_std"], 1e3) for fit in fits.values())
