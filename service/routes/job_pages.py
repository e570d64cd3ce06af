"""The pages of jobs, their pictures, and two of them side by side."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any, Literal

import orjson
from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from starlette.responses import Response

from slipstick.errors import SlipstickError
from slipstick.pictures.output import Output
from slipstick.storage.library import Library

from ..bodies import JsonRoute
from ..computations import computes
from ..drawings import Drawings, DrawingsDependency
from ..following import EventStream, FollowingDependency, LastEventId, State
from ..front.compare import Pair, Side, choice_page, comparison_page
from ..front.elements import Entry
from ..front.file_actions import FOLDERS
from ..front.find import PER_PAGE, Search, Wanted, find_page
from ..front.forms import Form
from ..front.holdings import file_entry
from ..front.job_page import Compared, job_page, job_state, pictures_page
from ..front.jobs import JOB_KINDS, Active, Listed, active_entry, answer_of, ended_entry, name_of
from ..front.machine_page import machine_entry, machine_links
from ..front.orders import build_form
from ..front.page import FRESH, RELOAD, document, scripts
from ..job_filter import ACTIVE, ENDED, JobFilter, Status
from ..job_kind import JobKind
from ..job_store import JobStore
from ..jobs import JobStores, finished_job, output_of
from ..machines import Machines, MachinesDependency
from ..routes.calibrations import calibration_model, drawn_calibration
from ..routes.drawing_routes import Drawn
from ..routes.reports import drawn_fit
from ..routes.studies import study_model
from ..routes.study_laws import study_laws
from ..routes.study_reports import drawn_study
from ..schemas import LibraryDependency

router = APIRouter(route_class=JsonRoute, include_in_schema=False)

_MOST_CHOICES = 100
"""Number of jobs, the newest, to choose from for a comparison."""
_DRAWN: Mapping[str, Callable[[str, JobStore], Drawn]] = {
    "fit": drawn_fit, "study": lambda id, store: drawn_study(id, store, None), "calibration": drawn_calibration}


def _add_pages(kind: JobKind[Listed, Active]) -> None:
    """Add the pages of the jobs of a kind."""
    job_id = Annotated[str, kind.id_path]

    @router.get(f"/{kind.plural}/{{id}}", name=f"{kind.name}_page", response_class=HTMLResponse)
    def get_page(id: job_id, stores: JobStores, library: LibraryDependency, request: Request) -> HTMLResponse:
        store = stores[kind.name]
        job = kind.with_progress(store, store.find(id))
        others = [other for other in _finished(kind, store)
                  if other.id != id and getattr(other, "machine", None) == getattr(job, "machine", None)]
        laws = study_laws(id, store).laws if kind.name == "study" and job.status == "done" else ()
        body = job_page(kind, store, job, library, request.app.state.heartbeats.alive(), others, laws,
                        _orders(kind, id, store) if job.status == "done" else {},
                        machine_links(request.app.state.machines, getattr(job, "machine", None)))
        head = scripts("act", "live") + RELOAD * (job.status in ACTIVE)
        part_of = kind.plural.capitalize() if job.status in ENDED else ""
        return HTMLResponse(document(name_of(job), body, head, part_of), headers=FRESH)

    @router.get(f"/{kind.plural}/{{id}}/live", name=f"{kind.name}_live")
    async def follow_page(id: job_id, stores: JobStores, request: Request,
                          following: FollowingDependency, last: LastEventId = None) -> Response:
        store = stores[kind.name]

        def state() -> State:
            job = kind.with_progress(store, store.find(id))
            return State(job_state(store, job, request.app.state.heartbeats.alive()), job.status in ENDED)

        return EventStream(following, f"{store.address}/{id}/live", state, last)

    if kind.name not in _DRAWN:
        return

    @router.get(f"/{kind.plural}/{{id}}/pictures", name=f"{kind.name}_pictures_page", response_class=HTMLResponse)
    @computes
    def get_pictures(id: job_id, stores: JobStores, drawings: DrawingsDependency) -> HTMLResponse:
        store = stores[kind.name]
        job = kind.without_progress(store, store.find(id))
        drawn = _DRAWN[kind.name](id, store)
        figures = {name: (title, caption, _element(drawings, kind, drawn, name, name))
                   for name, (title, caption) in _titles(drawings, kind, drawn).items()}
        return HTMLResponse(document(f"Pictures: {name_of(job)}", pictures_page(kind, job, figures)))


for _kind in JOB_KINDS:
    _add_pages(_kind)


@router.get("/compare", response_class=HTMLResponse)
@computes
def compare_page(stores: JobStores, drawings: DrawingsDependency, kind: Compared = "study", first: str = "",
                 second: str = "") -> HTMLResponse:
    """Two finished jobs of a kind side by side, or a form to choose them."""
    jobs_kind, store = next(each for each in JOB_KINDS if each.name == kind), stores[kind]
    jobs = _finished(jobs_kind, store)
    if not (first and second):
        return HTMLResponse(document("Comparison", choice_page(jobs_kind, jobs)), headers=FRESH)
    sides = (_side(jobs_kind, store, first), _side(jobs_kind, store, second))
    known = {job.id for job in jobs}
    jobs += [side.job for side in sides if side.job.id not in known]
    body = comparison_page(jobs_kind, jobs, sides, _pairs(drawings, jobs_kind, store, (first, second)))
    return HTMLResponse(document("Comparison", body), headers=FRESH)


@router.get("/find", response_class=HTMLResponse)
def find(stores: JobStores, library: LibraryDependency, machines: MachinesDependency,
         text: Annotated[str, Query(max_length=200)] = "", among: Wanted = "all", status: Status | Literal[""] = "",
         page: Annotated[int, Query(ge=0, le=1000)] = 0) -> HTMLResponse:
    """Jobs and files whose names contain a text."""
    search = Search(text.strip(), among, status or None, page)
    jobs, total = _found_jobs(search, stores, library)
    return HTMLResponse(document("Search", find_page(search, jobs, total, [
        *_found_files(search, library), *_found_machines(search, machines)])),
                        headers=FRESH)


def _finished(kind: JobKind[Listed, Active], store: JobStore) -> list[Listed]:
    """The newest jobs of a kind that are done."""
    return [kind.without_progress(store, job) for job in store.newest(_MOST_CHOICES, 0, JobFilter(status=["done"]))]


def _orders(kind: JobKind[Listed, Active], id: str, store: JobStore) -> dict[str, Form]:
    """The jobs that the result of a job can be given to: a table of its model, where it has such a model."""
    read = {"study": lambda: study_model(id, store), "calibration": lambda: calibration_model(id, store)}.get(kind.name)
    with suppress(SlipstickError):  # the model of a declared machine, or of a partial result, is not a file
        if read is not None:
            return {"Build a table of its model": build_form(model=read().model_dump_json(exclude_unset=True))}
    return {}


def _side(kind: JobKind[Listed, Active], store: JobStore, id: str) -> Side:
    job = finished_job(store, id)
    shown, output = kind.without_progress(store, job), output_of(job)
    return Side(shown, answer_of(store, id, str(shown.ended)), output["result"], getattr(shown, "settings", {}),
                output.get("physical", ()), Output.of(output.get("figure_data", {})))


def _pairs(drawings: Drawings, kind: JobKind[Listed, Active], store: JobStore, ids: tuple[str, str]) -> Sequence[Pair]:
    """The pictures that both jobs have."""
    drawn = [_DRAWN[kind.name](id, store) for id in ids]
    titles = [_titles(drawings, kind, each) for each in drawn]
    return [Pair(name, caption, (title, titles[1][name][0]), (
        _element(drawings, kind, drawn[0], name, f"first-{name}"),
        _element(drawings, kind, drawn[1], name, f"second-{name}")))
        for name, (title, caption) in titles[0].items() if name in titles[1]]


def _titles(drawings: Drawings, kind: JobKind[Listed, Active], drawn: Drawn) -> dict[str, tuple[str, str]]:
    """The title and the caption of each picture, by its name."""
    titles: dict[str, tuple[str, str]] = orjson.loads(drawings.made("titles", drawn.request, kind.name, *drawn.version))
    return titles


def _element(drawings: Drawings, kind: JobKind[Listed, Active], drawn: Drawn, name: str, prefix: str) -> str:
    """A picture as an SVG element whose identifiers begin with `prefix`."""
    def request() -> Mapping[str, Any]:
        return {**drawn.request(), "name": name, "prefix": prefix}

    return drawings.made("element", request, kind.name, *drawn.version, name, prefix).decode()


def _found_jobs(search: Search, stores: Mapping[str, JobStore], library: Library) -> tuple[list[Entry], int]:
    """The jobs of a page of a search, newest first, and the number of all."""
    wanted = JobFilter(status=None if search.status is None else [search.status], text=search.text or None)
    kinds = [kind for kind in JOB_KINDS if search.among in ("all", kind.plural)]
    most = (search.page + 1) * PER_PAGE
    matching = [(kind, job) for kind in kinds for job in stores[kind.name].newest(most, 0, wanted)]
    matching.sort(key=lambda pair: pair[1].created_at or 0, reverse=True)
    entries = []
    for kind, job in matching[most - PER_PAGE:most]:
        store = stores[kind.name]
        shown = kind.with_progress(store, job)
        entries.append(active_entry(shown) if shown.status in ACTIVE else ended_entry(store, shown, library))
    return entries, sum(stores[kind.name].total(wanted) for kind in kinds)


def _found_files(search: Search, library: Library) -> list[Entry]:
    """The files whose name contains the text, in small or capital letters."""
    names = {"tables": library.tables, "recordings": library.recordings, "benches": library.benches}
    return [file_entry(folder, name, library) for folder in FOLDERS if search.among in ("all", folder)
            for name in names[folder]() if search.text.lower() in name.lower()]


def _found_machines(search: Search, machines: Machines) -> list[Entry]:
    return [machine_entry(each) for each in machines.read_all()
            if search.among in ("all", "machines") and search.text.lower() in each.name.lower()]
