"""Inputs in the units of their parameters beside their multiples."""

from collections.abc import Sequence
from dataclasses import dataclass

from slipstick.bench import parameters
from slipstick.table import Table, simulated


@dataclass(frozen=True)
class PhysicalInput:
    """An uncertain input in its `unit`: `nominal`, the value that the multiple 1 stands for, and `mean` and `std`."""

    name: str
    unit: str
    nominal: float
    mean: float
    std: float


def physical_inputs(table: Table, names: Sequence[str], mean: Sequence[float],
                    std: Sequence[float]) -> list[PhysicalInput]:
    """The inputs `names`, axes of the table or parameters of its model, with `mean` and `std` in multiples.

    Raises `UnknownName`, and `InvalidValue` for a name that is no axis if the model is one of another program.
    """
    axes = {axis.name: (axis.unit, axis.nominal) for axis in table.axes}
    described = [axes[name] if name in axes else _parameter(table, name) for name in names]
    return [PhysicalInput(name, unit, nominal, nominal * center, nominal * spread)
            for name, (unit, nominal), center, spread in zip(names, described, mean, std, strict=True)]


def _parameter(table: Table, name: str) -> tuple[str, float]:
    row = parameters.index(name)
    return parameters.PARAMETERS[row].unit, simulated(table.model).parameters[row]
