"""What to do next, with links to the forms: shown while files, a worker or a first job are missing."""

from collections.abc import Sequence
from html import escape
from urllib.parse import urlencode

from slipstick.storage.library import Library

from ..front.elements import Link


def first_steps(library: Library, machines: Sequence[str], workers: int, jobs: int) -> str:
    """Return the steps that are left as HTML, empty if there are none; `machines` are declared and not used yet."""
    recordings, benches = library.recordings(), library.benches()
    steps = []
    if not benches and not recordings:
        steps.append(_step("Add a bench", "/upload#upload-bench", "the parameters, sensors and conditions of your test "
                           "bench in a file. To write it, begin with a template:", "slipstick bench new mine.toml"))
    if not recordings:
        steps.append(_step("Add recordings", "/upload", "one row for each engagement, a file with signals, or the "
                           "files of a data logger"))
    steps += [_step(f"Add recordings of {machine}", f"/upload?{urlencode({'machine': machine})}#read-files",
                    "the files of a data logger") for machine in machines]
    if not workers:
        steps.append(_step("Start a worker", "", "it runs all jobs:", "slipstick work"))
    if recordings and not jobs:
        steps.append(_step(f"Study “{recordings[-1]}”", f"/recordings/{recordings[-1]}#study", "which physical effect "
                           "do the recordings show and the model lack?"))
    if benches and not library.tables():
        steps.append(_step(f"Build a table of the bench {benches[-1]}", f"/benches/{benches[-1]}#build",
                           "fits and propagations interpolate its shifting times. It takes about a minute"))
    if not steps:
        return ""
    items = "\n".join(f"<li>{step}</li>" for step in steps)
    docs = Link("The API page", "/docs").html()
    return (f'<section id="next" aria-labelledby="next-title"><h2 id="next-title">What to do next</h2>\n<ol '
            f'class="steps">\n{items}\n</ol>\n<p class="note">{docs} has the same operations for programs.</p>\n'
            "</section>")


def _step(title: str, href: str, about: str, command: str = "") -> str:
    """A step whose form is at `href`, or that is a command."""
    linked = Link(title, href).html() if href else escape(title)
    shown = f"<pre><code>{escape(command)}</code></pre>" if command else ""
    return f"<p><strong>{linked}</strong>: {escape(about)}{'' if about[-1] in ':?' else '.'}</p>{shown}"
