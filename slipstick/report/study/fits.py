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


def same_fit(result: StudyResult, fits: Fits | None, picture: str) -> str:
    """Return the section with numbers, provenance and picture.

    `fits`: `before` and `after` -> id, table, table_digest and `result` of a fit. `picture` is a figure element, or
    empty.

    Empty without `fits`, and if nothing was added to the simulation.
    """
    if result.gap is None or fits is None:
        return ""
    return section(
        _TITLE, paragraph(_compare(fits)),
        table(("fit on the table of the model", "without", "with the findings"), numbers(result, fits)),
        paragraph(_NOTE, "note"),
        definitions((words, f"fit {fit['id']}, table {fit['table']}, SHA-256 {fit['table_digest']}")
                    for words, fit in zip(("without", "with the findings"), fits.values(), strict=True)),
        picture)


def _compare(fits: Fits) -> str:
    """Return by how much the likelihood differs."""
    before, after = (fits[key]["result"]["log10_likelihood"] for key in ("before", "after"))
    if before is None or after is None:
        return "In one of the fits, at least one engagement has zero likelihood."
    return (f"With the findings in the model, the same shifting times are {abs(after - before):.1f} decades (factors "
            f"of ten) {'more' if after > before else 'less'} likely.")


def numbers(result: StudyResult, fits: Fits) -> Iterator[tuple[str, ...]]:
    """Yield rows of a quantity and its value in each fit, in units, because the nominal values of the models differ."""
    models = result.models
    bounds = {key: {remark["unknown"] for remark in fit["result"].get("remarks", ()) if remark.get("at_bound")}
              for key, fit in fits.items()}
    likelihoods = [fit["result"]["log10_likelihood"] for fit in fits.values()]
    yield "log10 likelihood", *("−∞" if value is None else signed(value) for value in likelihoods)
    for index, axis in enumerate(next(iter(fits.values()))["result"]["axes"]):
        means, stds = ([models[key]["parameters"][axis] * fit["result"][kind][index] for key, fit in fits.items()]
                       for kind in ("mean", "std"))
        unit, factor = units.scale(models["before"]["units"][axis], max(means))
        of = units.with_unit(in_words(axis), f"[{unit}]" if unit != "1" else "")
        yield f"mean of {of}", *(_state(number(factor * mean), f"mean of {axis}" in at)
                                 for mean, at in zip(means, bounds.values(), strict=True))
        yield f"scatter of {of}", *(
            _state(f"{number(factor * std)}, {100 * std / abs(mean):.2g} % of the mean", f"std of {axis}" in at)
            for std, mean, at in zip(stds, means, bounds.values(), strict=True))
    yield "output noise [ms]", *(_state(number(fit["result"]["output_std"], 1e3), "output std" in bounds[key])
                                 for key, fit in fits.items())


def _state(text: str, at_bound: bool) -> str:
    return text + " (at a bound of the search)" * at_bound
