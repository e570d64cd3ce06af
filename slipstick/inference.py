"""Where models meet the uncertainty: tables, surrogates and the simulator as the problems that `uncertainty/` knows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.clutch.ensemble import Simulator
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from slipstick.recordings import Recordings
from slipstick.table import Outside, Table
from slipstick.uncertainty.likelihood import InferenceProblem, ShiftingTimeModel


def table_model(table: Table, outside: Outside) -> ShiftingTimeModel:
    """The table as a model, with what holds beyond its edges; it raises `OutsideTable` for the policy `error`."""
    return lambda points, conditions: table.restricted(conditions).interpolate(points, outside)


def table_problem(table: Table, recordings: Recordings, outside: Outside,
                  chosen: Sequence[str] | None = None) -> InferenceProblem:
    """Hold the recordings against the table, its axes `chosen` uncertain (all by default) and the others at 1.

    Raises `InvalidValue` where the table lacks a condition of the recordings, and `UnknownName` on other axes.
    """
    table.restricted(recordings.conditions)
    axes = [axis.name for axis in table.axes]
    places = _places(axes, axes if chosen is None else chosen, "axis of the table")
    model = _Fixed(table_model(table, outside), np.ones(len(axes)), places)
    knots = None if table.knots is None else tuple(table.knots[place] for place in places)
    return InferenceProblem(model, recordings.conditions, recordings.measured_time, table.lower[places], table.upper[places],
                   tuple(axes[place] for place in places), knots)


def simulated_problem(model: Model, recordings: Recordings, chosen: Sequence[str]) -> InferenceProblem:
    """Hold the recordings against the simulator, with any parameters `chosen` as uncertain.

    Multipliers beyond the bounds of a parameter are taken at the bound. Raises `UnknownName`, `InvalidValue`.
    """
    places = _places(parameters.NAMES, chosen, "parameter")
    known = [parameters.PARAMETERS[place] for place in places]
    lower, upper = np.array([[one.lower, one.upper] for one in known]).T
    axes = tuple(one.name for one in known)
    return InferenceProblem(_Clipped(Simulator(model, axes), lower, upper), recordings.conditions, recordings.measured_time,
                   lower, upper, axes)


@dataclass(frozen=True, eq=False)
class _Fixed:
    """A model of some of the inputs of another, the rest held at `values`."""

    model: ShiftingTimeModel
    values: np.ndarray
    places: list[int]

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        whole = np.tile(self.values, (len(points), 1))
        whole[:, self.places] = points
        return self.model(whole, conditions)


@dataclass(frozen=True, eq=False)
class _Clipped:
    model: Simulator
    lower: np.ndarray
    upper: np.ndarray

    def __call__(self, points: np.ndarray, conditions: Conditions, /) -> np.ndarray:
        return self.model(np.clip(points, self.lower, self.upper), conditions)


def _places(known: Sequence[str], chosen: Sequence[str], kind: str) -> list[int]:
    if not chosen or len(set(chosen)) < len(chosen):
        raise InvalidValue(f"The uncertain inputs are {list(chosen)}", "Name one or more, each once")
    for name in chosen:
        if name not in known:
            raise UnknownName.of(kind, name, known)
    return [list(known).index(name) for name in chosen]
