"""The HTML document shared by all reports: self-contained, without scripts, with its pictures as SVG."""

import datetime
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from slipstick import __version__
from slipstick.pictures.accessible import dark_style
from slipstick.pictures.rendering import inline
from slipstick.pictures.theme import Spec
from slipstick.recordings.shipped import SIMULATED
from slipstick.report import words
from slipstick.report.markup import contents, definitions, listing, paragraph, section

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"
"""Content security policy: the page loads and runs nothing, even if a name in the data contains markup."""
SIGN = "All differences are measured minus predicted: positive where the test bench locks later, or reads more."


def document(kind: str, name: str, title: str, warnings: Iterable[tuple[str, str]], body: Sequence[str],
             box: Iterable[str] = (), facts: Iterable[str] = (), home: str = "") -> str:
    """Return the HTML document of a `kind` of work on what has this `name`, such as "fit to" the recordings "mine".

    After the title come the `box` of what to do, the `facts`, and a table of contents of the sections in `body`. The
    `warnings` come before the title, or after a box, which names them. `home` is the relative address of the service
    that has the report, if any.
    """
    warned, over, box = listing(warnings), f"Slipstick · {kind} {name}", list(box)
    aside = [f'<aside class="warnings" id="warnings" aria-label="Warnings">\n{warned}\n</aside>'] if warned else []
    return "\n".join([
        "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">',
        f"<title>{escape(title)} · {escape(kind)} {escape(name)}</title>", f"<style>{style()}</style>", "</head>",
        "<body>", "<main>", linked(over, "Slipstick", home) if home else paragraph(over, "over"),
        *([] if box else aside), f"<h1>{escape(title)}</h1>", *box, *(aside if box else []),
        *facts, contents(body), *body, "</main>", "</body>", "</html>", ""])


def linked(text: str, word: str, address: str) -> str:
    """Return the line over a title, whose first `word` is a link."""
    return f'<p class="over"><a href="{escape(address)}">{escape(word)}</a>{escape(text.removeprefix(word))}</p>'


def home_of(job: Mapping[str, Any]) -> str:
    """Return the relative address of the service from the report of a job that it has; empty without a service."""
    return "../../../" if job.get("links") else ""


def are_simulated(job: Mapping[str, Any]) -> bool:
    """Return whether the recordings of a job are shipped ones, all of which are simulated."""
    return job.get("recordings_digest") in SIMULATED


def tell_recordings(job: Mapping[str, Any]) -> str:
    """Return the name of the recordings of a job, and whether they are the shipped ones."""
    return f"recordings {job['recordings']}" + " (shipped, simulated)" * are_simulated(job)


def tell_facts(job: Mapping[str, Any], entries: Iterable[str]) -> str:
    """Return what was studied or fitted, with the date, in one line."""
    ended = job.get("ended") or job.get("submitted")
    day = [f"{datetime.datetime.fromisoformat(str(ended)):%-d %B %Y}"] if ended else []
    return paragraph(" · ".join([*(entry for entry in entries if entry), *day]), "facts")


def figures(specs: Mapping[str, Spec], captions: Mapping[str, str], rows: int | None = None) -> dict[str, str]:
    """Return name -> figure element of each picture.

    Its title is a heading, which wraps on a narrow screen; the picture itself scrolls there instead of shrinking. With
    `rows`, a picture of more rows is drawn in parts of as many, between which a printed page may end.
    """
    drawn = {name: "\n".join(inline(parts, dict.fromkeys(parts, captions[name])).values())
             for name, spec in specs.items() for parts in [_split(name, spec, rows)]}
    return {name: "\n".join([
        f'<figure id="picture-{escape(name)}">', f"<h3>{escape(spec['title']['text'])}</h3>",
        paragraph(" ".join(spec["title"]["subtitle"]), "note"),
        f'<div class="picture" tabindex="0">{drawn[name]}</div>',
        f"<figcaption>{escape(captions[name])}</figcaption>", "</figure>"]) for name, spec in specs.items()}


def _split(name: str, spec: Spec, rows: int | None) -> dict[str, Spec]:
    """Return a picture in parts of so many `rows` by their names; of few rows, the picture itself."""
    views = spec.get("vconcat", [])
    if rows is None or len(views) <= rows:
        return {name: spec}
    return {f"{name}-{start // rows}": {**spec, "vconcat": views[start:start + rows]}
            for start in range(0, len(views), rows)}


def provenance(job: Mapping[str, Any], output: Mapping[str, Any], entries: Iterable[tuple[str, str | None]]) -> str:
    """Return the section on provenance: `entries`, then settings, times and version. Empty entries are omitted."""
    times = {name: ", ".join(f"{stage} {words.duration(seconds)}" for stage, seconds in output[name].items())
             for name in ("seconds", "processor_seconds")}
    settings = ", ".join(f"{name} {json.dumps(value)}" for name, value in job.get("settings", {}).items())
    entries = [
        *entries, ("identifier", job["id"]), ("settings", settings), ("wall time", times["seconds"]),
        ("processor time", times["processor_seconds"]), ("submitted", job["submitted"]), ("ended", job["ended"]),
        ("version", f"Slipstick {__version__}")]
    return section("Provenance", definitions([(name, value) for name, value in entries if value]))


@cache
def style() -> str:
    """Return the style sheet of all pages."""
    style = Path(__file__).with_name("style.css").read_text()
    return f"{style}@media screen and (prefers-color-scheme: dark) {{\n{dark_style()}\n}}\n"
