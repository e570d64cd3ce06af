"""The result of a study as plain text: the contents of its report without the figures."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from slipstick.pictures.study.words import title
from slipstick.report.study import further as study_further
from slipstick.report.study import words
from slipstick.report.study.limits import caveats, limits

_WIDTH = 110
_GAP = ("RMS error on held-out conditions", "before", "after", "correct model", "closed (90 %)")
_RANKING = ("candidate", "block", "decades", "ahead", "behind", "share", "BIC")
_RANKING_NOTE = ("decades: mean improvement of the held-out log10 likelihood per experiment over the fit without the "
                 "candidate. ahead, behind: standard errors ahead of that fit and behind the best candidate. share: "
                 "bootstrap samples in which the candidate is the best. BIC: change; lower is better.")


def study_text(result: Mapping[str, Any], figure_data: Mapping[str, Any], level: float) -> str:
    """The answer with its caveats and evidence, experiments that would resolve a tie, the rankings and the limitations.

    `result` and `figure_data` are those of a finished study; `level` is the level of the intervals.
    """
    parts = [_paragraph(f"{result['answer']['sentence']}. {words.lead(result, figure_data)}")]
    parts.append(_listing("Caveats", caveats(result, figure_data)))
    if result["answer"]["coefficients"]:
        parts.append(_table(("coefficient", "estimate", f"{100 * level:.0f} % interval"),
                            words.coefficients(result, figure_data)))
    parts.append(_listing("Evidence", words.rounds(result, figure_data)))
    for tie in result["further"]:
        experiments = f"\n{_table(study_further.HEAD, study_further.rows(tie))}" if tie["experiments"] else ""
        parts.append(_paragraph(study_further.lead(tie, figure_data)) + experiments)
    for number, fitted in enumerate(result["rounds"], 1):
        if fitted["ranking"]:
            parts.append(f"Candidates of round {number}\n{_table(_RANKING, words.ranking(fitted))}")
    if any(fitted["ranking"] for fitted in result["rounds"]):
        parts.append(_paragraph(_RANKING_NOTE))
    parts.append(_listing("Where model and recordings disagree", words.where(figure_data)))
    gap = result["gap"]
    if gap is not None:
        control = ("closed by control",) if gap["control"] else ()
        parts.append(_table((*_GAP, *control), words.gap(result)))
        if gap["control"]:
            parts.append(_paragraph(f"The control is {title(figure_data, gap['control']['effect'])}, the best "
                                    "candidate that acts on a different quantity."))
    parts.append(_listing("Limitations", limits(figure_data)))
    return "\n\n".join(part for part in parts if part)


def _paragraph(text: str) -> str:
    return textwrap.fill(text, _WIDTH)


def _listing(heading: str, items: Iterable[tuple[str, str]]) -> str:
    """Statements under a heading; empty without statements."""
    lines = [textwrap.fill(f"{label} {statement}", _WIDTH, initial_indent="- ", subsequent_indent="  ")
             for label, statement in items]
    return "\n".join([heading, *lines]) if lines else ""


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Aligned columns; the first column labels the rows."""
    cells = [head, *rows]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return "\n".join("  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in
                                                           zip(row[1:], widths[1:], strict=True))]) for row in cells)
