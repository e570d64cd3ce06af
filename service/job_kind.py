"""A kind of jobs, as the service describes it: its words, its response bodies, and how they are made of a job."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from dbos import WorkflowStatus
from fastapi import Depends, Header, Path
from pydantic import BaseModel

from slipstick.storage.library import Library
from slipstick.storage.queues import find_machine

from .job_store import KINDS, JobInput, JobStore
from .jobs import Job, JobStores, input_of, is_of_machine, job_fields, output_of
from .machines import Machines, tell_missing
from .paging import Page

_ID = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
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
        async def store(stores: JobStores) -> JobStore:
            return stores[self.name]

        return Depends(store)

    @property
    def id_path(self) -> Any:
        """Path parameter for the id of a job."""
        return Path(description=f"Id of the {self.name}.", pattern=_ID, openapi_examples=self._id_example)

    @property
    def key_header(self) -> Any:
        """Header parameter by which a client chooses the id of a new job."""
        kind = self.name
        return Header(alias="Idempotency-Key", pattern=_ID, openapi_examples=self._id_example, description=(
            f"Becomes the id of the {kind}. If a request with the same key is repeated, no second {kind} is created "
            f"and the existing one is returned, whatever its time budget. If that has ended it, the {kind} is computed "
            "anew in its place. A different request with the same key is rejected with 409. Without a key, every "
            f"request creates a new {kind}."))

    @property
    def _id_example(self) -> Any:
        id = f"first-{self.name}"
        return {id: {"summary": f"The {self.name} submitted by the example request", "value": id}}

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
