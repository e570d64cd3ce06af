"""A kind of jobs, as the service describes it: its words, its response bodies, and how they are made of a job."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from dbos import WorkflowStatus
from pydantic import BaseModel

from slipstick.storage.library import Library
from slipstick.storage.queues import find_machine

from .job_store import KINDS, JobInput, JobStore
from .jobs import Job, input_of, is_of_machine, job_fields, job_id_path, output_of, store_of
from .machines import Machines, tell_missing
from .paging import Page

Entry = TypeVar("Entry", bound=Job, covariant=True)
State = TypeVar("State", bound=Job, covariant=True)


@dataclass(frozen=True, eq=False)
class JobKind(Generic[Entry, State]):
    """The jobs of the workflow `name`.

    An `entry` of a `listing` has no progress, which the `state` of a job has beside its place in the queue; `result` is
    what a finished job gives. The addresses of a job have the names of its `links`. `about_state` and `about_result`
    say in words what both are.
    """

    name: str
    entry: type[Entry]
    state: type[State]
    listing: type[Page]
    result: type[BaseModel]
    links: tuple[str, ...]
    about_state: str
    about_result: str
    forget: Callable[[Library, JobStore, JobInput], None] = lambda *_: None
    """Removes what a deleted job leaves in the library."""
    bench_links: tuple[str, ...] = ()
    """Further names of addresses, which jobs of a declared machine do not have."""
    ends_complete: bool = True
    """Whether the share of the progress is 1 once a job is done: that of a search which may end early is not."""

    @property
    def address(self) -> str:
        """The path of the list."""
        return KINDS[self.name]

    @property
    def plural(self) -> str:
        """The name of several jobs."""
        return self.address.rpartition("/")[2]

    @property
    def store(self) -> Any:
        """Dependency: the jobs of this kind."""
        return store_of(self.name)

    @property
    def id_path(self) -> Any:
        """Path parameter for the id of a job."""
        return job_id_path(self.name)

    def without_progress(self, store: JobStore, job: WorkflowStatus) -> Entry:
        """Return a job without its progress and result."""
        bench_links = () if is_of_machine(job) else self.bench_links
        return self.entry(**job_fields(store, job, *self.links, *bench_links, "events", "cancel"))

    def with_progress(self, store: JobStore, job: WorkflowStatus) -> State:
        """Return a job with its place in the queue and its progress."""
        progress = store.progress(job.workflow_id)
        if progress is not None and "done" not in progress:  # that of an earlier version
            progress = None
        elif progress is not None and job.status == "SUCCESS" and self.ends_complete:
            progress = {**progress, "done": 1.0}
        fields = vars(self.without_progress(store, job))
        machine = find_machine(str(job.queue_name)) if fields["status"] == "queued" else None
        if machine is not None and not Machines(store.table.engine).has_worker(machine):
            fields |= {"note": tell_missing(machine), "missing_machine": machine}
        return self.state.model_validate({**fields, "ahead": store.ahead(job), "progress": progress})

    def finished(self, job: WorkflowStatus) -> BaseModel:
        """Return the result of a finished job, with what it is of."""
        return self.result(**{**input_of(job), **output_of(job), "id": job.workflow_id})
