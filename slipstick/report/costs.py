"""Table II of the paper, with the numbers of this fit beside it."""

from collections.abc import Mapping
from typing import Any

from slipstick.report.words import duration, signed

PAPER = {"classic": (277.0 * 3600, -269.0), "genetic": (1.65 * 3600, -273.0)}
"""Seconds and log10 likelihood of both methods (Table II and section III.B)."""

HEAD = ("method", "cost, paper", "log10 L, paper", "cost, here", "log10 L, here")
NOTE = ("The recordings of the paper are not public, so its likelihoods and those here are of different data: compare "
        "the ratio of the costs, and how far apart the methods end. The paper's costs are of a desktop PC (8 × Core "
        "i7-6900K); here they are seconds of the job for opening, search and refinement. Neither counts the table.")
ALONE = "Only one method was run here. A report with ?beside= and the id of a fit by the other fills in both."

_SEARCH, _REFINEMENT = ("open", "search"), ("open", "search", "refine")
Run = tuple[float, float]
"""Seconds, and the log10 likelihood they led to."""


def rows(output: Mapping[str, Any], beside: Mapping[str, Any] | None) -> list[tuple[str, str, str, str, str]]:
    """One row a method and stage, and one for the difference; a cell stays empty where nothing was run."""
    runs = {run["result"]["method"]: run for run in (beside, output) if run is not None}
    classic, genetic = (runs.get(method) for method in PAPER)
    refined = _refined(classic), _refined(genetic)
    return [
        ("Classic: quasi-Monte Carlo + grid search", *_said(PAPER["classic"]), *_said(_searched(classic))),
        ("refined on the exact likelihood", "", "", *_said(refined[0])),
        ("Proposed: expansions + genetic algorithm", *_said(PAPER["genetic"]), *_said(_searched(genetic))),
        ("refined on the exact likelihood", "", "", *_said(refined[1])),
        ("Classic against proposed", *_ratio(PAPER["classic"], PAPER["genetic"]), *_ratio(*refined))]


def _searched(run: Mapping[str, Any] | None) -> Run | None:
    return None if run is None else _run(run, run["result"]["searched"]["log10_likelihood"], _SEARCH)


def _refined(run: Mapping[str, Any] | None) -> Run | None:
    return None if run is None else _run(run, run["result"]["log10_likelihood"], _REFINEMENT)


def _run(run: Mapping[str, Any], likelihood: float | None, stages: tuple[str, ...]) -> Run | None:
    return None if likelihood is None else (sum(run["seconds"].get(stage, 0.0) for stage in stages), likelihood)


def _said(run: Run | None) -> tuple[str, str]:
    return ("", "") if run is None else (duration(run[0]), signed(run[1]))


def _ratio(one: Run | None, other: Run | None) -> tuple[str, str]:
    if one is None or other is None:
        return "", ""
    return f"{one[0] / other[0]:,.0f} ×", f"{signed(one[1] - other[1])} decades"
