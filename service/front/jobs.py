"""The jobs of the front page: what runs and waits with its progress, and what has ended with its answer."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from html import escape

from slipstick.interface.calibrate import CalibrationResult
from slipstick.interface.machine_study import MachineCalibration
from slipstick.pictures.theme import in_words
from slipstick.report.markup import paragraph
from slipstick.report.words import fitted, listed
from slipstick.storage.library import Library
from slipstick.studies.progress import StudyProgress

from ..build_schemas import Build, BuildWithProgress
from ..calibration_schemas import Calibration, CalibrationWithProgress
from ..fit_schemas import Fit, FitProgress, FitWithProgress
from ..front.elements import Entry, Link, group, job_name, listings, moment, plural
from ..front.laws import drawable_law
from ..job_filter import ENDED, JobFilter
from ..job_kind import JobKind
from ..job_store import JobStore
from ..jobs import Progress, finished_job, is_of_machine, is_partial, output_of
from ..routes.builds import BUILDS
from ..routes.calibrations import CALIBRATIONS
from ..routes.fits import FITS
from ..routes.studies import STUDIES
from ..study_schemas import Study, StudyWithProgress

_STAGES = {"start": "starting the simulator, which is compiled at its first use", "search": "searching",
           "refine": "refining the best candidate", "intervals": "computing intervals",
           "conclude": "assembling the result"}
_NO_WORKER = ('<aside class="warnings"><p><strong>No worker is alive.</strong> Jobs wait until one is started: '
              "<code>slipstick work</code></p></aside>")
Active = FitWithProgress | StudyWithProgress | CalibrationWithProgress | BuildWithProgress
Listed = Fit | Study | Calibration | Build
JOB_KINDS: tuple[JobKind[Listed, Active], ...] = (STUDIES, FITS, CALIBRATIONS, BUILDS)
_ALWAYS_LISTED = STUDIES, FITS
"""The kinds to which each page links."""


def job_sections(stores: Mapping[str, JobStore], alive: int, library: Library, count: int, steps: str) -> str:
    """Return the sections of the jobs, `count` of each kind: the first that run and wait, the newest that ended.

    So many workers are `alive`. `steps` is HTML that comes before the jobs.
    """
    kinds = [(kind, stores[kind.name]) for kind in JOB_KINDS]
    active = [kind.with_progress(store, job) for kind, store in kinds for job in store.active(count)]
    active.sort(key=lambda job: (job.status != "running", job.ahead or 0))
    counts: Counter[str] = Counter()
    for _, state, _, number in stores["fit"].table.states("PENDING", "ENQUEUED"):
        counts[state] += number
    running, waiting = counts["PENDING"], counts["ENQUEUED"]
    return "\n".join([
        f'<p class="counts"><span class="dot {"on" if alive else "off"}"></span>{plural(alive, "worker")} alive · '
        f"{running} running · {waiting} waiting</p>",
        _NO_WORKER if active and not alive else "", steps,
        group("Jobs", [active_entry(job) for job in active], "No job is running or waiting.",
              *_links_to_hidden(running + waiting - len(active))),
        *(_list_ended(kind, store, library, count) for kind, store in kinds)])


def _list_ended(kind: JobKind[Listed, Active], store: JobStore, library: Library, count: int) -> str:
    title = kind.plural.capitalize()
    jobs = store.newest(count + 1, 0, JobFilter(status=ENDED))
    older = Link(f"Show more {title.lower()}", f"/?count={min(1000, 2 * count)}#{title.lower()}")
    return group(title, [ended_entry(store, kind.without_progress(store, job), library) for job in jobs[:count]],
                 f"No {kind.name} has ended yet." if kind in _ALWAYS_LISTED else "",
                 *([older] if len(jobs) > count else []), *listings(store.address))


def _links_to_hidden(count: int) -> list[Link]:
    """Links to the lists with the jobs that wait, if `count` of them are not on the page."""
    waiting = [Link(f"{kind.plural} that wait", f"{kind.address}?status=queued") for kind in JOB_KINDS]
    first = replace(waiting[0], text=f"{plural(count, 'more job')}: {waiting[0].text}")
    return [first, *waiting[1:]] if count > 0 else []


def describe_subject(job: Listed) -> str:
    """Return what a job is of, in words."""
    if isinstance(job, Build):
        subject = f"the machine “{job.machine}”" if job.machine else f"the bench {job.bench}"
        return f"Build of the table {job.name} of {subject}"
    if not isinstance(job, Fit):
        subject = f"of the machine “{job.machine}”" if job.machine else f"on the bench {job.bench}"
        return f"{'Study of' if isinstance(job, Study) else 'Calibration to'} “{job.recordings}” {subject}"
    model = f"of the simulator at the values of {job.table}" if job.simulate else f"of the table {job.table}"
    return f"Fit of {listed([in_words(name) for name in job.parameters])} {model} to “{job.recordings}”"


def active_entry(job: Active) -> Entry:
    """Return a job that runs or waits as an entry of a list."""
    links = [Link("Status as JSON", job.links["self"])]
    return Entry(name_of(job), page_of(job), describe_subject(job), job.status, describe_progress(job), links)


def page_of(job: Listed) -> str:
    """Return the address of the page of a job."""
    return job.links["self"].removeprefix("/v1")


def describe_progress(job: Active) -> str:
    """Progress in words, and as a bar where the share that is done is known."""
    left = None if job.progress is None else job.progress.budget_left
    return _describe_stage(job) + ("" if left is None or job.status != "running" else
                                   paragraph(f"{_round_seconds(left)} of the time budget left", "doing"))


def _describe_stage(job: Active) -> str:
    if job.status == "queued":
        place = "Next in its queue" if job.ahead == 0 else f"{plural(job.ahead or 0, 'job')} before it in its queue"
        return paragraph(place, "doing") + (paragraph(f"{job.note}.", "doing") if job.missing_machine else "")
    match job.progress:
        case StudyProgress(step=step, steps=steps, done=done, doing=doing):
            return _bar(f"Steps of {job.id}", done) + paragraph(f"Step {step} of {steps}. {doing}", "doing")
        case Progress(doing=doing, done=done):
            bar = "" if done is None else _bar(f"Runs of {job.id}", done)
            return bar + paragraph(doing[0].upper() + doing[1:], "doing")
        case FitProgress(stage="search", done=done, seconds_left=left):
            rest = "" if left is None else f", at most {_round_seconds(left)} left"
            return _bar(f"Search of {job.id}", done) + paragraph(f"Searching: {_percent(done)}{rest}", "doing")
        case FitProgress(stage=stage):
            return paragraph(f"Search complete, {_STAGES[stage]}", "doing")
    return paragraph("Starting", "doing")


def _bar(label: str, done: float) -> str:
    return f'<progress value="{done:.3f}" aria-label="{escape(label)}">{_percent(done)}</progress>'


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _round_seconds(seconds: float) -> str:
    """Return a time that is an estimate: whole seconds, minutes from two on, tenths of hours."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def ended_entry(store: JobStore, job: Listed, library: Library) -> Entry:
    """Return a job that has ended as an entry of a list."""
    address = job.links["self"]
    about = f"{describe_subject(job)}, {moment(job.ended)}"
    if job.status != "done":
        cause = paragraph(str(store.find(job.id).error), "doing") if job.status == "failed" else ""
        return Entry(name_of(job), page_of(job), about, job.status, cause, [Link("Status as JSON", address)])
    answer = _thumbnail(store, job) + paragraph(answer_of(store, job.id, str(job.ended)), "answer")
    made = [Link("Report", job.links["report"])] if not isinstance(job, Build) else [
        Link("Table", f"/tables/{job.name}")] if library.has_table(job.name) else []
    return Entry(name_of(job), page_of(job), about, "", answer, [
        *made, Link("Result as JSON", job.links["result"]),
        *([Link("Residuals as CSV", f"{job.links['residuals']}?format=csv")] if "residuals" in job.links else [])])


