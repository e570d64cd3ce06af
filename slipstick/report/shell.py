"""The shell of every report: one HTML page that needs nothing but a browser, which draws the pictures in it."""

import json
from collections.abc import Iterable, Mapping
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from slipstick import __version__
from slipstick.pictures.theme import Spec
from slipstick.report import words
from slipstick.report.markup import data, pairs, paragraph, section

_HERE = Path(__file__).parent
_LIBRARIES = ("vega", "vega-lite", "vega-embed")
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Nothing is fetched from anywhere, whatever a name in the data may hold."""


def document(kind: str, name: str, title: str, body: Iterable[str], drawn: Mapping[str, Spec]) -> str:
    """The whole page of the `kind` called `name`: a title, markup under it, and the pictures `drawn` in its figures."""
    return "\n".join([
        "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(name)}: {escape(title)}</title>", f"<style>{_file('style.css')}</style>", "</head>",
        "<body>", "<main>", paragraph(f"Slipstick · {kind} {name}", "over"), f"<h1>{escape(title)}</h1>", *body,
        "</main>", data("pictures", drawn),
        *(f"<script>{_file(f'vega/{library}.min.js')}</script>" for library in _LIBRARIES),
        f"<script>{_file('draw.js')}</script>", f"<!--\n{_licences()}\n-->", "</body>", "</html>", ""])


def figures(drawn: Iterable[str], captions: Mapping[str, str]) -> str:
    """A section with a place for each of the pictures."""
    return section("Pictures", *(figure(name, captions[name]) for name in drawn))


def figure(name: str, caption: str) -> str:
    """The place of a picture."""
    return (f'<figure>\n<div class="picture" id="picture-{escape(name)}"></div>\n'
            f"<figcaption>{escape(caption)}</figcaption>\n</figure>")


def origin(job: Mapping[str, Any], output: Mapping[str, Any], said: Iterable[tuple[str, str | None]]) -> str:
    """A section on where the page comes from: what is `said` of that alone, and what every job and output tell."""
    spent = {name: ", ".join(f"{stage} {words.duration(seconds)}" for stage, seconds in output[name].items())
             for name in ("seconds", "processor_seconds")}
    settings = ", ".join(f"{name} {json.dumps(value)}" for name, value in job["settings"].items())
    known: list[tuple[str, str | None]] = [
        *said, ("settings", settings), ("time", spent["seconds"]), ("processor time", spent["processor_seconds"]),
        ("submitted", job["submitted"]), ("ended", job["ended"]), ("version", f"Slipstick {__version__}")]
    return section("Where it comes from", pairs([(name, value) for name, value in known if value]))


@cache
def _file(name: str) -> str:
    return (_HERE / name).read_text()


@cache
def _licences() -> str:
    """The terms under which the scripts of the page may travel with it."""
    files = [_HERE / "vega" / "NOTICE", *sorted((_HERE / "vega").glob("*.LICENSE"))]
    return "\n\n".join(f"{file.name}\n\n{file.read_text()}" for file in files)
