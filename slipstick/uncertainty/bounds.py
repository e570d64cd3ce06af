"""What a fit ran into, in words: unknowns at bounds or left open, inputs that leave the table, too few samples."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipstick.uncertainty.inputs import axis_mass_outside
from slipstick.uncertainty.likelihood import Candidate, Problem
from slipstick.uncertainty.unknowns import Box, vector

NEAR = 1e-3
"""An unknown this share of its range from a bound is at it."""
NOTABLE_MASS = 0.01
"""Probability of an input outside the table from which it is worth a rebuild."""
NOTABLE_ERROR = 0.5
"""Decades between two sets of samples from which a fit is not to be trusted."""
FAR_MOVE, FLAT_GAIN = 0.05, 0.5
"""A mean that moves further than the first (of nominal) for fewer decades than the second is hardly determined."""
_LEAST = 0.01  # multiplier to build a table from: most parameters mean nothing at 0 or below
_COVER = 4  # stds on either side of the mean that a rebuilt table should hold

_REMEDIES = {
    ("mean", "lower"): "Widen mean_bounds",
    ("mean", "upper"): "Widen mean_bounds",
    ("std", "lower"): "Read it as no scatter, or as scatter that cannot be told from that of the other inputs",
    ("std", "upper"): "Look for what the model lacks: scatter this wide stands in for it; or widen std_bounds",
    ("output std", "lower"): "Raise samples before trusting it, or set the lower bound to the noise of the bench",
    ("output std", "upper"): "Look for what the model lacks: the noise stands in for it; or widen output_std_bounds",
}


@dataclass(frozen=True)
class Remark:
    """One thing to know about a fit: the `unknown` it is about, what is the case, and what helps."""

    unknown: str
    cause: str
    remedy: str


def remarks(problem: Problem, box: Box, found: Candidate) -> list[Remark]:
    """Say which unknowns of `found` are at a bound of the search, and which inputs leave the table."""
    return [*_at_bounds(problem, box, found), *_outside(problem, found)]


def chased(samples: int, sampling_error: float) -> list[Remark]:
    """Say whether a fit was drawn to its own samples: others give a likelihood notably different, in decades."""
    if not abs(sampling_error) > NOTABLE_ERROR:
        return []
    return [Remark("samples", f"Other samples give {sampling_error:+.1f} decades: the fit follows its own",
                   f"Fit again with samples at {4 * samples}, or raise the lower bound of the output std")]


def open_directions(names: tuple[str, ...], before: Candidate, after: Candidate, gain: float) -> list[Remark]:
    """Name the means that a polish moved far for a small `gain` in decades: the recordings hardly determine them."""
    if gain > FLAT_GAIN:
        return []
    moved = np.abs(after.inputs.mean - before.inputs.mean)
    return [Remark(f"mean of {name}", f"The mean of {name} moved by {distance:.2f} in the polish for {gain:.2f} "
                   "decades: the recordings hardly determine it alone",
                   "Read the fitted means together, or fix one by narrow mean_bounds")
            for name, distance in zip(names, moved, strict=True) if distance > FAR_MOVE]


def _at_bounds(problem: Problem, box: Box, found: Candidate) -> Iterator[Remark]:
    dimension, unknowns = found.inputs.dimension, vector(found)
    kinds = ["mean"] * dimension + ["std"] * dimension + ["output std"]
    shares = (unknowns - box.lower) / (box.upper - box.lower)
    for place, (kind, share) in enumerate(zip(kinds, shares, strict=True)):
        if NEAR < share < 1 - NEAR:
            continue
        side = "lower" if share <= NEAR else "upper"
        name = kind if kind == "output std" else f"{kind} of {problem.axes[place % dimension]}"
        value = unknowns[place] if kind == "mean" else np.exp(unknowns[place])
        edges = problem.lower if side == "lower" else problem.upper
        if kind == "mean" and getattr(box, side)[place] == edges[place]:
            beyond = f"{'below' if side == 'lower' else 'above'} {edges[place]:.4g}"
            yield Remark(name, f"The {name} is at the {side} edge of the table, {edges[place]:.4g}",
                         f"Build a table whose axis {problem.axes[place]} reaches {beyond}, and widen mean_bounds")
        else:
            unit = " s" if kind == "output std" else ""
            yield Remark(name, f"The {name} is at its {side} bound, {value:.4g}{unit}", _REMEDIES[kind, side])


def _outside(problem: Problem, found: Candidate) -> Iterator[Remark]:
    inputs = found.inputs
    masses = axis_mass_outside(inputs, problem.lower, problem.upper)
    for name, mass, mean, std, low, high in zip(problem.axes, masses, inputs.mean, inputs.marginal_std, problem.lower,
                                                problem.upper, strict=True):
        if mass > NOTABLE_MASS:
            low, high = min(low, max(_LEAST, mean - _COVER * std)), max(high, mean + _COVER * std)
            yield Remark(name, f"{100 * mass:.1f} % of the runs have {name} outside the table",
                         f"Build a table whose axis {name} goes from {low:.3g} to {high:.3g}")
