"""`slipstick.fit`: mean and scatter of parameters, fitted to measured shifting times or outputs of a black box."""

import json
import os
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slipstick.bench import Bench
from slipstick.black_box import BlackBox, Measurements, Workers
from slipstick.building import compile_simulator
from slipstick.errors import InvalidValue, within_memory
from slipstick.inference.fitting import FitTask, complete_settings, say_progress
from slipstick.inference.problems import Measured, machine_problem, require_reach, simulated_problem, table_problem
from slipstick.interface.files import now, require_html, write
from slipstick.interface.frames import data_frame
from slipstick.interface.models import ModelLike, RecordingsLike, as_mapping, model_of
from slipstick.interface.progress import ProgressLine, Show
from slipstick.interface.result import HEAD, Result
from slipstick.interface.tables import TableLike, measured_of, open_table, require_outside
from slipstick.machine import Runs
from slipstick.pictures import CAPTIONS, pictures
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec
from slipstick.plausibility.mismatch import require_match
from slipstick.report import words
from slipstick.report.page import page
from slipstick.table import Outside, Table
from slipstick.table.subject import Subject, output_of
from slipstick.time_budget import clock_times, seconds_of, stage_times
from slipstick.uncertainty.fit import (
    FitSettings,
    has_all_intervals,
    initial_state,
    is_finished,
    next_state,
    refined_estimate,
    with_next_interval,
)
from slipstick.uncertainty.fit import progress as progress_of


class Unknown(NamedTuple):
    """An unknown of a fit: its `estimate` and interval in `unit`; an end is None where the recordings do not limit it.

    Means and standard deviations of inputs are multiples of their nominal values, with the unit "1".
    """

    name: str
    unit: str
    estimate: float
    lower: float | None
    upper: float | None


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Result):
    """The result of a fit: the distributions of the inputs, their likelihood, intervals, and what limits them.

    `output` is the result as JSON, as the REST service gives it; `request` says what was fitted to what.
    """

    kind: ClassVar[str] = "fit"

    request: Mapping[str, Any]
    output: Mapping[str, Any]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the d uncertain inputs."""
        return tuple(self._result["axes"])

    @property
    def mean(self) -> np.ndarray:
        """Means (d,) of the inputs, in multiples of their nominal values."""
        return np.array(self._result["mean"])

    @property
    def std(self) -> np.ndarray:
        """Standard deviations (d,) of the inputs, in multiples of their nominal values."""
        return np.array(self._result["std"])

    @property
    def output_std(self) -> float:
        """Standard deviation of the output noise, in the unit of the output: s for shifting times."""
        return float(self._result["output_std"])

    @property
    def log10_likelihood(self) -> float | None:
        """log10 of the likelihood, with densities per ms; None for a likelihood of 0."""
        value: float | None = self._result["log10_likelihood"]
        return value

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Estimates with their intervals; without intervals if the fit did not compute them."""
        return tuple(Unknown(entry["unknown"], self._output.unit if entry["unknown"] == "output std" else "1",
                             entry["estimate"], entry["lower"], entry["upper"])
                     for entry in self._result["intervals"])

    @property
    def physical(self) -> list[Mapping[str, Any]]:
        """Name, unit, nominal value, mean and std of each input in its unit."""
        return list(self.output["physical"])

    def summary(self) -> list[str]:
        """What was fitted to what, the inputs in their units, the gain, and what the recordings limit."""
        result, output = self._result, self._output
        return [f"{words.headline(result, self.request['recordings'], output)}: {words.fitted(self.physical)}.",
                words.improvement(result, output),
                *(f"{lead} {text}" for lead, text in [*words.warnings(result), *words.identified(result)])]

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """The pictures of the report; none of a result that was fetched without their data."""
        if "figure_data" not in self.output:
            return {}
        return {name: (spec, CAPTIONS[name]) for name, spec in pictures(self.output).items()}

    def to_frame(self) -> Any:
        """A row for each unknown, with its interval."""
        names = Unknown._fields
        return data_frame(dict(zip(names, zip(*self.unknowns, strict=True), strict=True)) if self.unknowns else
                          {name: [] for name in names})

    def report(self, path: Path | str) -> Path:
        """Write the report as one HTML page, which needs no network and no scripts, and return its path.

        Raises `InvalidValue` for a path that does not end in `.html`, or where the extra `reports` is not installed.
        """
        require_html(path)
        return write(path, page(self.request, self.output).encode())

    def to_dict(self) -> dict[str, Any]:
        """The fit as JSON; `result` and `physical` are those of the REST service."""
        return {**self.request, **self.output}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Fit":
        """The fit whose `to_dict` is `values`, or the result that the REST service gives, which has no pictures."""
        return cls({name: value for name, value in values.items() if name not in (*_OUTPUT, *HEAD)},
                   {name: values[name] for name in _OUTPUT if name in values})

    @property
    def _result(self) -> Mapping[str, Any]:
        result: Mapping[str, Any] = self.output["result"]
        return result

    @property
    def _output(self) -> Output:
        return Output.of(self.output.get("figure_data", {}))


