"""The models that UM-Bridge clients see: each table, and each table with recordings.

`nominal` maps one multiplier per axis of the table `nominal` to the shifting times of its conditions.
`nominal/measured` maps means, stds and output std to the log10 likelihood of the recordings `measured`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, TypeVar

import numpy as np
from pydantic import Field, ValidationError

from slipstick.errors import InvalidValue, SlipstickError, UnknownName
from slipstick.inference.problems import table_problem
from slipstick.inference.propagation import select_conditions
from slipstick.storage.library import Library
from slipstick.table import Outside, Table
from slipstick.uncertainty.likelihood.natural import NaturalLikelihood

from ..computations import Client
from ..routes.likelihood import integration_points
from ..schemas import ConditionList, OutsidePolicy, StrictModel, require_size
from ..settings import Settings

LOWEST = float(np.finfo(float).min)
"""The logarithm of a likelihood of 0: JSON has no infinity."""
_Config = TypeVar("_Config", bound=StrictModel)


class UndefinedOutput(SlipstickError):
    """An output does not exist at the point."""


class TableConfig(StrictModel):
    """Options of a table."""

    outside: OutsidePolicy = "error"
    conditions: ConditionList = None


class LikelihoodConfig(StrictModel):
    """Options of a table with recordings."""

    outside: OutsidePolicy = "clip"
    logarithm: Literal["log10", "ln"] = Field(
        default="log10", description="Base of the logarithm of the likelihood; samplers usually take the natural one.")


@dataclass(frozen=True, eq=False)
class TableModel:
    """Multipliers (d,) -> values (n,) of the table in its unit."""

    table: Table
    outside: Outside

    @property
    def inputs(self) -> int:
        """Number of axes."""
        return len(self.table.axes)

    @property
    def outputs(self) -> int:
        """Number of conditions."""
        return len(self.table.conditions)

    def value(self, point: np.ndarray) -> np.ndarray:
        """The values (n,); undefined where an engagement does not lock."""
        values: np.ndarray = self.table.interpolate(point[None], self.outside)[0]
        return values

    def jacobian(self, point: np.ndarray) -> np.ndarray:
        """Exact derivatives (n, d) of the interpolation."""
        return self.table.derivatives(point, self.outside).jacobian

    def apply_hessian(self, point: np.ndarray, sens: np.ndarray, vec: np.ndarray) -> np.ndarray:
        """The exact Hessian of `sens` (n,) times the interpolation, times `vec` (d,): shape (d,)."""
        hessian = self.table.derivatives(point, self.outside).hessian
        return contracted(contracted(np.moveaxis(hessian, 0, -1), sens), vec)


@dataclass(frozen=True, eq=False)
class LikelihoodModel:
    """Means, stds and output std (2 d + 1,) -> the logarithm of the likelihood of recordings (1,)."""

    likelihood: NaturalLikelihood
    scale: float
    """1 for log10, ln 10 for the natural logarithm."""
    require_work: Callable[[int], None]
    """Raises `TooLarge` if this number of likelihoods takes too long."""

    @property
    def inputs(self) -> int:
        """Number of unknowns."""
        return self.likelihood.size

    @property
    def outputs(self) -> int:
        """One."""
        return 1

    def value(self, point: np.ndarray) -> np.ndarray:
        """The logarithm of the likelihood (1,), `LOWEST` if it is 0."""
        self.require_work(1)
        return np.maximum([self.scale * self.likelihood.value(point)], LOWEST)

    def jacobian(self, point: np.ndarray) -> np.ndarray:
        """The gradient (1, 2 d + 1)."""
        self.require_work(1 + 2 * self.inputs)
        return self.scale * self.likelihood.gradient(point)[None]

    def apply_hessian(self, point: np.ndarray, sens: np.ndarray, vec: np.ndarray) -> np.ndarray:
        """The Hessian applied, by differences of the gradient."""
        self.require_work(2 * (1 + 2 * self.inputs))
        applied: np.ndarray = sens[0] * self.scale * self.likelihood.apply_hessian(point, vec)
        return applied


BridgeModel = TableModel | LikelihoodModel
"""A function of one input vector to one output vector, with derivatives."""


def contracted(array: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sum over the last axis with `weights`; entries of weight 0 may be undefined."""
    used = weights != 0
    total: np.ndarray = array[..., used] @ weights[used]
    return total


def names(library: Library) -> list[str]:
    """The names of all models: the valid tables, then each with the recordings whose conditions it contains."""
    tables = {name: table for name in library.tables() if (table := _read_valid(library.table, name)) is not None}
    recordings = {name: recorded for name in library.recordings()
                  if (recorded := _read_valid(library.measured, name)) is not None}
    pairs = [f"{name}/{other}" for name, table in tables.items() for other, recorded in recordings.items()
             if _read_valid(partial(table_problem, table, outside="clip"), recorded) is not None]
    return [*tables, *pairs]


def require_known(library: Library, name: str) -> None:
    """Raise `UnknownName` unless there is a model of this name; the files are opened when it is used."""
    table, slash, recordings = name.partition("/")
    if not library.has_table(table) or (slash and not library.has_recordings(recordings)):
        raise UnknownName.of("model", name, names(library))


def open_model(library: Library, settings: Settings, client: Client | None, name: str,
               config: dict[str, object]) -> BridgeModel:
    """Open a known model with its options; raises `InvalidValue`, and what the files raise."""
    table_name, slash, recordings_name = name.partition("/")
    table = library.table(table_name)
    if not slash:
        options = _validate_config(TableConfig, config)
        return TableModel(select_conditions(table, options.conditions)[0], options.outside)
    chosen, recordings = _validate_config(LikelihoodConfig, config), library.measured(recordings_name)
    problem = table_problem(table, recordings, chosen.outside)
    if client is not None:
        problem = replace(problem, model=client.watched(problem.model))

    def require_work(evaluations: int) -> None:
        require_size(evaluations * integration_points(table) * len(recordings), settings.work_values,
                     "intermediate values", "Use recordings with fewer engagements, or a table of fewer axes")

    return LikelihoodModel(NaturalLikelihood(problem), 1.0 if chosen.logarithm == "log10" else np.log(10.0),
                           require_work)


def _validate_config(kind: type[_Config], config: dict[str, object]) -> _Config:
    try:
        return kind.model_validate(config)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, first["loc"]))[:100]
        raise InvalidValue(f"The entry '{where}' of `config` is invalid: {first['msg']}",
                           f"Known entries: {', '.join(kind.model_fields)}") from error


_Argument = TypeVar("_Argument")
_Found = TypeVar("_Found")


def _read_valid(read: Callable[[_Argument], _Found], argument: _Argument) -> _Found | None:
    try:
        return read(argument)
    except SlipstickError:
        return None
