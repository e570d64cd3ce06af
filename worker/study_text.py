"""What a study found as a page of text: the words of its report, without the pictures."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from slipstick.pictures.study.words import title
from slipstick.report.study import further as study_further
from slipstick.report.study import words
from slipstick.report.study.limits import caveats, limits

_WIDTH = 110
_GAP = ("on conditions not seen, RMS", "before", "after", "right model", "closed (90 %)")
_RANKING = ("candidate", "block", "decades", "ahead", "behind", "share", "BIC")


def page(result: Mapping[str, Any], figure_data: Mapping[str, Any], level: float) -> str:
    """The answer, how sure it is, what would tell a tie apart, the ranking, where it shows, the gap, and the limits.

    `result` and `figure_data` are those of a finished study, `level` that of the intervals.
    """
    parts = [_paragraph(f"{result['answer']['sentence']}. {words.lead(result, figure_data)}")]
    parts.append(_listing("What to know about it", caveats(result, figure_data)))
    if result["answer"]["coefficients"]:
        parts.append(_table(("coefficient", "estimate", f"{100 * level:.0f} % interval"),
                            words.coefficients(result, figure_data)))
    parts.append(_listing("How it was found", words.rounds(result, figure_data)))
    for one in result["further"]:
        shown = f"\n{_table(study_further.HEAD, study_further.rows(one))}" if one["experiments"] else ""
        parts.append(_paragraph(study_further.lead(one, figure_data)) + shown)
    for number, one in enumerate(result["rounds"], 1):
        if one["ranking"]:
            parts.append(f"Round {number}, log10 likelihood of an experiment not seen, errors ahead of none and behind "
                         f"the best\n{_table(_RANKING, words.ranking(one))}")
    parts.append(_listing("Where model and bench disagree", words.where(figure_data)))
    gap = result["gap"]
    if gap is not None:
        control = ("by the control",) if gap["control"] else ()
        parts.append(_table((*_GAP, *control), words.gap(result)))
        if gap["control"]:
            parts.append(_paragraph(f"The control is {title(figure_data, gap['control']['effect'])}, the best "
                                    "candidate that acts on another quantity."))
    parts.append(_listing("What it cannot say", limits(figure_data)))
    return "\n\n".join(part for part in parts if part)


def _paragraph(text: str) -> str:
    return textwrap.fill(text, _WIDTH)


def _listing(heading: str, items: Iterable[tuple[str, str]]) -> str:
    """Statements under a heading; nothing where there are none."""
    lines = [textwrap.fill(f"{first} {rest}", _WIDTH, initial_indent="- ", subsequent_indent="  ")
             for first, rest in items]
    return "\n".join([heading, *lines]) if lines else ""


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Columns as wide as they must be; the first names its row."""
    cells = [head, *rows]
    widths = [max(len(row[place]) for row in cells) for place in range(len(head))]
    return "\n".join("  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in
                                                           zip(row[1:], widths[1:], strict=True))]) for row in cells)
