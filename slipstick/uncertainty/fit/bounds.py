"""What a fit ran into, in words: unknowns at bounds, and inputs that leave what the model covers."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns
from slipstick.uncertainty.outside import axis_mass_outside

NEAR = 1e-3
"""An unknown this share of its range from a bound is at it."""
NOTABLE_MASS = 0.01
"""Probability of an input outside the table from which it is worth a rebuild."""
_FINE = 0.5  # output stds by which polynomials may be off
_LEAST = 0.01  # multiplier to build a table from: most parameters mean nothing at 0 or below
_COVER = 4  # stds on either side of the mean that a rebuilt table should hold

_REMEDIES = {
    ("mean", "lower"): "Widen mean_bounds",
    ("mean", "upper"): "Widen mean_bounds",
    ("std", "lower"): "Read it as no scatter, or as scatter that cannot be told from that of the other inputs",
    ("std", "upper"): "Look for what the model lacks: scatter this wide stands in for it; or widen std_bounds",
    ("output std", "lower"): "Set the lower bound to the noise of the bench: the inputs explain more than they should",
    ("correlation", "lower"): "Read the two inputs as one: the recordings do not tell them apart",
    ("correlation", "upper"): "Read the two inputs as one: the recordings do not tell them apart",
    ("output std", "upper"): "Look for what the model lacks: the noise stands in for it; or widen output_std_bounds",
}


@dataclass(frozen=True)
class Remark:
    """One thing to know about a fit: the `unknown` it is about, what is the case, and what helps."""

    unknown: str
    cause: str
    remedy: str


def remarks(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> list[Remark]:
    """Say which unknowns of `optimum` (k,) are at a bound of the search, and which inputs leave what the model covers."""
    return [*_at_bounds(problem, space, optimum), *_outside(problem, space, optimum)]


def polynomial_remarks(error: float | None, output_std: float) -> Iterator[Remark]:
    """Say that polynomials stood for the model less closely than its output noise calls for; both in s."""
    if error is not None and error > _FINE * output_std:
        yield Remark("refinement and intervals",
                     f"They rest on polynomials {1e3 * error:.2g} ms off the model, at an output std of "
                     f"{1e3 * output_std:.2g} ms: the maximum and the ends of intervals are rough",
                     "Narrow std_bounds, or vary fewer inputs: the model bends too much over scatter this wide")


def _at_bounds(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> Iterator[Remark]:
    d = len(space.axes)
    kinds = ["mean"] * d + ["std"] * d + ["output std"] + ["correlation"] * (len(optimum) - 2 * d - 1)
    shares, plain = (optimum - space.lower) / (space.upper - space.lower), space.to_natural(optimum)
    for place, (kind, name, share) in enumerate(zip(kinds, space.names, shares, strict=True)):
        if NEAR < share < 1 - NEAR:
            continue
        side = "lower" if share <= NEAR else "upper"
        edges = problem.lower if side == "lower" else problem.upper
        if kind == "mean" and getattr(space, side)[place] == edges[place]:
            beyond = f"{'below' if side == 'lower' else 'above'} {edges[place]:.4g}"
            yield Remark(name, f"The {name} is at the {side} edge of the table, {edges[place]:.4g}",
                         f"Build a table whose axis {problem.axes[place]} reaches {beyond}, and widen mean_bounds")
        else:
            unit = " s" if kind == "output std" else ""
            yield Remark(name, f"The {name} is at its {side} bound, {plain[place]:.4g}{unit}", _REMEDIES[kind, side])


def _outside(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> Iterator[Remark]:
    inputs, d = space.candidate(optimum).inputs, len(space.axes)
    away = NEAR * (space.upper - space.lower)[:d]
    inner = (inputs.mean >= problem.lower + away) & (inputs.mean <= problem.upper - away)
    masses = axis_mass_outside(inputs, problem.lower, problem.upper)
    for name, mass, mean, std, low, high, within in zip(problem.axes, masses, inputs.mean, inputs.marginal_std,
                                                        problem.lower, problem.upper, inner, strict=True):
        if mass > NOTABLE_MASS and within:  # a mean at the edge has its own remark
            low, high = min(low, max(_LEAST, mean - _COVER * std)), max(high, mean + _COVER * std)
            yield Remark(name, f"{100 * mass:.1f} % of the runs have {name} outside the table",
                         f"Build a table whose axis {name} goes from {low:.3g} to {high:.3g}")
