"""The parts of a report, as values: the page and the text of a study have the same ones."""

from collections.abc import Collection
from dataclasses import dataclass

Entries = list[tuple[str, str]]
"""Bold lead-in and text."""


@dataclass(frozen=True)
class Note:
    """A remark in small print."""

    text: str


@dataclass(frozen=True)
class Items:
    """A bullet list."""

    entries: Entries


@dataclass(frozen=True)
class Table:
    """Rows of cells; the first cell of a row names it."""

    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    words: tuple[int, ...] = ()
    """Columns of words, which are aligned to the left as the first one."""


@dataclass(frozen=True)
class Picture:
    """A picture by its name."""

    name: str


@dataclass(frozen=True)
class File:
    """A file that the page has in it, behind a link with this `label`."""

    label: str
    name: str
    media_type: str
    content: bytes


@dataclass(frozen=True)
class Files:
    """Links to files after a bold lead-in; a text without links has none."""

    lead: str
    files: tuple[File, ...]


Part = str | Note | Items | Table | Picture | Files
"""A paragraph, or one of the above."""


@dataclass(frozen=True)
class Section:
    """A heading and what is below it. Without parts it is left out."""

    title: str
    parts: list[Part]


def show(name: str, pictures: Collection[str]) -> list[Part]:
    """Return the picture `name` if it is one of `pictures`, those for which there are data."""
    return [Picture(name)] if name in pictures else []
