"""The few shapes of HTML that a report is made of. Whatever comes in as text goes out escaped."""

import json
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph, of a class if `kind` names one."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def section(title: str, *parts: str) -> str:
    """A heading with markup under it; nothing where there is nothing under it."""
    body = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{body}\n</section>" if body else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; the first cell of a row names it."""
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "\n".join(f"<tr><th>{escape(name)}</th>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
                     for name, *cells in rows)
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def listing(items: Iterable[tuple[str, str]]) -> str:
    """A list of statements, what stands out first; nothing where it is empty."""
    lines = "\n".join(f"<li><strong>{escape(first)}</strong> {escape(rest)}</li>" for first, rest in items)
    return f"<ul>\n{lines}\n</ul>" if lines else ""


def pairs(items: Iterable[tuple[str, str]]) -> str:
    """Names and what they stand for."""
    lines = "\n".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in items)
    return f"<dl>\n{lines}\n</dl>"


def data(name: str, value: Any) -> str:
    """A value for the scripts of the page; no text in it can end the element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    return f'<script type="application/json" id="{escape(name)}">{text}</script>'
