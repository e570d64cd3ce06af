"""The jobs of the front page: what runs and waits with its progress, and what has ended with its answer."""

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from html import escape

from slipstick.pictures.theme import in_words
from slipstick.report.markup import paragraph
from slipstick.report.words import fitted, listed
from slipstick.studies.progress import StudyProgress

from ..fit_schemas import Fit, FitProgress, FitWithProgress
from ..front.elements import Entry, Link, group, job_name, listings, moment, plural
from ..front.laws import drawable_law
from ..heartbeats import Heartbeats
from ..job_filter import ENDED, JobFilter
from ..job_store import JobStore
from ..jobs import finished_job, is_partial, output_of
from ..routes.fits import FITS
from ..routes.studies import STUDIES
from ..study_schemas import Study, StudyWithProgress

_STAGES = {"start": "starting the simulator, which is compiled at its first use", "search": "searching",
           "refine": "refining the best candidate", "intervals": "computing intervals",
           "conclude": "assembling the result"}
_NO_WORKER = ('<aside class="warnings"><p><strong>No worker is alive.</strong> Jobs wait until one is started: '
              "<code>slipstick work</code></p></aside>")
Active = FitWithProgress | StudyWithProgress


@dataclass(frozen=True)
class Jobs:
    """The jobs of both kinds, and the workers that run them."""

    fits: JobStore
    studies: JobStore
    heartbeats: Heartbeats

    def html(self, count: int, steps: str) -> str:
        """Return the sections of the jobs, `count` of each kind: the first that run and wait, the newest that ended.

        `steps` is HTML that comes before the jobs.
        """
        active: list[Active] = [FITS.with_progress(self.fits, job) for job in self.fits.active(count)]
        active += [STUDIES.with_progress(self.studies, job) for job in self.studies.active(count)]
        active.sort(key=lambda job: (job.status != "running", job.ahead or 0))
        counts: Counter[str] = Counter()
        for _, state, _, number in self.fits.table.states("PENDING", "ENQUEUED"):
            counts[state] += number
        alive, running, waiting = self.heartbeats.alive(), counts["PENDING"], counts["ENQUEUED"]
        return "\n".join([
            f'<p class="counts"><span class="dot {"on" if alive else "off"}"></span>{plural(alive, "worker")} alive · '
            f"{running} running · {waiting} waiting</p>",
            _NO_WORKER if active and not alive else "", steps,
            group("Jobs", [_active_entry(job) for job in active], "No job is running or waiting.",
                  *_links_to_hidden(running + waiting - len(active))),
            self._list_ended(self.studies, "Studies", count), self._list_ended(self.fits, "Fits", count)])

    def _list_ended(self, store: JobStore, title: str, count: int) -> str:
        jobs = store.newest(count + 1, 0, JobFilter(status=ENDED))
        make = STUDIES.without_progress if store is self.studies else FITS.without_progress
        older = Link(f"Show more {title.lower()}", f"/?count={min(1000, 2 * count)}#{title.lower()}")
        return group(title, [_ended_entry(store, make(store, job)) for job in jobs[:count]],
                     f"No {store.workflow} has ended yet.",
                     *([older] if len(jobs) > count else []), *listings(store.address))


def _links_to_hidden(count: int) -> list[Link]:
    """Links to the lists with the jobs that wait, if `count` of them are not on the page."""
    return [Link(f"{plural(count, 'more job')}: fits that wait", "/v1/fits?status=queued"),
            Link("studies that wait", "/v1/studies?status=queued")] if count > 0 else []


def _describe_subject(job: Fit | Study) -> str:
    if isinstance(job, Study):
        subject = f"of the machine “{job.machine}”" if job.machine else f"on the bench {job.bench}"
        return f"Study of “{job.recordings}” {subject}"
    model = f"of the simulator at the values of {job.table}" if job.simulate else f"of the table {job.table}"
    return f"Fit of {listed([in_words(name) for name in job.parameters])} {model} to “{job.recordings}”"


def _active_entry(job: Active) -> Entry:
    links = [Link("Status as JSON", job.links["self"])]
    return Entry(_name(job), job.links["self"], _describe_subject(job), job.status, _describe_progress(job), links)


def _describe_progress(job: Active) -> str:
    """Progress in words, and as a bar where the share that is done is known."""
    left = None if job.progress is None else job.progress.budget_left
    return _describe_stage(job) + ("" if left is None or job.status != "running" else
                                   paragraph(f"{_round_seconds(left)} of the time budget left", "doing"))


def _describe_stage(job: Active) -> str:
    if job.status == "queued":
        place = "Next in its queue" if job.ahead == 0 else f"{plural(job.ahead or 0, 'job')} before it in its queue"
        return paragraph(place, "doing")
    match job.progress:
        case StudyProgress(step=step, steps=steps, done=done, doing=doing):
            return _bar(f"Steps of {job.id}", done) + paragraph(f"Step {step} of {steps}. {doing}", "doing")
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


def _ended_entry(store: JobStore, job: Fit | Study) -> Entry:
    address = job.links["self"]
    about = f"{_describe_subject(job)}, {moment(job.ended)}"
    if job.status != "done":
        cause = paragraph(str(store.find(job.id).error), "doing") if job.status == "failed" else ""
        return Entry(_name(job), address, about, job.status, cause, [Link("Status as JSON", address)])
    answer = _thumbnail(store, job) + paragraph(_answer(store, job.id, str(job.ended)), "answer")
    return Entry(_name(job), job.links["report"], about, "", answer, [
        Link("Report", job.links["report"]), Link("Result as JSON", job.links["result"]),
        *([Link("Residuals as CSV", f"{job.links['residuals']}?format=csv")] if "residuals" in job.links else [])])


def _name(job: Fit | Study) -> str:
    return job_name("study" if isinstance(job, Study) else "fit", job.recordings, job.id, job.submitted)


def _thumbnail(store: JobStore, job: Fit | Study) -> str:
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
    return "" if drawable is None else drawable.title


@lru_cache(maxsize=1000)
def _answer(store: JobStore, id: str, ended: str) -> str:
    """What a job found, in a sentence. Read once, since results are large; `ended` tells jobs of the same id apart."""
    job = finished_job(store, id)
    output = output_of(job)
    if store.workflow == "study":
        return str(output["result"]["sentence"])
    bound = [in_words(remark["unknown"]) for remark in output["result"]["remarks"] if remark.get("at_bound")]
    at_bound = f"; {listed(bound)} at {'its bound' if len(bound) == 1 else 'their bounds'}" if bound else ""
    values = "partial result: " * is_partial(job) + fitted(output["physical"]) + at_bound
    return values[0].upper() + values[1:]
