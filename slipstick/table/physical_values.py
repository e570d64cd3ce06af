"""Inputs in the units of their parameters beside their multiples."""

from collections.abc import Sequence
from dataclasses import dataclass

from slipstick.table.subject import Subject, input_of


@dataclass(frozen=True)
class PhysicalInput:
    """An uncertain input in its `unit`: `nominal`, the value that the multiple 1 stands for, and `mean` and `std`."""

    name: str
    unit: str
    nominal: float
    mean: float
    std: float


def physical_inputs(model: Subject, names: Sequence[str], mean: Sequence[float],
                    std: Sequence[float]) -> list[PhysicalInput]:
    """The inputs `names` with `mean` and `std` in multiples of their values in the model; raises `UnknownName`."""
    described = [input_of(model, name) for name in names]
    return [PhysicalInput(name, unit, nominal, nominal * center, nominal * spread)
            for name, (unit, nominal), center, spread in zip(names, described, mean, std, strict=True)]
