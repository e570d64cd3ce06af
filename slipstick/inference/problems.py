"""Inference problems (slipstick/uncertainty) for tables, surrogates and the simulator."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.black_box import BlackBoxDescription, Measurements, Quantity
from slipstick.clutch.ensemble import Simulator
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from slipstick.plausibility.mismatch import is_near, nearest_ratios, times
from slipstick.recordings import Recordings
from slipstick.table import Outside, Table
from slipstick.uncertainty.likelihood import InferenceProblem, ShiftingTimeModel

_LEVELS = (0.5, 0.9)
"""Quantiles of the outputs over the conditions that are their level."""


def table_model(table: Table, outside: Outside) -> ShiftingTimeModel:
    """The table as a model, with a policy for points outside it. The model may raise `OutsideTable`."""
    return lambda points, conditions: table.restricted(conditions).interpolate(points, outside)


Measured = Recordings | Measurements
"""Measured outputs under conditions: shifting times of a clutch, or outputs of another machine."""


def table_problem(table: Table, recordings: Measured, outside: Outside,
                  chosen: Sequence[str] | None = None) -> InferenceProblem:
    """The problem of the recordings with a table as the model.

    The uncertain inputs are the axes `chosen` (default all); the other axes are fixed at 1. Raises `InvalidValue` if
    the table does not contain a condition of the recordings, or 1 on another axis, and `UnknownName` for an unknown
    axis.
    """
    if isinstance(recordings, Measurements) and recordings.output != table.output:
        raise InvalidValue(f"The measurements are of {recordings.output.name} [{recordings.output.unit}], and the "
                           f"table is of {table.output.name} [{table.output.unit}]", "Give measurements of that output")
    if isinstance(recordings, Recordings) and isinstance(table.model, BlackBoxDescription):
        raise InvalidValue(f"The recordings are shifting times of a clutch, and the table is of {table.output.name} "
                           f"[{table.output.unit}] of another machine", "Give measurements of that output")
    table.restricted(recordings.conditions)
    axes = [axis.name for axis in table.axes]
    columns = _columns(axes, axes if chosen is None else chosen, "axis of the table")
    for column, axis in enumerate(table.axes):
        low, high = float(table.lower[column]), float(table.upper[column])
        if column not in columns and not low <= 1 <= high:
            raise InvalidValue(f"{axis.name} is no uncertain input, and its nominal value, the multiple 1, is outside "
                               f"the table, whose axis {axis.name} goes from {low:g} to {high:g}",
                               f"Fit {axis.name} as well, or use a table whose axis contains 1")
    model = _Fixed(table_model(table, outside), np.ones(len(axes)), columns)
    knots = None if table.knots is None else tuple(table.knots[column] for column in columns)
    return InferenceProblem(model, recordings.conditions, recordings.measured_time, table.lower[columns],
                            table.upper[columns], tuple(axes[column] for column in columns), knots,
                            **_scale(recordings))


def simulated_problem(model: Model, recordings: Recordings, chosen: Sequence[str], bench: Bench,
                      simulator: Callable[[Model, tuple[str, ...]], ShiftingTimeModel] = Simulator) -> InferenceProblem:
    """The problem of the recordings with the simulator as the model, and the parameters `chosen` as uncertain inputs.

    `simulator` makes the simulation of a model over axes, which may run elsewhere. Multipliers outside the bounds of a
    parameter, those of the `bench`, are clipped. Raises `UnknownName`, and `InvalidValue` also where the model is one
    of another bench.
    """
    bench.require(model.physics)
    axes = tuple(parameters.NAMES[column] for column in _columns(parameters.NAMES, chosen, "parameter"))
    lower, upper = np.array([[bench.prior(name).lower, bench.prior(name).upper] for name in axes]).T
    return InferenceProblem(_Clipped(simulator(model, axes), lower, upper), recordings.conditions,
                            recordings.measured_time, lower, upper, axes)


def machine_problem(machine: BlackBoxDescription, model: ShiftingTimeModel, measured: Measured,
                    chosen: Sequence[str]) -> InferenceProblem:
    """The problem of measurements with the simulator of a machine, `model`, over its inputs `chosen`.

    Multiples outside the range of an input are clipped. Raises `UnknownName`, and `InvalidValue` where the machine has
    no simulator, or the measurements are of other conditions or of another output.
    """
    if not machine.simulator:
        raise InvalidValue("The table was computed by another program, whose simulator is not known",
                           "Omit `simulate`, and use the axes of the table")
    if not isinstance(measured, Measurements) or (measured.output, measured.conditions.quantities) != (
            machine.output, machine.columns):
        raise InvalidValue(f"The measurements are not of the {machine.output.name} of the machine",
                           "Give measurements uploaded for a table of this machine")
    known = [entry.name for entry in machine.inputs]
    inputs = [machine.inputs[column] for column in _columns(known, chosen, "input")]
    lower, upper = np.array([[entry.lower, entry.upper] for entry in inputs]).T
    return InferenceProblem(_Clipped(model, lower, upper), measured.conditions, measured.measured_time, lower, upper,
                            tuple(entry.name for entry in inputs), **_scale(measured))


def require_reach(problem: InferenceProblem, output: Quantity) -> None:
    """Raise `InvalidValue` where no inputs bring the `output` of the model to the level of the measurements.

    They are then of another machine or in another unit. Levels are two quantiles over the conditions, so that neither a
    few flawed measurements nor many about zero count. The model is evaluated once, and at the bounds of each input if
    it is far from the measurements.
    """
    def levels(outputs: np.ndarray) -> np.ndarray:
        known = np.nan_to_num(np.abs(outputs), nan=np.inf)
        return np.asarray(np.quantile(known, _LEVELS, method="higher"))

    def ratios(point: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(measured / levels(problem.model(point[None], problem.conditions)[0]))

    measured, centre = levels(problem.measured_time), np.clip(1.0, problem.lower, problem.upper)
    reached = nearest_ratios(ratios, ratios(centre), centre, problem.lower, problem.upper)
    if not any(is_near(ratio) for ratio in reached):
        words = output.name.replace("_", " ")
        raise InvalidValue(
            f"The measured {words} is {measured[0]:.4g} {output.unit} in the median of {len(problem.measured_time)} "
            f"conditions, and still {times(reached[0])} that of the model at the bounds of {', '.join(problem.axes)}",
            f"Check the unit of the measured {words}, and whether the measurements are of this machine")


@dataclass(frozen=True, eq=False)
class _Fixed:
    """A model of the inputs `columns` of another model, whose remaining inputs are fixed at `values`."""

    model: ShiftingTimeModel
    values: np.ndarray
    columns: list[int]

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        all_inputs = np.empty((len(points), len(self.values)))
        all_inputs[:] = self.values
        all_inputs[:, self.columns] = points
        return self.model(all_inputs, conditions)


@dataclass(frozen=True, eq=False)
class _Clipped:
    """A simulator with its multipliers clipped to `lower`, `upper` (d,)."""

    model: ShiftingTimeModel
    lower: np.ndarray
    upper: np.ndarray

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        return self.model(np.clip(points, self.lower, self.upper), conditions)


class _Scale(TypedDict, total=False):
    """The fields of a problem that follow from the unit and the size of its outputs."""

    unit: str
    output_std_bounds: tuple[float, float]


def _scale(measured: Measured) -> _Scale:
    """Unit and bounds of the output std; for a clutch the defaults of a problem.

    Numbers within a range have a std of at most half of it, so the noise of the measurements is no larger; three
    decades below, it is negligible.
    """
    if isinstance(measured, Recordings):
        return {}
    outputs = measured.measured_time
    has_range = not np.allclose(outputs, outputs[0], rtol=1e-9, atol=0.0)  # equal ones may differ by rounding
    largest = float(np.ptp(outputs) if has_range else np.abs(outputs[0]) or 1.0) / 2
    return {"unit": measured.output.unit, "output_std_bounds": (1e-3 * largest, largest)}


def _columns(known: Sequence[str], chosen: Sequence[str], kind: str) -> list[int]:
    """Indices of the chosen names among the known ones."""
    if not chosen or len(set(chosen)) < len(chosen):
        raise InvalidValue(f"The uncertain inputs are {list(chosen)}", "Give one or more names, each once")
    for name in chosen:
        if name not in known:
            raise UnknownName.of(kind, name, known)
    return [list(known).index(name) for name in chosen]
