"""The document of the pages: style, navigation, and a script without which they work as well."""

from functools import cache
from html import escape
from pathlib import Path

from slipstick import __version__
from slipstick.report import shell
from slipstick.report.markup import paragraph

from ..front.elements import Link, link_line

_STYLE = Path(__file__).with_name("front.css")
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'self'; connect-src 'self'; img-src 'self' data:"
_ICON = ("data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 16 16'%3E%3Cpath d='M2 3h5v10H2z"
         "M9 3h5v10H9z' fill='%231f5fa8'/%3E%3Cpath d='M7.5 1v14' stroke='%23e0843a'/%3E%3C/svg%3E")
_SECTIONS = {"Jobs": True, "Studies": True, "Fits": True, "Calibrations": False, "Builds": False, "Tables": True,
             "Recordings": True, "Benches": True, "Machines": False}
"""The sections of the front page, and whether it always has them."""
FRESH = {"Cache-Control": "no-store"}
"""Headers of a page that changes with every job."""
RELOAD = '<noscript><meta http-equiv="refresh" content="10"></noscript>'
"""What keeps a page up to date without its script."""


def document(title: str, body: str, head: str = "", part_of: str = "") -> str:
    """Return the HTML document with the main content `body`.

    It is on an entry of the section `part_of` of the front page, or is this page and has sections itself: of those
    that are not always there, these are in the navigation.
    """
    sections = "".join(f'<li><a href="/#{name.lower()}">{name}</a></li>' for name, always in _SECTIONS.items()
                       if always or name == part_of or f'<section id="{name.lower()}"' in body)
    return "\n".join([
        "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">', f"<title>{escape(title)}</title>",
        f'<link rel="icon" href="{_ICON}">', f"<style>{_style()}</style>", head, "</head>", "<body>",
        '<a class="skip" href="#main">Skip to the content</a>',
        '<header><div><a class="brand" href="/">Slipstick</a>',
        f'<nav aria-label="Sections"><ul>{sections}<li><a href="/find">Search</a></li>'
        '<li><a href="/docs">API</a></li></ul></nav></div></header>',
        f'<main id="main">\n{body}\n</main>',
        f"<footer><div>Slipstick {__version__}</div></footer>", "</body>", "</html>", ""])


def scripts(*names: str) -> str:
    """Return the elements of the head that load scripts of these names."""
    return "".join(f'<script src="/static/front/{name}.js" type="module"></script>' for name in names)


def error_page(title: str, cause: str, remedy: str, request_id: str | None) -> str:
    """Return the HTML document about a request that failed, with links to go on; the arguments are text."""
    links = link_line([Link("Front page", "/"), Link("API documentation", "/docs"), Link("Resources", "/v1")])
    note = paragraph(f"Id of the request in the log: {request_id}", "note") if request_id else ""
    return document(title, f'<h1>{escape(title)}</h1>\n{paragraph(f"{cause}.")}{paragraph(f"{remedy}.")}\n'
                           f"{links}\n{note}")


@cache
def _style() -> str:
    return f"{shell.style()}{_STYLE.read_text()}"
