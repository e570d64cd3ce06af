"""The HTML document shared by all reports: self-contained, its pictures drawn in the browser without a network."""

import json
from collections.abc import Iterable, Mapping
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from slipstick import __version__
from slipstick.pictures.theme import Spec
from slipstick.report import words
from slipstick.report.markup import definitions, json_element, paragraph, section

_FOLDER = Path(__file__).parent
_LIBRARIES = ("vega", "vega-lite", "vega-embed")
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content security policy: the page loads nothing, even if a name in the data contains markup."""


def document(kind: str, name: str, title: str, body: Iterable[str], specs: Mapping[str, Spec]) -> str:
    """Return the HTML document of a fit or study (`kind`) called `name`, with the `specs` of its pictures."""
    return "\n".join([
        "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(name)}: {escape(title)}</title>", f"<style>{_file('style.css')}</style>", "</head>",
        "<body>", "<main>", paragraph(f"Slipstick · {kind} {name}", "over"), f"<h1>{escape(title)}</h1>", *body,
        "</main>", json_element("pictures", specs),
        *(f"<script>{_file(f'vega/{library}.min.js')}</script>" for library in _LIBRARIES),
        f"<script>{_file('draw.js')}</script>", f"<!--\n{_licences()}\n-->", "</body>", "</html>", ""])


def figures(names: Iterable[str], captions: Mapping[str, str]) -> str:
    """Return the section of the named pictures."""
    return section("Pictures", *(figure(name, captions[name]) for name in names))


def figure(name: str, caption: str) -> str:
    """Return a figure with its caption; the script of the page draws the picture into it."""
    return (f'<figure>\n<div class="picture" id="picture-{escape(name)}"></div>\n'
            f"<figcaption>{escape(caption)}</figcaption>\n</figure>")


def provenance(job: Mapping[str, Any], output: Mapping[str, Any], entries: Iterable[tuple[str, str | None]]) -> str:
    """Return the section on provenance: `entries`, then settings, times and version. Empty entries are omitted."""
    times = {name: ", ".join(f"{stage} {words.duration(seconds)}" for stage, seconds in output[name].items())
             for name in ("seconds", "processor_seconds")}
    settings = ", ".join(f"{name} {json.dumps(value)}" for name, value in job["settings"].items())
    entries = [
        *entries, ("settings", settings), ("wall time", times["seconds"]),
        ("processor time", times["processor_seconds"]), ("submitted", job["submitted"]), ("ended", job["ended"]),
        ("version", f"Slipstick {__version__}")]
    return section("Provenance", definitions([(name, value) for name, value in entries if value]))


@cache
def _file(name: str) -> str:
    return (_FOLDER / name).read_text()


@cache
def _licences() -> str:
    """Return the licences of the embedded scripts, which must accompany every copy of them."""
    files = [_FOLDER / "vega" / "NOTICE", *sorted((_FOLDER / "vega").glob("*.LICENSE"))]
    return "\n\n".join(f"{file.name}\n\n{file.read_text()}" for file in files)
