"""Remarks on the result of a fit: unknowns at bounds, inputs outside the domain of the model, rough expansions."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns
from slipstick.uncertainty.outside import axis_mass_outside

NEAR = 1e-3
"""Distance from a bound, relative to the range, up to which an unknown is at the bound."""
NOTABLE_MASS = 0.01
"""Probability of an input outside the table above which a larger table is recommended."""
_FINE = 0.5  # largest error of the expansions without a remark, in output stds
_LEAST = 0.01  # smallest recommended multiplier of a table: most parameters have no meaning at 0 or below
_COVER = 4  # stds on either side of the mean that a recommended table covers

_REMEDIES = {
    ("mean", "lower"): "Widen mean_bounds",
    ("mean", "upper"): "Widen mean_bounds",
    ("std", "lower"): "Interpret this as no scatter, or as scatter that cannot be separated from that of other inputs",
    ("std", "upper"): "Check for an effect that the model lacks, for which wide scatter compensates, or widen "
                      "std_bounds",
    ("output std", "lower"): "Set the lower bound to the noise of the bench, because the scatter of the inputs "
                             "explains part of the noise",
    ("correlation", "lower"): "Treat the two inputs as one, because the recordings do not separate them",
    ("correlation", "upper"): "Treat the two inputs as one, because the recordings do not separate them",
    ("output std", "upper"): "Check for an effect that the model lacks, for which the noise compensates, or widen "
                             "output_std_bounds",
}


@dataclass(frozen=True)
class Remark:
    """A remark on a fit: the `unknown` it concerns, the `cause`, the `remedy`, and whether it is at a bound."""

    unknown: str
    cause: str
    remedy: str
    at_bound: bool = False


def remarks(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> list[Remark]:
    """Remarks on unknowns of `optimum` (k,) at a bound of the search, and on inputs outside the model domain."""
    return [*_remarks_at_bounds(problem, space, optimum), *_remarks_outside(problem, space, optimum)]


def polynomial_remarks(error: float | None, output_std: float, unit: str) -> Iterator[Remark]:
    """A remark if the `error` of the local expansions is large compared with the output std; both in `unit`."""
    if error is not None and error > _FINE * output_std:
        yield Remark("refinement and intervals",
                     f"The polynomials that replace the model have an error of {error:.2g} {unit}, and the output "
                     f"std is {output_std:.2g} {unit}: the optimum and the ends of the intervals are approximate",
                     "Narrow std_bounds, or vary fewer inputs, because the model is strongly nonlinear over this "
                     "scatter")


def _remarks_at_bounds(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> Iterator[Remark]:
    d = len(space.axes)
    kinds = ["mean"] * d + ["std"] * d + ["output std"] + ["correlation"] * (len(optimum) - 2 * d - 1)
    positions, natural = (optimum - space.lower) / (space.upper - space.lower), space.to_natural(optimum)
    for index, (kind, name, position) in enumerate(zip(kinds, space.names, positions, strict=True)):
        if NEAR < position < 1 - NEAR:
            continue
        side = "lower" if position <= NEAR else "upper"
        edges = problem.lower if side == "lower" else problem.upper
        if kind == "mean" and getattr(space, side)[index] == edges[index]:
            beyond = f"{'below' if side == 'lower' else 'above'} {edges[index]:.4g}"
            yield Remark(name, f"The {name} is at the {side} edge of the table, {edges[index]:.4g}",
                         f"Build a table whose axis {problem.axes[index]} reaches {beyond}, and widen mean_bounds",
                         True)
        else:
            unit, factor = ("", 1.0) if kind != "output std" else (" ms", 1e3) if problem.unit == "s" else (
                f" {problem.unit}", 1.0)
            yield Remark(name, f"The {name} is at its {side} bound, {factor * natural[index]:.4g}{unit}",
                         _REMEDIES[kind, side], True)


def _remarks_outside(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> Iterator[Remark]:
    inputs, d = space.candidate(optimum).inputs, len(space.axes)
    margin = NEAR * (space.upper - space.lower)[:d]
    interior = (inputs.mean >= problem.lower + margin) & (inputs.mean <= problem.upper - margin)
    masses = axis_mass_outside(inputs, problem.lower, problem.upper)
    for name, mass, mean, std, low, high, is_interior in zip(problem.axes, masses, inputs.mean, inputs.marginal_std,
                                                             problem.lower, problem.upper, interior, strict=True):
        if mass > NOTABLE_MASS and is_interior:  # a mean at the edge has its own remark
            low, high = min(low, max(_LEAST, mean - _COVER * std)), max(high, mean + _COVER * std)
            yield Remark(name, f"{100 * mass:.1f} % of the runs have {name} outside the table",
                         f"Build a table whose axis {name} goes from {low:.3g} to {high:.3g}")
