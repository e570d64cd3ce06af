"""HTML elements of the reports. All text is escaped."""

import re
from base64 import b64encode
from collections.abc import Collection, Iterable, Sequence
from html import escape, unescape

_SECTION = re.compile(r'^<section id="([^"]+)">\n<h2>(.*)</h2>', re.MULTILINE)


def paragraph(text: str, css_class: str = "") -> str:
    """Return a paragraph, with a CSS class if one is given."""
    return f'<p class="{css_class}">{escape(text)}</p>' if css_class else f"<p>{escape(text)}</p>"


def coded(text: str) -> str:
    """Return a text as HTML, in which what stands between backticks is code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(text))


def section(title: str, *parts: str) -> str:
    """Return a heading followed by its parts; empty if all parts are empty."""
    body = "\n".join(part for part in parts if part)
    return f'<section id="{anchor(title)}">\n<h2>{escape(title)}</h2>\n{body}\n</section>' if body else ""


def anchor(title: str) -> str:
    """Return the identifier of the section with this title."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"


def contents(body: Iterable[str]) -> str:
    """Return links to the sections in a body; empty if there are fewer than three."""
    sections = [match for part in body for match in _SECTION.findall(part)]
    links = "\n".join(f'<li><a href="#{place}">{escape(unescape(title))}</a></li>' for place, title in sections)
    return f'<nav class="contents" aria-label="Contents">\n<ul>\n{links}\n</ul>\n</nav>' if len(sections) > 2 else ""


def downloads(lead: str, files: Iterable[tuple[str, str, str, bytes]]) -> str:
    """Return links to files that the page contains itself: label, file name, media type and content of each."""
    links = " · ".join(f'<a download="{escape(name)}" href="data:{escape(media_type)};base64,'
                       f'{b64encode(content).decode()}">{escape(label)}</a>'
                       for label, name, media_type, content in files)
    return f"<p><strong>{escape(lead)}</strong> {links}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = ()) -> str:
    """Return a table. The first cell of each row is its header; columns of `words` are aligned to the left."""
    left = [' class="words"' if column in words else "" for column in range(len(head))]
    top = "".join(f"<th{css}>{escape(cell)}</th>" for cell, css in zip(head, left, strict=True))
    body = "\n".join(f"<tr><th>{escape(name)}</th>" + "".join(
        f"<td{css}>{escape(cell)}</td>" for cell, css in zip(cells, left[1:], strict=True)) + "</tr>"
        for name, *cells in rows)
    return (f'<div class="wide" tabindex="0"><table><thead><tr>{top}</tr></thead>\n<tbody>\n{body}\n</tbody></table>'
            "</div>")


def listing(items: Iterable[tuple[str, str]]) -> str:
    """Return a bullet list of (bold lead-in, text) items; empty without items."""
    lines = "\n".join(f"<li><strong>{escape(lead)}</strong> {escape(text)}</li>" for lead, text in items)
    return f"<ul>\n{lines}\n</ul>" if lines else ""


def definitions(items: Iterable[tuple[str, str]]) -> str:
    """Return a definition list of (name, value) items."""
    lines = "\n".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in items)
    return f"<dl>\n{lines}\n</dl>"
