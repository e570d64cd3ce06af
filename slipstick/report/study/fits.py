"""Comparison of the same fit on the tables of the two models of a study, without and with the added effects."""

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.pictures import units
from slipstick.pictures.theme import in_words
from slipstick.report.markup import definitions, paragraph, section, table
from slipstick.report.words import number, signed
from slipstick.studies.result import StudyResult

Fits = Mapping[str, Mapping[str, Any]]

_TITLE = "The same fit on the tables of both models"
_NOTE = ("Both fits have the same settings and use shifting times only. If a model lacks something, the scatter of its "
         "inputs and the output noise grow to compensate.")
_INSTRUCTIONS = (
    "This report does not contain the fits. To add them, build a table of each model (GET {0}/model?which=before and "
    "?which=after) with “slipstick build --bench BENCH --model FILE --conditions RECORDINGS --out TABLE”, "
    "submit the same fit on both tables with POST /v1/fits, and request GET {0}/report?before=FIT&after=FIT.")


def same_fit(study: Mapping[str, Any], result: StudyResult, fits: Fits | None, picture: str) -> str:
    """Return the section with numbers, provenance and picture; without `fits`, the instructions to add them.

    `fits`: `before` and `after` -> id, table, table_digest and `result` of a fit. `picture` is a figure element, or
    empty.

    Empty if nothing was added to the simulation.
    """
    if result.gap is None:
        return ""
    if fits is None:
        address = study.get("links", {}).get("self", "/v1/studies/ID")  # the command line has no address
        return section(_TITLE, paragraph(_INSTRUCTIONS.format(address), "note"))
    return section(
        _TITLE, table(("", *fits), numbers(result, fits)), paragraph(_NOTE, "note"),
        definitions((key, f"fit {fit['id']}, table {fit['table']}, SHA-256 {fit['table_digest']}")
              for key, fit in fits.items()),
        picture)


def numbers(result: StudyResult, fits: Fits) -> Iterator[tuple[str, ...]]:
    """Yield rows of a quantity and its value in each fit, in units, because the nominal values of the models differ."""
    models = result.models
    likelihoods = [fit["result"]["log10_likelihood"] for fit in fits.values()]
    yield "log10 likelihood", *("−∞" if value is None else signed(value) for value in likelihoods)
    for kind, name in (("mean", "mean"), ("std", "scatter")):
        for index, axis in enumerate(next(iter(fits.values()))["result"]["axes"]):
            values = [models[key]["parameters"][axis] * fit["result"][kind][index] for key, fit in fits.items()]
            unit, factor = units.scale(models["before"]["units"][axis], max(values))
            yield (units.with_unit(f"{name} of {in_words(axis)}", f"[{unit}]" if unit != "1" else ""),
                   *(number(factor * value) for value in values))
    yield "output noise [ms]", *(number(fit["result"]["output_std"], 1e3) for fit in fits.values())
