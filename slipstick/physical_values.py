"""Inputs in the units of the model beside their multiples."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from slipstick.bench import parameters
from slipstick.clutch.model import Model
from slipstick.machine import Machine


@dataclass(frozen=True)
class PhysicalInput:
    """An uncertain input in its `unit`: `nominal`, the value that the multiple 1 stands for, and `mean` and `std`."""

    name: str
    unit: str
    nominal: float
    mean: float
    std: float


def physical_inputs(model: Model | Machine, names: Sequence[str], mean: Sequence[float],
                    std: Sequence[float]) -> list[PhysicalInput]:
    """The inputs `names` with `mean` and `std` in multiples of their values in the model; raises `UnknownName`."""
    return [PhysicalInput(name, unit, nominal, nominal * center, nominal * spread)
            for name, (unit, nominal), center, spread in zip(names, map(_describing(model), names), mean, std,
                                                             strict=True)]


def _describing(model: Model | Machine) -> Callable[[str], tuple[str, float]]:
    """The function from the name of an input to its unit and its nominal value."""
    if isinstance(model, Machine):
        return lambda name: (model.input(name).unit, model.input(name).nominal)
    return lambda name: (parameters.PARAMETERS[parameters.index(name)].unit, model.parameters[parameters.index(name)])
