"""Table II of the paper, with the numbers of this fit beside it."""

from collections.abc import Mapping
from typing import Any

from slipstick.report.words import duration, signed

PAPER = {"classic": (277.0 * 3600, -269.0), "genetic": (1.65 * 3600, -273.0)}
"""Seconds and log10 likelihood of both methods (Table II and section III.B)."""

HEAD = ("method", "cost, paper", "log10 L, paper", "processor time, here", "log10 L, here")
_NOTE = ("The recordings of the paper are not public, so its likelihoods and those here are of different data: compare "
         "the ratio of the costs, and how far apart the methods end. The paper's costs are of a desktop PC (8 × Core "
         "i7-6900K), on unstated cores; here they are processor time of all threads, for opening, search and "
         "refinement. Neither counts the table.")
_ALONE = "Only one method was run here. A report with ?beside= and the id of a fit by the other fills in both."

_THEN = "… and refined on the exact likelihood"
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
        (_THEN, "", "", *_said(refined[0])),
        ("Proposed: expansions + genetic algorithm", *_said(PAPER["genetic"]), *_said(_searched(genetic))),
        (_THEN, "", "", *_said(refined[1])),
        ("Classic against proposed", *_ratio(PAPER["classic"], PAPER["genetic"]), *_ratio(*refined))]


def notes(output: Mapping[str, Any], beside: Mapping[str, Any] | None) -> list[str]:
    """What to know before comparing the rows."""
    said = [_NOTE]
    for run in (beside, output):
        if run is not None and run["result"]["method"] == "classic":
            values = round(run["result"]["generations"] ** (1 / len(run["result"]["axes"])))
            unknowns = len(run["result"]["combinations"][0]["weights"])
            said.append(f"The classic grid here has {values} values of each of the {unknowns} unknowns, "
                        f"{values**unknowns:,} candidates; one twice as fine costs {2**unknowns:,} times as much.")
    return said if beside is not None else [*said, _ALONE]


def _searched(run: Mapping[str, Any] | None) -> Run | None:
    return None if run is None else _run(run, run["result"]["searched"]["log10_likelihood"], _SEARCH)


def _refined(run: Mapping[str, Any] | None) -> Run | None:
    if run is None or not run["result"]["refined"]:
        return None
    return _run(run, run["result"]["log10_likelihood"], _REFINEMENT)


def _run(run: Mapping[str, Any], likelihood: float | None, stages: tuple[str, ...]) -> Run | None:
    return None if likelihood is None else (sum(run["processor_seconds"].get(stage, 0.0) for stage in stages),
                                          likelihood)


def _said(run: Run | None) -> tuple[str, str]:
    return ("", "") if run is None else (duration(run[0]), signed(run[1]))


def _ratio(one: Run | None, other: Run | None) -> tuple[str, str]:
    if one is None or other is None:
        return "", ""
    times = one[0] / other[0]
    return f"{times:,.0f} ×" if times > 100 else f"{times:.3g} ×", f"{signed(one[1] - other[1])} decades"
