"""What to do next, as commands to copy: shown as long as a table, recordings, a worker or a first job is missing."""

from html import escape

from slipstick.report.markup import paragraph
from slipstick.storage.library import Library

from ..front.elements import Link

_JSON = "--header 'Content-Type: application/json'"


def first_steps(library: Library, workers: int, jobs: int, address: str) -> str:
    """Return the steps that are left as HTML, empty if there are none; `address` is that of the service."""
    recordings, benches, steps = library.recordings(), library.benches(), []
    bench = (benches or ["mine"])[-1]
    if not benches:
        steps.append(("Write a bench: parameters, sensors and conditions of your test bench in one file.",
                      "slipstick bench new tables/mine.toml"))
    if not library.tables():
        steps.append(("Build a table of shifting times of the bench. It takes about a minute.",
                      f"slipstick build --bench tables/{bench}.toml --out tables/nominal.h5"))
    if not recordings:
        steps.append(("Upload recordings: one row for each engagement, or an HDF5 file with signals.",
                      f"curl --data-binary @mine.csv --header 'Content-Type: text/csv' '{address}/v1/recordings?name="
                      f"mine&bench={bench}'"))
    if not workers:
        steps.append(("Start a worker, which runs all jobs.", "slipstick work"))
    if not jobs:
        name = recordings[-1] if recordings else "mine"
        steps.append(("Submit a study: which physical effect do the recordings show and the model lack?",
                      f"curl --data '{{\"recordings\": \"{name}\"}}' {_JSON} {address}/v1/studies"))
    if not steps:
        return ""
    items = "\n".join(f'<li>{paragraph(text)}<pre><code>{escape(command)}</code></pre></li>'
                      for text, command in steps)
    docs = Link("The API page", "/docs").html()
    return (f'<section id="next" aria-labelledby="next-title"><h2 id="next-title">What to do next</h2>\n<ol '
            f'class="steps">\n{items}\n</ol>\n<p class="note">{docs} describes every operation and can try it.</p>\n'
            "</section>")
