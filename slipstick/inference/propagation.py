"""Uncertain inputs propagated through a model to the distribution of its output in each condition (section III.A).

Two steps, between which a caller may check how large the result will be: `expand_outputs` runs the model, and
`compute_distributions` evaluates the expansions.
"""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.black_box import BlackBoxDescription
from slipstick.errors import InvalidValue
from slipstick.inference.inputs import require_seed
from slipstick.table import Table
from slipstick.table.subject import Subject
from slipstick.uncertainty import Inputs, mass_outside, standard_normals
from slipstick.uncertainty.chaos import (
    Adapted,
    ExpansionSettings,
    Output,
    adapt,
    expand,
    first_order,
    make_basis,
    total,
)
from slipstick.uncertainty.likelihood import SAMPLES, ShiftingTimeModel

QUANTILES = (0.05, 0.5, 0.95)
"""Default probabilities of the quantiles."""
MOST_RUNS = 20_000
"""Largest number of model runs to reach a tolerance."""
_OUTPUT_STD = 0.003  # default noise of shifting times in s
_HALF_WIDTH = 5.0  # of the range of a density in stds


@dataclass(frozen=True)
class PropagationSettings:
    """What is computed of the distributions of an output. Raises `InvalidValue`.

    `output_std`, the noise that is added to the output, and `tolerance` are in the unit of the output. With a
    `tolerance` the order of the `expansion` is ignored: it is raised from 1 until the error of all conditions is
    within the tolerance, or `MOST_RUNS` are used. Quantiles and densities are those of `samples` (a power of two) of
    the expansion, so that probabilities are at least 1 / `samples` away from 0 and 1; each density is computed at
    `density_points` from five stds below to five above the mean.
    """

    output_std: float
    expansion: ExpansionSettings = field(default_factory=ExpansionSettings)
    tolerance: float | None = None
    samples: int = SAMPLES
    seed: int = 1
    quantiles: tuple[float, ...] = QUANTILES
    density_points: int = 0

    def __post_init__(self) -> None:
        """Check what nothing else checks before the model is run."""
        if not (math.isfinite(self.output_std) and self.output_std >= 0):
            raise InvalidValue(f"The output std is {self.output_std}", "Give 0 or a positive number")
        if self.density_points < 0:
            raise InvalidValue(f"There are no densities at {self.density_points} points", "Give 0 for none, or more")
        if self.density_points and self.output_std == 0:
            raise InvalidValue("Samples without noise have no density", "Give an output std, or compute quantiles")
        if self.tolerance is not None and not (math.isfinite(self.tolerance) and self.tolerance > 0):
            raise InvalidValue(f"The tolerance is {self.tolerance}", "Give a positive number, or none")
        require_seed(self.seed)
        for probability in self.quantiles:
            if not 0 <= probability <= 1:
                raise InvalidValue(f"There is no quantile {probability}", "Give probabilities between 0 and 1")
            if min(probability, 1 - probability) * self.samples < 1:  # it would be the outermost sample
                raise InvalidValue(
                    f"The quantile {probability:g} is not known from {self.samples} samples",
                    f"Give more samples, or probabilities at least 1/{self.samples} away from 0 and 1")


@dataclass(frozen=True, eq=False)
class Distributions:
    """Distributions of an output in n conditions for d inputs; NaN where a condition has no expansion.

    In the unit of the output: `mean`, `std` with the noise, `error`, the estimated RMS error of the expansion (all
    (n,)), and `quantiles` (n, q) with the noise. `first_order` and `total` (n, d) are Sobol indices, for the variance
    without the noise; None for dependent inputs. `density` (n, g), with the noise, is per ms, or per thousandth of the
    unit, at the outputs `density_time` (n, g); None without densities.

    `adapted` has the expansion of all conditions, and the number of model runs for each condition. `reached` is whether
    its error is within the tolerance, None without one. `mass_outside` is the probability that the inputs lie outside
    the domain of the model.
    """

    mean: np.ndarray
    std: np.ndarray
    error: np.ndarray
    first_order: np.ndarray | None
    total: np.ndarray | None
    quantiles: np.ndarray
    density_time: np.ndarray | None
    density: np.ndarray | None
    adapted: Adapted
    reached: bool | None
    mass_outside: float


def select_conditions(table: Table, conditions: Sequence[int] | None) -> tuple[Table, list[int]]:
    """The table of the conditions at these indices, by default of all, and their indices.

    Raises `InvalidValue` for an index that is repeated, out of range, or no whole number.
    """
    n = len(table.conditions)
    if conditions is None:
        return table, list(range(n))
    try:
        rows = [operator.index(row) for row in conditions]
    except TypeError as error:
        raise InvalidValue(f"The conditions are {conditions!r}", "Give a list of indices, whole numbers") from error
    if not rows:
        raise InvalidValue("No condition is selected", "Give one or more indices, or none for all conditions")
    if len(set(rows)) < len(rows):
        raise InvalidValue("`conditions` contains an index more than once", "Give each index once")
    for row in rows:
        if not 0 <= row < n:
            raise InvalidValue(f"The table has no condition {row}", f"Give indices from 0 to {n - 1}")
    return table.restricted(table.conditions.take(rows)), rows


def default_output_std(model: Subject) -> float:
    """The noise that is added to the output of a model by default: 0.003 s for shifting times, 0 for other outputs."""
    return 0.0 if isinstance(model, BlackBoxDescription) else _OUTPUT_STD


def expand_outputs(model: ShiftingTimeModel, conditions: Any, inputs: Inputs, settings: PropagationSettings) -> Adapted:
    """Expand the outputs of the `model` under all `conditions` in the germs of the inputs.

    Raises `InvalidValue` for an expansion that is too large, and what the model raises.
    """
    def model_at_germs(germs: np.ndarray) -> np.ndarray:
        return model(inputs.at_germs(germs), conditions)

    if settings.tolerance is not None:
        return adapt(model_at_germs, inputs.germs, settings.tolerance, MOST_RUNS, settings.expansion)
    basis = make_basis(inputs.germs, settings.expansion)
    expansion = expand(basis, model_at_germs(basis.nodes))
    return Adapted(expansion, float(np.nanmax(expansion.error, initial=0.0)), False, len(basis.nodes))


def compute_distributions(adapted: Adapted, inputs: Inputs, lower: Sequence[float] | np.ndarray,
                          upper: Sequence[float] | np.ndarray, settings: PropagationSettings) -> Distributions:
    """The distributions of expanded outputs; the box `lower`, `upper` (d,) is the domain of the model."""
    expansion = adapted.expansion
    output = Output(expansion, settings.output_std, settings.samples, settings.seed)
    normals = standard_normals(inputs.dimension, settings.samples, settings.seed)
    grid = output.mean + np.linspace(-_HALF_WIDTH, _HALF_WIDTH, settings.density_points)[:, None] * output.std
    has_density = settings.density_points > 0
    return Distributions(
        output.mean, output.std, expansion.error,
        first_order(expansion) if inputs.independent else None, total(expansion) if inputs.independent else None,
        output.quantiles(np.array(settings.quantiles)).T, grid.T if has_density else None,
        output.density(grid).T if has_density else None, adapted,
        None if settings.tolerance is None else adapted.reached,
        mass_outside(inputs, np.asarray(lower), np.asarray(upper), normals))
