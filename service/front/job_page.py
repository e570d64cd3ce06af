"""The page of a job: what it is of, what it is doing or has found, and what can be done with it."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Literal, get_args

from slipstick.report.markup import definitions, paragraph, section
from slipstick.report.words import duration
from slipstick.storage.library import Library

from ..build_schemas import Build
from ..front.elements import Link, link_line, moment, options
from ..front.jobs import Active, Listed, answer_of, describe_progress, describe_subject, name_of, page_of
from ..job_kind import JobKind
from ..job_store import JobStore
from ..study_schemas import FindingLaw
from .forms import WITHOUT_SCRIPT, Form, folded

_NO_WORKER = paragraph("No worker is alive. The job waits until one is started: slipstick work", "doing")
_TEXTS = {"report": "Report", "result": "Result as JSON", "residuals": "Residuals as CSV",
          "model": "Extended model as JSON", "pictures": "Pictures"}
_FILES: Mapping[str, tuple[str, Callable[[Library, str], bool]]] = {
    "recordings": ("recordings", Library.has_recordings), "table": ("tables", Library.has_table),
    "bench": ("benches", Library.has_bench)}
"""The fields of a job that name files: the folder of their pages, and whether there still is such a file."""
_GONE = {"build": "its result"}
_GONE_AS_A_RULE = "its result, report and pictures"
_LOST = {"build": "The runs that are done are kept: the same build goes on with them."}
_LOST_AS_A_RULE = "What it has computed is lost."
_FORMATS = {"json": "JSON", "csv": "CSV", "mat": "MATLAB", "mo": "Modelica", "h": "C"}
Compared = Literal["study", "fit", "calibration"]
"""The kinds of jobs that are compared."""


def job_page(kind: JobKind[Listed, Active], store: JobStore, job: Active, library: Library, workers: int,
             others: Sequence[Listed], laws: Sequence[FindingLaw], orders: Mapping[str, Form],
             links: Sequence[Link]) -> str:
    """Return the content of the page of a job, which can be compared with `others` of its kind.

    `laws` are those that a study has measured, and `orders` the jobs that its result can be given to. `links` are those
    to what it is of, beside its files.
    """
    ended = job.status in ("done", "failed", "cancelled")
    state = f'<div id="state">{job_state(store, job, workers)}</div>' if ended else \
        f'<div id="live" data-events="/{kind.plural}/{job.id}/live">{job_state(store, job, workers)}</div>'
    address = job.links["self"]
    cancel = "" if ended else folded(f"Cancel the {kind.name}", Form(
        "cancel", f"{address}/cancel", f"Cancel the {kind.name}", method="POST", body="none", then="",
        about=f"It stops within a second. {_LOST.get(kind.name, _LOST_AS_A_RULE)}").html())
    gone = _GONE.get(kind.name, _GONE_AS_A_RULE) if job.status == "done" else "what it was asked"
    delete = folded(f"Delete the {kind.name}", paragraph(
        f"The {kind.name} “{name_of(job)}” is removed for everybody with {gone}, and cannot be restored. Recordings "
        "and tables stay."), Form("delete", address, f"Delete the {kind.name}", method="DELETE", body="none", then="/",
                              is_dangerous=True).html()) if ended else ""
    return "\n".join([
        paragraph(kind.name.capitalize(), "over"), f"<h1>{escape(describe_subject(job))}</h1>", state,
        section("Results", _downloads(kind, job, library, laws, bool(orders))) if job.status == "done" else "",
        section("What to do", WITHOUT_SCRIPT, *(folded(title, form.html()) for title, form in orders.items()),
                _comparison(kind, job, others), cancel, delete),
        section("Origin", _origin(job, library, links))])


def job_state(store: JobStore, job: Active, workers: int) -> str:
    """Return what a job is doing, or has found, as HTML."""
    mark = f'<p><span class="mark {job.status}">{job.status}</span></p>'
    if job.status == "done":
        return mark + paragraph(answer_of(store, job.id, str(job.ended)), "lead")
    if job.status in ("failed", "cancelled"):
        return mark + (paragraph(job.problem, "lead") if job.problem else "")
    return mark + describe_progress(job) + ("" if workers or job.missing_machine else _NO_WORKER)


def _downloads(kind: JobKind[Listed, Active], job: Active, library: Library, laws: Sequence[FindingLaw],
               has_model: bool) -> str:
    addresses = {**job.links, "pictures": f"/{kind.plural}/{job.id}/pictures"}
    if "residuals" in addresses:
        addresses["residuals"] += "?format=csv"
    links = [Link("Table", f"/tables/{job.name}")] if isinstance(job, Build) and library.has_table(job.name) else []
    links += [Link(text, addresses[name]) for name, text in _TEXTS.items()
              if name in job.links and (has_model or name != "model")]
    items = [link.html() for link in links]
    items += [f"Law of “{escape(law.title)}” as " + " · ".join(
        Link(_FORMATS.get(form, form), address).html() for form, address in law.links.items()) for law in laws]
    return "<ul>" + "".join(f"<li>{item}</li>" for item in items) + "</ul>"


def _comparison(kind: JobKind[Listed, Active], job: Active, others: Sequence[Listed]) -> str:
    if job.status != "done" or not others or kind.name not in get_args(Compared):
        return ""
    return folded(f"Compare it with another {kind.name}", comparison_form(kind, others, job.id))


def comparison_form(kind: JobKind[Listed, Active], jobs: Sequence[Listed], first: str, second: str = "") -> str:
    """Return a form that chooses two jobs of a kind; it works without a script. A `first` one alone is not asked."""
    def choice(name: str, label: str, chosen: str) -> str:
        return (f'<div class="field"><label for="compare-{name}">{label}</label><select id="compare-{name}" '
                f'name="{name}">{options(((job.id, _label(job)) for job in jobs), chosen)}</select></div>')

    fixed = f'<input type="hidden" name="first" value="{escape(first)}">' if first and not second else \
        choice("first", "First", first)
    return (f'<form class="act" action="/compare" method="get"><input type="hidden" name="kind" value="{kind.name}">'
            f'<div class="fields">{fixed}{choice("second", "Second" if second else "With", second)}</div>'
            '<p class="send"><button>Compare</button></p></form>')


def _label(job: Listed) -> str:
    return f"{name_of(job)}: {describe_subject(job)}, {moment(job.ended)}"


def _origin(job: Active, library: Library, further: Sequence[Link]) -> str:
    links = [f"{field} {Link(name, f'/{folder}/{name}').html()}" if has(library, name) else
             f"{field} {escape(name)}, which was renamed or deleted"
             for field, (folder, has) in _FILES.items() if (name := getattr(job, field, None))]
    files = '<p class="links">' + " · ".join([*links, *(link.html() for link in further)]) + "</p>"
    times = [("submitted", moment(job.submitted)), ("started", moment(job.started)), ("ended", moment(job.ended))]
    budget = "none" if job.time_budget is None else duration(job.time_budget)
    return files + definitions([("id", job.id), *((name, time) for name, time in times if time),
                                ("time limit", budget)]) + \
        link_line([Link("Everything as JSON", job.links["self"])])


def pictures_page(kind: JobKind[Listed, Active], job: Listed, figures: Mapping[str, tuple[str, str, str]]) -> str:
    """Return the content of the page of the pictures of a job: by name, the title, the caption and the SVG element."""
    drawn = []
    for name, (title, caption, element) in figures.items():
        address = f"{job.links['pictures']}/{name}?format="
        links = link_line(Link(text, address + form) for text, form in (
            ("PNG", "png"), ("SVG", "svg"), ("Vega-Lite with its data", "json")))
        drawn.append(f'<figure id="{name}"><h3>{escape(title)}</h3><div class="picture" tabindex="0">{element}</div>'
                     f"<figcaption>{escape(caption)}</figcaption>{links}</figure>")
    return "\n".join([paragraph(kind.name.capitalize(), "over"), f"<h1>Pictures: {escape(describe_subject(job))}</h1>",
                      link_line([Link(name_of(job), page_of(job))]), *drawn])
