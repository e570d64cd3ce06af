"""The result of a study as plain text: the contents of its report without the pictures."""

import textwrap
from collections.abc import Collection, Iterable, Sequence

from slipstick.machine_studies import MachineStudyResult
from slipstick.report import machine_study
from slipstick.report.shell import SIGN
from slipstick.report.study import content, parts
from slipstick.report.study.glossary import explain
from slipstick.report.study.simulation import lead, tell_confidence
from slipstick.report.study.todo import advise
from slipstick.report.study.warnings import warnings
from slipstick.studies.figures import Figures
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings

_WIDTH = 110


def study_text(result: StudyResult, figures: Figures, settings: StudySettings) -> str:
    """Warnings, the answer, what to do, the findings with their evidence, the blocks, the gap and limitations."""
    cautions = warnings(result, figures.aside)
    sections = [advise(result, figures, settings, cautions), *content.evidence(result, settings, ()),
                *content.background(result, figures, settings)]
    first = [f"{result.sentence}.", tell_confidence(result) or lead(result, settings), SIGN]
    return _join(cautions, first, [*sections, explain(sections)])


def machine_study_text(result: MachineStudyResult) -> str:
    """The same of a declared machine."""
    sections = [machine_study.advise(result), *machine_study.sections(result, ())]
    return _join(machine_study.warnings(result), [f"{result.sentence}.", machine_study.tell_evidence(result)],
                 [*sections, explain(sections)])


def _join(warned: parts.Entries, paragraphs: Sequence[str], sections: Sequence[parts.Section]) -> str:
    texts = [_section(parts.Section("Warnings", [parts.Items(warned)])), *map(_paragraph, paragraphs),
             *map(_section, sections)]
    return "\n\n".join(text for text in texts if text)


def _section(section: parts.Section) -> str:
    """A heading and its parts; empty without any."""
    body = [text for text in map(_part, section.parts) if text]
    return "\n".join([section.title, *body]) if body else ""


def _part(part: parts.Part) -> str:
    match part:
        case parts.Note(text) | str(text):
            return _paragraph(text)
        case parts.Items(entries):
            return _listing(entries)
        case parts.Table(head, rows, words):
            return plain_table(head, rows, words)
        case parts.Picture() | parts.Files():
            return ""


def _paragraph(text: str) -> str:
    return textwrap.fill(text, _WIDTH)


def _listing(entries: Iterable[tuple[str, str]]) -> str:
    return "\n".join(textwrap.fill(f"{label} {statement}", _WIDTH, initial_indent="- ", subsequent_indent="  ")
                     for label, statement in entries)


def plain_table(head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = ()) -> str:
    """Aligned columns; the first one, which labels the rows, and those of words to the left."""
    cells = [head, *rows]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return "\n".join("  ".join(
        cell.ljust(width) if column == 0 or column in words else cell.rjust(width)
        for column, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip() for row in cells)
