"""HTML elements of the pages: groups of entries, each with a name, what it is, and links. All text is escaped."""

import datetime
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from slipstick.report.markup import paragraph

_MADE_UP = re.compile(r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
"""The id of a job whose client did not choose it."""
UNFOLDED = 12
"""Number of rows up to which a table is not folded, and of entries of a list."""


@dataclass(frozen=True)
class Link:
    """A link with its text."""

    text: str
    href: str

    def html(self) -> str:
        """Return the link as HTML."""
        return f'<a href="{escape(self.href)}">{escape(self.text)}</a>'


@dataclass(frozen=True)
class Entry:
    """A job or a file in a list. `more` is HTML; everything else is text."""

    name: str
    href: str
    about: str
    mark: str = ""
    """A word that stands beside the name, such as the status of a job."""
    more: str = ""
    links: Sequence[Link] = ()

    def html(self) -> str:
        """Return the entry as an item of a list."""
        mark = f' <span class="mark {escape(self.mark)}">{escape(self.mark)}</span>' if self.mark else ""
        return (f'<li class="entry"><h3>{Link(self.name, self.href).html()}{mark}</h3>\n<div>'
                f"{paragraph(self.about)}{self.more}{link_line(self.links) if self.links else ''}</div></li>")


def group(title: str, entries: Sequence[Entry], empty: str, *links: Link, most: int | None = None) -> str:
    """Return a section with a list of entries, or with the text `empty` if there are none.

    Entries after the first `most` are folded. The links belong to the list. Without entries and text it is empty.
    """
    if not entries and not empty:
        return ""
    anchor = title.split()[0].lower()
    shown, folded = entries[:most], entries[len(entries[:most]):]
    body = _list(shown) if entries else paragraph(empty, "note")
    if folded:
        body += f"\n<details><summary>{len(folded):,} more</summary>\n{_list(folded)}\n</details>"
    below = f"{link_line(links)}\n" if entries and links else ""
    return (f'<section id="{anchor}" aria-labelledby="{anchor}-title"><h2 id="{anchor}-title">{escape(title)}</h2>\n'
            f"{body}\n{below}</section>")


def _list(entries: Sequence[Entry]) -> str:
    return '<ul class="entries">\n' + "\n".join(entry.html() for entry in entries) + "\n</ul>"


def fold(content: str, count: int, noun: str) -> str:
    """Return HTML with `count` rows that is folded where it is long, below a summary with their number."""
    if count <= UNFOLDED:
        return content
    return f"<details><summary>All {plural(count, escape(noun))} as a table</summary>\n{content}\n</details>"


def options(choices: Iterable[tuple[str, str]], chosen: str | None = None) -> str:
    """Return the options of a field by value and text, of which one may be `chosen`."""
    return "".join(f'<option value="{escape(value)}"{" selected" * (value == chosen)}>{escape(text)}</option>'
                   for value, text in choices)


def link_line(links: Iterable[Link]) -> str:
    """Return links beside each other."""
    return f'<p class="links">{" · ".join(link.html() for link in links)}</p>'


def listings(address: str) -> list[Link]:
    """Return links to the whole list at `address`, for programs."""
    return [Link("All as JSON", address), Link("All as CSV", f"{address}?format=csv")]


def job_name(kind: str, subject: str, id: str, submitted: datetime.datetime | None) -> str:
    """Return what people call a job: the id that a client chose, or else its kind, its subject and its day."""
    if not _MADE_UP.fullmatch(id) or submitted is None:
        return id
    year = "" if submitted.year == datetime.datetime.now(datetime.UTC).year else f" {submitted.year}"
    return f"{kind} of {subject}, {submitted.day} {submitted:%b}{year}"


def moment(time: datetime.datetime | None) -> str:
    """Return a time in words, to the minute."""
    return "" if time is None else f"{time:%Y-%m-%d %H:%M} UTC"


def plural(count: int, noun: str, many: str = "") -> str:
    """Return a number with its noun."""
    return f"{count:,} {noun if count == 1 else many or f'{noun}s'}"
