"""HTML elements of the reports. All text is escaped."""

from collections.abc import Collection, Iterable, Sequence
from html import escape


def paragraph(text: str, css_class: str = "") -> str:
    """Return a paragraph, with a CSS class if one is given."""
    return f'<p class="{css_class}">{escape(text)}</p>' if css_class else f"<p>{escape(text)}</p>"


def section(title: str, *parts: str) -> str:
    """Return a heading followed by its parts; empty if all parts are empty."""
    body = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{body}\n</section>" if body else ""


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
