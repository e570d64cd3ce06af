"""Search of jobs and files, by a form that works without a script."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal, get_args
from urllib.parse import urlencode

from slipstick.report.markup import paragraph

from ..front.elements import Entry, Link, group, options, plural
from ..job_filter import Status

Wanted = Literal["all", "studies", "fits", "calibrations", "builds", "tables", "recordings", "benches",
                 "machines"]
_STATUSES: tuple[str, ...] = get_args(Status)
_JOBS = ("studies", "fits", "calibrations", "builds")
PER_PAGE = 50


@dataclass(frozen=True)
class Search:
    """What is looked for: a `text` in names, among what, and jobs of a status; the page counts from 0."""

    text: str = ""
    among: Wanted = "all"
    status: Status | None = None
    page: int = 0

    def address(self, page: int) -> str:
        """Return the address of another page of what was found."""
        query = {"text": self.text, "among": self.among, "status": self.status or "", "page": page}
        return f"/find?{urlencode({name: value for name, value in query.items() if value})}"


def search_form(search: Search) -> str:
    """Return the form."""
    return (f'<form class="act search" action="/find" method="get" role="search"><div class="fields">'
            f'<div class="field"><label for="find-text">Name</label><input type="search" id="find-text" name="text" '
            f'value="{escape(search.text)}" placeholder="part of a name or id" maxlength="200"></div>'
            f"{_select('among', 'Among', search.among, get_args(Wanted))}"
            f"{_select('status', 'Status of jobs', search.status or '', ('', *_STATUSES))}"
            '<p class="send"><button>Search</button></p></div></form>')


def quick_form() -> str:
    """Return the form of the front page: one field."""
    return ('<form class="act quick" action="/find" method="get" role="search"><label class="hidden" for="quick-text">'
            'Search jobs and files</label><input type="search" id="quick-text" name="text" maxlength="200" '
            'placeholder="Search jobs and files"><button class="quiet">Search</button></form>')


def find_page(search: Search, jobs: Sequence[Entry], total: int, files: Sequence[Entry]) -> str:
    """Return the content of the page with the `jobs` on it, of so many in all, and the files."""
    last = min(total, (search.page + 1) * PER_PAGE)
    steps = [Link(text, search.address(page)) for text, page, is_there in (
        ("Newer jobs", search.page - 1, search.page > 0), ("Older jobs", search.page + 1, last < total)) if is_there]
    parts = []
    if search.among in ("all", *_JOBS):
        count = plural(total, "job") + (f", {search.page * PER_PAGE + 1} to {last}" if total > PER_PAGE else "")
        parts += [paragraph(count, "note") if total else "", group("Jobs", jobs, "No job was found.", *steps)]
    if search.among not in _JOBS and search.status is None:
        parts.append(group("Files and machines", files, "No file was found."))
    return "\n".join([f"<h1>Search</h1>\n{search_form(search)}", *parts])


def _select(name: str, label: str, chosen: str, values: Sequence[str]) -> str:
    return (f'<div class="field"><label for="find-{name}">{label}</label><select id="find-{name}" name="{name}">'
            f'{options(((value, value or "any") for value in values), chosen)}</select></div>')