def name_of(job: Listed) -> str:
    """Return what people call a job."""
    subject = job.name if isinstance(job, Build) else job.table if isinstance(job, Fit) else job.recordings
    return job_name(type(job).__name__.removesuffix("WithProgress").lower(), subject, job.id, job.submitted)


def _thumbnail(store: JobStore, job: Listed) -> str:
    """A small picture of the law that a study measured; empty without one."""
    title = _title_of_law(store, job.id, str(job.ended)) if isinstance(job, Study) else ""
    if not title:
        return ""
    picture = (f'<img src="/studies/{escape(job.id)}/law.svg" width="154" height="80" loading="lazy" '
               f'alt="{escape(title)}">')
    return f'<a class="law" href="{escape(job.links["report"])}">{picture}</a>'


@lru_cache(maxsize=1000)
def _title_of_law(store: JobStore, id: str, ended: str) -> str:
    drawable = drawable_law(output_of(finished_job(store, id)))
    return "" if drawable is None else drawable[0]


@lru_cache(maxsize=1000)
def answer_of(store: JobStore, id: str, ended: str) -> str:
    """What a job found, in a sentence. Read once, since results are large; `ended` tells jobs of the same id apart."""
    job = finished_job(store, id)
    output = output_of(job)
    if store.workflow == "study":
        return str(output["result"]["sentence"])
    if store.workflow == "build":
        shape = " × ".join(map(str, output["result"]["shape"]))
        without = sum(number for name, number in output["result"]["statuses"].items() if name != "locked")
        return f"{shape} runs, {without:,} of them without an output"
    if store.workflow == "calibration":
        result = MachineCalibration if is_of_machine(job) else CalibrationResult
        return result.from_dict(output["result"]).summary()[0]
    bound = [in_words(remark["unknown"]) for remark in output["result"]["remarks"] if remark.get("at_bound")]
    at_bound = f"; {listed(bound)} at {'its bound' if len(bound) == 1 else 'their bounds'}" if bound else ""
    values = "partial result: " * is_partial(job) + fitted(output["physical"]) + at_bound
    return values[0].upper() + values[1:]
