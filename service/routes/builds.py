"""Builds: submission; the worker makes the table, which the service then serves with the others."""

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Body, Response

from slipstick.black_box import BlackBoxDescription
from slipstick.building.axes import Spans, axes_of
from slipstick.errors import InvalidValue, UnknownName
from slipstick.interface.build import PAPER_AXES, plan_of_bench
from slipstick.interface.models import parse_model
from slipstick.storage.library import Library, require_name

from ..bodies import JsonRoute
from ..build_schemas import Build, BuildList, BuildRequest, BuildWithProgress, FinishedBuild
from ..computations import computes
from ..error_responses import error_responses
from ..job_filter import ACTIVE, JobFilter
from ..job_kind import JobKind
from ..job_store import JobInput, JobStore
from ..jobs import bench_input, submit
from ..machines import Machines, MachinesDependency
from ..problem_details import Conflict, TooLarge
from ..routes.job_routes import add_job_routes
from ..schemas import LibraryDependency, SettingsDependency
from ..study_schemas import model_input

router = APIRouter(prefix="/v1/builds", tags=["builds"], route_class=JsonRoute)


def _forget(library: Library, store: JobStore, job_input: JobInput) -> None:
    """Remove the runs that a build has kept, unless another one goes on with them."""
    if not store.newest(1, 0, JobFilter(status=ACTIVE, name=job_input["name"])):
        library.remove_staged_table(job_input["name"])


BUILDS = JobKind(
    "build", Build, BuildWithProgress, BuildList, FinishedBuild, ("result",),
    about_state="Return the status of a build and its progress: how many of its runs are done, and how long the rest "
                "takes.",
    about_result="Return the digest of the table, its shape and the outcomes of its runs", forget=_forget)
BuildStore = Annotated[JobStore, BUILDS.store]
IdempotencyKey = Annotated[str | None, BUILDS.key_header]

_EXAMPLE = {"name": "new-table", "bench": "heavy",
            "axes": {"pressure_bias": [0.8, 1.2, 5], "initial_position": [0.8, 1.2, 5]}}
_BYTES = 9
"""Bytes of a run in the file of a table: its output and its status, which hardly shrink."""


@router.post("", summary="Submit a build of a table", status_code=202,
             responses=error_responses(404, 408, 409, 413, 415, 503))
@computes
def submit_build(body: Annotated[BuildRequest, Body(examples=[_EXAMPLE])], library: LibraryDependency,
                 machines: MachinesDependency, store: BuildStore, settings: SettingsDependency, response: Response,
                 key: IdempotencyKey = None) -> BuildWithProgress:
    """Submit a build of a table: shifting times of a bench on a grid of parameters, or outputs of another machine.

    The request returns immediately, with the address of the build in the header Location. A worker simulates one run at
    each grid point under each condition; the table then is among the others. Runs that are done are kept: a build whose
    worker is killed, which is cancelled, or whose time budget ends, goes on where it stopped, in the last cases by the
    same request. Another machine than a bench needs a worker that was given its file (`slipstick work --machine FILE`).
    More runs than SLIPSTICK_BUILD_RUNS are rejected with 413; those of a machine, which only the worker knows, let the
    build fail.
    """
    job_input = _job_input(library, machines, body, settings.build_runs)
    build = submit(store, key, job_input, "long" if body.machine else "short",
                   lambda: _require_free(library, store, body.name))
    response.headers["Location"] = f"{store.address}/{build.workflow_id}"
    return BUILDS.with_progress(store, build)


def _require_free(library: Library, store: JobStore, name: str) -> None:
    """Raise `Conflict` if the name is taken, also by a table that is being built."""
    if library.has_table(name) or library.has_recordings(name):
        raise Conflict(f"A file named '{name}' already exists", "Choose another name")
    for job in store.newest(1, 0, JobFilter(status=ACTIVE, name=name)):
        raise Conflict(f"A table named '{name}' is being built by {store.address}/{job.workflow_id}",
                       "Choose another name, or cancel that build")


def _job_input(library: Library, machines: Machines, body: BuildRequest, most_runs: int) -> JobInput:
    """Return the input of the worker, after checks that reject a build that would fail later."""
    require_name(body.name)
    recordings = None if body.recordings is None else library.recording(body.recordings)
    bench, axes = None, None if body.axes is None else dict[str, Sequence[float]](body.axes)
    if body.machine is not None:
        given = {"bench": body.bench, "model": body.model, "recordings": body.recordings,
                 "accuracy": None if body.accuracy == "default" else body.accuracy}
        for field, value in given.items():
            if value is not None:
                raise InvalidValue(f"`{field}` and `machine` exclude each other",
                                   "The file of the machine describes its simulator and its conditions")
        _require_runs(axes or {}, 1, most_runs)
        _require_inputs(machines, body)
    else:
        bench = _bench(library, body)
        axes = axes or dict(PAPER_AXES)
        model = None if body.model is None else parse_model(body.model.model_dump(exclude_unset=True), "`model`")
        _require_runs(axes, 1, most_runs)  # before they are laid out in memory
        plan = plan_of_bench(library.bench(bench), axes, model, recordings, body.accuracy)
        library.require_space(_BYTES * _require_runs(axes, len(plan.conditions), most_runs))
    return {
        "name": body.name, "machine": body.machine, "output": body.output, "axes": axes, "accuracy": body.accuracy,
        "recordings": body.recordings, "recordings_digest": recordings and recordings.digest,
        "time_budget": body.time_budget, "most_runs": most_runs, **bench_input(library, bench),
        **model_input(None if bench is None else library.bench(bench), body.model)}


def _require_inputs(machines: Machines, body: BuildRequest) -> None:
    """Raise `UnknownName` and `InvalidValue` for an output and axes which the machine does not have.

    Those of a machine that no worker has told of are checked by the worker.
    """
    outputs = dict[str, BlackBoxDescription]()
    with suppress(InvalidValue):  # a description that cannot be read is as good as none
        stored = machines.get(body.machine or "")
        outputs = {} if stored is None else {each.about.output.name: each.about for each in stored.known.outputs}
    if not outputs:
        return
    output = body.output or next(iter(outputs))
    if output not in outputs:
        raise UnknownName.of("output", output, outputs)
    if body.axes is not None:
        axes_of(outputs[output], body.axes)


def _bench(library: Library, body: BuildRequest) -> str:
    if body.output is not None:
        raise InvalidValue("`output` is given without `machine`", "Name the machine")
    if body.bench is not None:
        return body.bench
    if body.model is None:
        raise InvalidValue("Neither a bench nor a machine is given", "Give `bench` or `machine`")
    return library.bench_of_model(parse_model(body.model.model_dump(exclude_unset=True), "`model`").physics)


def _require_runs(axes: Spans, conditions: int, most: int) -> int:
    """Return the number of runs of a table under so many conditions; raises `TooLarge` for more than `most`."""
    runs = conditions * math.prod(int(count) for *_, count in axes.values())
    if runs > most:
        raise TooLarge(f"The table has {runs:,} runs or more; the limit is {most:,}",
                       "Give fewer axes or fewer points, or let the administrator increase SLIPSTICK_BUILD_RUNS")
    return runs


add_job_routes(router, BUILDS)
