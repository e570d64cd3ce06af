"""Table II of the paper with the costs and likelihoods of this fit added."""

from collections.abc import Mapping
from typing import Any

from slipstick.report.words import duration, signed

PAPER = {"classic": (277.0 * 3600, -269.0), "genetic": (1.65 * 3600, -273.0)}
"""Cost in s and log10 likelihood of both methods (Table II and section III.B)."""

HEAD = ("method", "cost (paper)", "log10 L (paper)", "processor time (here)", "log10 L (here)")
_NOTE = ("The recordings of the paper are not public, so the likelihoods of the paper and those here belong to "
         "different data. Compare the ratio of the costs and the difference in likelihood between the methods. The "
         "costs in the paper were measured on a desktop PC (8 × Core i7-6900K); the number of cores used is not "
         "stated. The costs here are the processor time of all threads for opening, search and refinement. Neither "
         "includes building the table.")
_SINGLE_METHOD = ("Only one method was run here. To fill in the rows of the other method, request the report with "
                  "?beside=ID, where ID is a fit of the same problem by the other method.")

_INPUTS = {"pressure_bias", "initial_position"}
"""Inputs that the paper fits."""
_REFINED_ROW = "… refined on the exact likelihood"
_SEARCH, _REFINEMENT = ("open", "search"), ("open", "search", "refine")
CostAndLikelihood = tuple[float, float]
"""Cost in s and log10 likelihood."""


def is_case_of_paper(output: Mapping[str, Any]) -> bool:
    """Whether a fit is that of the paper: its two inputs, of shifting times of a clutch."""
    return set(output["result"]["axes"]) == _INPUTS and output["figure_data"].get("output") is None


def rows(output: Mapping[str, Any], other_method: Mapping[str, Any] | None) -> list[tuple[str, str, str, str, str]]:
    """Return one row per method and stage, and a last row that compares the methods.

    Cells of a stage that was not run are empty. `other_method` is the output of the same fit by the other method.
    """
    outputs = {fit["result"]["method"]: fit for fit in (other_method, output) if fit is not None}
    classic, genetic = (outputs.get(method) for method in PAPER)
    refined = _measure_refinement(classic), _measure_refinement(genetic)
    return [
        ("Classic: quasi-Monte Carlo + grid search", *_cells(PAPER["classic"]), *_cells(_measure_search(classic))),
        (_REFINED_ROW, "", "", *_cells(refined[0])),
        ("Proposed: expansions + genetic algorithm", *_cells(PAPER["genetic"]), *_cells(_measure_search(genetic))),
        (_REFINED_ROW, "", "", *_cells(refined[1])),
        ("Classic relative to proposed", *_comparison(PAPER["classic"], PAPER["genetic"]), *_comparison(*refined))]


def notes(output: Mapping[str, Any], other_method: Mapping[str, Any] | None) -> list[str]:
    """Return the notes below the table: what is comparable, and the size of the classic grid."""
    texts = [_NOTE]
    for fit in (other_method, output):
        if fit is not None and fit["result"]["method"] == "classic":
            values = round(fit["result"]["generations"] ** (1 / len(fit["result"]["axes"])))
            unknowns = len(fit["result"]["combinations"][0]["weights"])
            texts.append(f"The classic grid here has {values} values of each of the {unknowns} unknowns, "
                         f"{values**unknowns:,} candidates in total. A grid twice as fine costs {2**unknowns:,} times "
                         "as much.")
    return texts if other_method is not None else [*texts, _SINGLE_METHOD]


def _measure_search(fit: Mapping[str, Any] | None) -> CostAndLikelihood | None:
    return None if fit is None else _cost(fit, fit["result"]["searched"]["log10_likelihood"], _SEARCH)


def _measure_refinement(fit: Mapping[str, Any] | None) -> CostAndLikelihood | None:
    if fit is None or not fit["result"]["refined"]:
        return None
    return _cost(fit, fit["result"]["log10_likelihood"], _REFINEMENT)


def _cost(fit: Mapping[str, Any], likelihood: float | None, stages: tuple[str, ...]) -> CostAndLikelihood | None:
    if likelihood is None:
        return None
    return sum(fit["processor_seconds"].get(stage, 0.0) for stage in stages), likelihood


def _cells(cost: CostAndLikelihood | None) -> tuple[str, str]:
    return ("", "") if cost is None else (duration(cost[0]), signed(cost[1]))


def _comparison(classic: CostAndLikelihood | None, genetic: CostAndLikelihood | None) -> tuple[str, str]:
    """Return the ratio of the costs and the difference of the log10 likelihoods."""
    if classic is None or genetic is None:
        return "", ""
    ratio = classic[0] / genetic[0]
    return (f"{ratio:,.0f} ×" if ratio > 100 else f"{ratio:.3g} ×"), f"{signed(classic[1] - genetic[1])} decades"