_OUTPUT = ("result", "physical", "figure_data", "seconds", "processor_seconds")


@within_memory()
def fit(simulator: TableLike | Bench | BlackBox, recordings: RecordingsLike | Measurements | Runs,
        parameters: str | Sequence[str] | None = None, *, model: ModelLike | None = None, outside: Outside = "clip",
        settings: FitSettings | Mapping[str, Any] | None = None, budget: float | str | None = None,
        progress: bool | Show = True, name: str = "recordings", **changed: Any) -> Fit:
    """Fit mean and scatter of uncertain inputs, and the output noise, to measured outputs by maximum likelihood.

    Parameters
    ----------
    simulator : Table, Bench or BlackBox
        What computes the output: a table, or the path of its file, is interpolated; a bench or a black box is
        simulated, which takes longer and lets any parameter be uncertain.
    recordings : Recordings, Measurements, Runs, str or Path
        The measured shifting times, or outputs of the black box, or the name or the path of a file with them; of a
        declared machine that is simulated also its recorded runs.
    parameters : str or sequence of str, optional
        Names of the uncertain inputs; by default all axes of a table. All others keep their nominal values.
    model : Model, result or path, optional
        The model to simulate: a `Model`, a result that has one, or a JSON file of either. By default that with the
        nominal parameters of the bench.
    outside : {"clip", "nan", "error"}, optional
        What holds outside the table: the value at its nearest edge, no value, or an error.
    settings : FitSettings or mapping, optional
        Method, bounds, families and accuracy. Single ones can be `changed`, such as `families=["gamma"]` or
        `intervals=False`.
    budget : float or str, optional
        Time in s, or a text such as "2 min", after which the result is a partial one. By default a day.
    progress : bool or callable, optional
        Whether to show a bar in a terminal or notebook, or a function of a text and of the share that is complete.
    name : str, optional
        Name of the recordings in reports.

    Returns
    -------
    Fit

    Raises
    ------
    InvalidValue, UnknownName
        For inputs, settings or recordings that do not fit each other.
    TimeBudgetEnded
        If the budget ended before the first generation of the search.

    References
    ----------
    Tod et al., section III.B.

    """
    limit, submitted = seconds_of(budget), now()
    require_outside(outside)
    chosen = settings_of(settings, changed)
    simulator = simulator if isinstance(simulator, Bench | BlackBox) else open_table(simulator)
    measured = measured_of(recordings, simulator)
    parameters = [parameters] if isinstance(parameters, str) else parameters
    end = time.monotonic() + limit
    with ExitStack() as stack:
        show = stack.enter_context(ProgressLine()).shown(progress)
        begin = clock_times()
        task = _task(simulator, measured, parameters, model, outside, chosen, stack)
        search = _Search(task, end, show)
        state, estimate, times = search.run({"seconds": {}, "processor_seconds": {}}, begin)
        begin = clock_times()
        output = task.output(state, estimate, limit)
    times = stage_times(times, "conclude", begin)
    table = simulator if isinstance(simulator, Table) else None
    request = {"id": name, "table": "table" if table is not None else "simulator",
               "table_digest": task.model.digest if table is None else table.digest, "simulate": table is None,
               "recordings": name, "recordings_digest": measured.digest, "outside": outside,
               "settings": json.loads(json.dumps(task.settings.to_dict())), "submitted": submitted, "ended": now()}
    return Fit(request, {**output, **times})


