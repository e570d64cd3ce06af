"""The refinement of a fit: a climb on the exact likelihood along its gradient, within the bounds.

Scatter of one input can often stand in for that of another, so that the likelihood has a maximum near each way of
sharing it out. The climb therefore also starts from the candidates that give one input all of it.
"""

from collections.abc import Iterator

import numpy as np
from scipy.optimize import minimize

from slipstick.uncertainty.gradient import with_gradient
from slipstick.uncertainty.likelihood import Problem, slopes
from slipstick.uncertainty.local import localised
from slipstick.uncertainty.unknowns import Unknowns

_TOLERANCE = 1e-6  # decades: far below what the integral across the lines is good for
_ITERATIONS = 60
_FEW = 3  # inputs up to which each is tried alone
_ROUNDS, _GAIN = 8, 0.02  # polynomials laid anew about where the last ones led, until that gains so few decades
_WORST = 1e6  # decades: stands for a likelihood of 0, which has no gradient to climb


def refine(problem: Problem, space: Unknowns, begin: np.ndarray) -> np.ndarray:
    """The best vector of unknowns (k,) that climbs reach from `begin` and what it leads to."""
    reached = [_ascend(problem, space, start) for start in (begin, *_alone(problem, space, begin))]
    best, _ = max(reached, key=lambda end: end[1])
    return best


def nearby(problem: Problem, space: Unknowns, vector: np.ndarray) -> tuple[Problem, Unknowns]:
    """The problem to climb in and the space it holds in: itself where it has knots, else polynomials about `vector`."""
    return (problem, space) if problem.knots is not None else localised(problem, space, vector)


def _ascend(problem: Problem, space: Unknowns, start: np.ndarray) -> tuple[np.ndarray, float]:
    vector = start
    for _ in range(_ROUNDS):
        near, region = nearby(problem, space, vector)
        before = float(with_gradient(near, region, vector)[0].sum())
        vector, reached = climb(near, region, vector)
        if problem.knots is not None or reached - before < _GAIN:
            break
    return vector, reached


def climb(problem: Problem, space: Unknowns, begin: np.ndarray,
          free: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """The maximum next to `begin` (k,) over the unknowns that are `free` (k,), all by default: vector, log10 L.

    Sequential least squares quadratic programming on the unit box, which of scipy's bounded methods with gradients
    needed the fewest evaluations.
    """
    free = np.ones(len(begin), bool) if free is None else free
    lower, span = space.lower[free], (space.upper - space.lower)[free]
    best = (begin, -np.inf)

    def loss(share: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal best
        vector = begin.copy()
        vector[free] = lower + np.clip(share, 0.0, 1.0) * span
        density, gradient = with_gradient(problem, space, vector)
        whole = float(density.sum())
        if not np.isfinite(whole):
            return _WORST, np.zeros(len(span))
        if whole > best[1]:
            best = (vector, whole)
        return -whole, -gradient.sum(axis=0)[free] * span

    minimize(loss, (begin[free] - lower) / span, jac=True, method="SLSQP", bounds=[(0.0, 1.0)] * len(span),
             options={"maxiter": _ITERATIONS, "ftol": _TOLERANCE})
    return best


def _alone(problem: Problem, space: Unknowns, begin: np.ndarray) -> Iterator[np.ndarray]:
    """Candidates in which one input alone scatters, as widely as all of them together do to the times."""
    d = len(space.axes)
    if not 1 < d <= _FEW:
        return
    inputs = space.candidate(begin).inputs
    steepness = np.sqrt(np.mean(slopes(problem, inputs)[1] ** 2, axis=1))
    whole = np.sqrt(np.sum(steepness**2))
    for axis in range(d):
        if steepness[axis] > 0:
            vector = begin.copy()
            vector[d:2 * d] = space.lower[d:2 * d]
            vector[d + axis] = np.log(inputs.marginal_std[axis] * whole / steepness[axis])
            vector[2 * d + 1:] = 0.0
            yield np.clip(vector, space.lower, space.upper)
