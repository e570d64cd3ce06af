"""What propagations and likelihoods ask of their arguments: inputs that are those of a table, and a seed."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.table import Table
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.chaos import Family


def table_inputs(table: Table, mean: Any, std: Any = None, families: Family | Sequence[Family] | None = None,
                 mixing: Any = None, correlation: Any = None, support: Any = None) -> Inputs:
    """The distribution of the d inputs of a table, in multiples of nominal, as `Inputs` describes it.

    Numbers stand for lists or matrices of one entry. The support of beta inputs is by default the range of their axes.
    Raises `InvalidValue`.
    """
    names = [axis.name for axis in table.axes]
    means = np.atleast_1d(_numbers("mean", mean, names))
    if means.size != len(names):
        raise InvalidValue(f"`mean` has {means.size} entries, but the table has {len(names)} axes",
                           f"Give one entry per axis: {', '.join(names)}")
    stds = None if std is None else np.atleast_1d(_numbers("std", std, names))
    matrices = [None if matrix is None else np.atleast_2d(_numbers(name, matrix, names))
                for name, matrix in (("mixing", mixing), ("correlation", correlation))]
    ranges = np.column_stack([table.lower, table.upper]) if support is None else np.atleast_2d(
        _numbers("support", support, names))
    chosen = (families,) if isinstance(families, str) else tuple(families or ())
    return Inputs(means, stds, matrices[0], chosen, matrices[1], ranges)


def require_seed(seed: int) -> None:
    """Raise `InvalidValue` for a negative seed."""
    if seed < 0:
        raise InvalidValue(f"The seed is {seed}", "Give 0 or a positive whole number")


def _numbers(name: str, values: Any, axes: list[str]) -> np.ndarray:
    try:
        return np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"`{name}` is no list of numbers, or has rows of different lengths",
                           f"Give an entry for each axis of the table: {', '.join(axes)}") from error