def settings_of(settings: FitSettings | Mapping[str, Any] | None, changed: Mapping[str, Any]) -> FitSettings:
    """The settings with what is `changed`, a family as text for all inputs; raises `InvalidValue`, `UnknownName`."""
    given = {**as_mapping(settings), **changed}
    if isinstance(given.get("families"), str):
        given["families"] = [given["families"]]
    try:
        return FitSettings.from_dict(given)
    except TypeError as error:
        raise InvalidValue(f"The settings {given} cannot be read: {error}",
                           'Give numbers and lists, such as families=["gamma"], mean_bounds=[[0.5, 1.5]]') from None


def _task(simulator: Table | Bench | BlackBox, recordings: Measured, parameters: Sequence[str] | None,
          model: ModelLike | None, outside: Outside, settings: FitSettings, stack: ExitStack) -> FitTask:
    """The task of a fit; `stack` closes what it opens. Raises `InvalidValue`, `UnknownName`."""
    subject: Subject
    if model is not None and not isinstance(simulator, Bench):
        raise InvalidValue("A table or a black box says itself which model it is of", "Leave `model` out")
    if isinstance(simulator, Table):
        problem, subject = table_problem(simulator, recordings, outside, parameters), simulator.model
    elif parameters is None:
        raise InvalidValue("A simulator has no uncertain inputs by default", "Name them as `parameters`")
    elif isinstance(simulator, Bench):
        if isinstance(recordings, Measurements):
            raise InvalidValue("The measurements are of a black box, and the model is a bench", "Give its recordings")
        subject = model_of(simulator, model)
        problem = simulated_problem(subject, recordings, parameters, simulator)
        compile_simulator(subject, recordings.conditions)
        require_match(recordings, simulator, subject)
    else:
        workers = stack.enter_context(Workers(simulator, os.cpu_count() or 1))
        subject = simulator.description
        problem = machine_problem(subject, lambda points, cases: workers.simulate(tuple(parameters), points, cases)[0],
                                  recordings, parameters)
    require_reach(problem, output_of(subject))
    return FitTask(complete_settings(settings, problem), problem, subject, recordings)


@dataclass(frozen=True, eq=False)
class _Search:
    """The steps of a fit until its time ends."""

    task: FitTask
    end: float
    show: Show

    def run(self, times: Mapping[str, Any], begin: tuple[float, float]) -> tuple[Any, Any, dict[str, Any]]:
        """The last state of the search, the estimate if there was time for it, and the times by stage."""
        settings, problem = self.task.settings, self.task.problem
        state, estimate = initial_state(settings, problem), None
        times = stage_times(times, "open", begin)
        begin = clock_times()
        while self._has_time and not is_finished(settings, state):
            state = next_state(settings, problem, state)
            known = progress_of(settings, problem, state)
            self.show(say_progress("search", known), known["generation"] / known["generations"])
        times, begin = stage_times(times, "search", begin), clock_times()
        if self._has_time:
            self.show(say_progress("refine", {}), 1.0)
            estimate = refined_estimate(settings, problem, state)
            times, begin = stage_times(times, "refine", begin), clock_times()
        while self._has_time and estimate is not None and not has_all_intervals(settings, estimate):
            self.show(say_progress("intervals", {}), 1.0)
            estimate = with_next_interval(settings, problem, estimate)
        return state, estimate, stage_times(times, "intervals", begin)

    @property
    def _has_time(self) -> bool:
        return time.monotonic() < self.end
