"""The forms that submit jobs: one function for each kind, with defaults that suit most recordings."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from slipstick.bench import parameters
from slipstick.black_box import BlackBoxDescription, Measurements
from slipstick.black_box.known import KnownMachine
from slipstick.engine.settings import EngineSettings
from slipstick.errors import SlipstickError
from slipstick.interface.build import PAPER_AXES
from slipstick.machine import Runs
from slipstick.pictures import units
from slipstick.pictures.theme import in_words
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.studies import StudySettings
from slipstick.table import Table

from ..fit_schemas import FitSettingsBody
from ..machines import Machines, StoredMachine
from .forms import KEY_PATTERN, NAME_PATTERN, NAME_RULE, Field, Form, expert_fields

_BUDGETS = [("", "a day"), ("60", "1 minute"), ("600", "10 minutes"), ("3600", "1 hour"), ("14400", "4 hours")]
_BUDGET = Field("time_budget", "Time limit", "when it ends, what there is by then becomes the result, if it suffices "
                "for one", "choice", choices=_BUDGETS, is_json=True)
_BUILD_BUDGET = replace(_BUDGET, about="when it ends, there is no table; the runs that are done are kept, and the same "
                                       "build goes on with them")
_TABLE_NAME = Field("name", "Name of the table", "under which pages and programs find it", required=True,
                    pattern=NAME_PATTERN, rule=NAME_RULE)
_SPAN_PATTERN = "\\s*[^\\s;]+(?:(?:;\\s*|\\s+)[^\\s;]+){2}\\s*"
_SPAN_RULE = "Give the lowest and highest multiple and the number of points, with spaces between, such as 0.8 1.2 9"
_NAME = Field("Idempotency-Key", "Name", "becomes its id and part of its address; empty for a random one",
              place="header", pattern=KEY_PATTERN,
              rule="Up to 64 letters, digits, '.', '-' and '_', starting with a letter or digit")


def recordings_orders(library: Library, name: str, recordings: Recordings | Measurements | Runs,
                      machines: Machines) -> dict[str, Form]:
    """Return the jobs that recordings can be given to: what each does, and its form."""
    if isinstance(recordings, Runs):
        stored = machines.get(recordings.machine)
        worker = needed_worker(recordings.machine, stored)
        return {"Study these runs": machine_study_form(name, worker),
                "Calibrate the machine to these runs": calibration_form(name, None, worker),
                **machine_orders(recordings.machine, stored, worker)}
    recorded = _subject_of_recordings(recordings)
    tables = [(entry, table) for entry, table in table_subjects(library) if _fits(table, recorded)]
    orders = {"Study these recordings": study_form(name, library.benches()),
              "Calibrate a bench to these recordings": calibration_form(name, library.benches())} \
        if isinstance(recordings, Recordings) else {}
    if tables:
        axes = dict.fromkeys(axis for _, table in tables for axis in table.axes)
        orders["Fit the inputs of a table to these recordings"] = fit_form(
            [entry for entry, _ in tables], [name], list(axes))
    return orders


def table_orders(library: Library, name: str, table: Table) -> dict[str, Form]:
    """Return the jobs that a table can be given to: what each does, and its form."""
    names = [entry for entry, recorded in recorded_subjects(library) if _fits(_subject_of_table(table), recorded)]
    return {"Fit the inputs of this table to recordings": fit_form(
        [name], names, [axis.name for axis in table.axes])} if names else {}


def machine_tables(library: Library) -> list[str]:
    """Return the names of the tables of other machines, for which measurements can be added."""
    return [name for name, table in table_subjects(library) if table.machine is not None]


def machine_orders(name: str, stored: StoredMachine | None, worker: str = "") -> dict[str, Form]:
    """Return the jobs that a machine can be given to: a table, unless it is known that it is not simulated.

    `worker` says which worker they need.
    """
    known = None
    if stored is not None:
        with suppress(SlipstickError):  # the page of the machine says why it cannot be read
            known = stored.known
    return {} if known is not None and not known.outputs else {
        "Build a table of the machine": machine_build_form(name, known, worker)}


def needed_worker(machine: str, stored: StoredMachine | None) -> str:
    """Return which worker a job of a machine needs, with a space before; empty where one runs."""
    if stored is not None and stored.workers:
        return ""
    return (f" It needs a worker with the file of the machine “{machine}”, and none is running: "
            "slipstick work --machine FILE")


def calibration_form(recordings: str, benches: Sequence[str] | None, worker: str = "") -> Form:
    """The form of a calibration to recordings of a bench, or to runs of a declared machine (`benches` is None).

    `worker` says which worker it needs.
    """
    return Form("calibration", "/v1/calibrations", "Start the calibration", [
        Field("recordings", "", kind="hidden", value=recordings),
        *([] if benches is None else [_bench_field(benches)]), _BUDGET, _NAME],
        about="A calibration estimates the uncertain parameters and their scatter from run to run, with intervals. It "
              f"assumes that the model lacks nothing.{worker}")


def bench_orders(library: Library, name: str) -> dict[str, Form]:
    """Return the jobs that a bench can be given to: what each does, and its form."""
    recordings = [entry for entry, recorded in recorded_subjects(library) if recorded == _OF_CLUTCH]
    return {"Build a table of this bench": build_form(bench=name, recordings=recordings)}


def machine_build_form(machine: str, known: KnownMachine | None, worker: str) -> Form:
    """The form of a build of a table of a machine; without what is `known` of it, of its first output and all inputs.
    """
    simulated = [] if known is None else known.outputs
    outputs = [(each.about.output.name, f"{in_words(each.about.output.name)} in {units.raised(each.about.output.unit)}")
               for each in simulated]
    inputs = {given.name: given for each in simulated for given in each.about.inputs}
    axes = [Field(f"axes.{given.name}", in_words(given.name).capitalize(),
                  f"lowest and highest multiple of {given.nominal:.6g} {units.raised(given.unit)}, from "
                  f"{given.lower:.3g} to {given.upper:.3g}, and number of points, such as 0.8 1.2 9", "numbers",
                  pattern=_SPAN_PATTERN, rule=_SPAN_RULE)
            for given in inputs.values()]
    return Form("build", "/v1/builds", "Start the build", [
        Field("machine", "", kind="hidden", value=machine), _TABLE_NAME,
        *([Field("output", "Output", "a number of each run, which the table holds", "choice", choices=outputs)]
          if len(outputs) > 1 else []), _BUILD_BUDGET], axes,
        about="A table holds simulated outputs on a grid of inputs, which fits then interpolate; without settings, of "
              f"all inputs over their ranges.{worker}")


def build_form(bench: str = "", model: str = "", recordings: Sequence[str] = ()) -> Form:
    """The form of a build of a table of a bench, or of a `model` as JSON.

    `recordings` are those whose conditions can be simulated instead of those of the bench.
    """
    given = [Field(name, "", kind="hidden", value=value, is_json=name == "model") for name, value in (
        ("bench", bench), ("model", model)) if value]
    conditions = [Field("recordings", "Conditions", "under which engagements are simulated", "choice", choices=[
        ("", "those of the bench"), *((name, f"those of {name}") for name in recordings)])] if recordings else []
    accuracy = Field("accuracy", "Accuracy", "of the time integration", "choice", choices=[
        ("", "within 0.1 ms"), ("tight", "tight, and slower")])
    return Form("build", "/v1/builds", "Start the build", [
        *given, _TABLE_NAME, *map(_axis, PAPER_AXES), *conditions, _BUILD_BUDGET],
        [accuracy, *(_axis(name) for name in parameters.NAMES if name not in PAPER_AXES)],
        about="A table holds simulated times on a grid of parameters, which fits then interpolate.")


def _axis(name: str) -> Field:
    lower, upper, count = PAPER_AXES.get(name, (0.0, 0.0, 0))
    return Field(f"axes.{name}", in_words(name).capitalize(),
                 "lowest and highest multiple of its value in the model, and number of points" if count else
                 "a further axis, such as 0.8 1.2 9", "numbers",
                 value=f"{lower:g} {upper:g} {count:g}" if count else "", pattern=_SPAN_PATTERN, rule=_SPAN_RULE)


def _bench_field(benches: Sequence[str]) -> Field:
    choices = [("", "found by its current profiles"), *((bench, bench) for bench in benches)]
    return Field("bench", "Bench", "whose parameters, sensors and profiles the model has", "choice", choices=choices)


def study_form(recordings: str, benches: Sequence[str]) -> Form:
    """The form of a study of recordings of a bench."""
    return Form("study", "/v1/studies", "Start the study", [
        Field("recordings", "", kind="hidden", value=recordings),
        _bench_field(benches), _BUDGET, _NAME], expert_fields(StudySettings, "settings"),
        about="A study tests every quantity of the model for a dependence that the model lacks, names the best "
              "explanation, and says how sure it is. It takes seconds to minutes.")


def machine_study_form(recordings: str, worker: str) -> Form:
    """The form of a study of runs of a declared machine; `worker` says which worker it needs."""
    return Form("study", "/v1/studies", "Start the study", [
        Field("recordings", "", kind="hidden", value=recordings), _BUDGET, _NAME],
        expert_fields(EngineSettings, "engine"),
        about="A study tests every quantity of the machine for a dependence that its model lacks. It takes minutes, "
              f"and with hundreds of runs up to an hour.{worker}")


def fit_form(tables: Sequence[str], recordings: Sequence[str], parameters: Sequence[str]) -> Form:
    """The form of a fit of some `parameters` of one of the tables to one of the recordings."""
    return Form("fit", "/v1/fits", "Start the fit", [
        _choice("table", "Table", "the simulated times that the fit interpolates", tables),
        _choice("recordings", "Recordings", "the measurements that it describes", recordings),
        Field("parameters", "Inputs", "what scatters from run to run; none marked: every axis of the table", "choices",
              choices=[(name, in_words(name)) for name in parameters]),
        _BUDGET, _NAME], [
        Field("simulate", "Simulate instead of interpolating", "slower, without the error of the table", "choice",
              choices=[("", "no"), ("true", "yes")], is_json=True),
        Field("outside", "Outside the table", "the value beyond its edges", "choice",
              choices=[("", "that of the edge"), ("nan", "missing"), ("error", "refused")]),
        *expert_fields(FitSettingsBody, "settings")],
        about="A fit finds the means and standard deviations of uncertain inputs under which the recordings are most "
              "likely. It takes about a minute.")


def _choice(name: str, label: str, about: str, values: Sequence[str]) -> Field:
    if len(values) == 1:
        return Field(name, "", kind="hidden", value=values[0])
    return Field(name, label, about, "choice", value=values[-1], choices=[(value, value) for value in values])


@dataclass(frozen=True)
class TableSubject:
    """What a table is of: another `machine` by its title, None for a clutch; its `output` and its `axes` by name."""

    machine: str | None
    output: str
    axes: tuple[str, ...]


@dataclass(frozen=True)
class RecordedSubject:
    """What recordings are of: runs of a `machine`, measurements of an `output` of another machine, or a clutch."""

    machine: str | None = None
    output: str | None = None


_OF_CLUTCH = RecordedSubject()


def table_subjects(library: Library) -> list[tuple[str, TableSubject]]:
    """Return what each table is of that can be read, by its name; the page of the others says why they cannot."""
    subjects = []
    for name in library.tables():
        with suppress(SlipstickError):
            subjects.append((name, library.derive_from_table(name, _subject_of_table)))
    return subjects


def recorded_subjects(library: Library) -> list[tuple[str, RecordedSubject]]:
    """Return what each recordings file is of that can be read, by its name."""
    subjects = []
    for name in library.recordings():
        with suppress(SlipstickError):
            subjects.append((name, library.derive_from_recorded(name, _subject_of_recordings)))
    return subjects


def _subject_of_table(table: Table) -> TableSubject:
    machine = table.model.title if isinstance(table.model, BlackBoxDescription) else None
    return TableSubject(machine, table.output.name, tuple(axis.name for axis in table.axes))


def _subject_of_recordings(recordings: Recordings | Measurements | Runs) -> RecordedSubject:
    if isinstance(recordings, Runs):
        return RecordedSubject(machine=recordings.machine)
    return RecordedSubject(output=recordings.output.name) if isinstance(recordings, Measurements) else _OF_CLUTCH


def _fits(table: TableSubject, recorded: RecordedSubject) -> bool:
    """Whether recordings are of what a table holds: shifting times, or the output of another machine."""
    if recorded.output is not None:
        return table.machine is not None and table.output == recorded.output
    return recorded == _OF_CLUTCH and table.machine is None
