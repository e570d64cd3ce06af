"""The refinement of a fit: a climb on the exact likelihood along its gradient, within the bounds.

Scatter of one input can often stand in for that of another, so that the likelihood has a maximum near each way of
sharing it out. The climb therefore also starts from the candidates that give one input all of it.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import LinearConstraint, minimize

from slipstick.matrix_product import matrix_product
from slipstick.uncertainty.likelihood.gradient import density_and_gradient
from slipstick.uncertainty.likelihood.likelihood import KNOTTED, centre_slopes, exact, steepest_direction
from slipstick.uncertainty.likelihood.local import polynomial_problem
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

_TOLERANCE = 1e-6  # decades: far below what the integral across the lines is good for
_ITERATIONS = 60
_FEW = 3  # inputs up to which each is tried alone
ROUNDS = 24
"""How often polynomials are quadrature anew about where the last ones led."""
_GAIN = 0.02  # decades: they are not where that gains less
_WORST = 1e6  # stands for a likelihood of 0, which has no gradient to climb
_LN10 = np.log(10.0)


def refined_vector(problem: InferenceProblem, space: Unknowns, begin: np.ndarray) -> np.ndarray:
    """The best vector of unknowns (k,) that climbs reach from `begin` and what it leads to; `begin` if none is better.

    The model itself is the judge: polynomials about one candidate and another cannot be compared.
    """
    reached = [_ascend(problem, space, start) for start in (begin, *_alone(problem, space, begin))]
    return max((begin, *reached), key=lambda vector: _height(problem, space, vector))


def local_problem(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> tuple[InferenceProblem, Unknowns]:
    """The problem to climb in and the space it holds in: itself where it has knots, else polynomials about `vector`.

    These also stand for a table whose inputs are not all normal: it has no gradient but by differences.
    In more inputs than lines are exact in, their direction is held: turned lines sample other inputs.
    """
    if problem.knots is None or set(space.families) != {"normal"}:
        return polynomial_problem(problem, space, vector)
    if len(space.axes) > KNOTTED and problem.direction is None:
        inputs = space.candidate(vector).inputs
        return replace(problem, direction=steepest_direction(inputs, centre_slopes(problem, inputs)[1])), space
    return problem, space


def constrained_maximum(problem: InferenceProblem, space: Unknowns, begin: np.ndarray, held: np.ndarray | None = None,
          tolerance: float = _TOLERANCE) -> tuple[np.ndarray, float]:
    """The maximum next to `begin` (k,) within the bounds, to a tolerance in decades: vector, log10 L.

    With a direction `held` (k,), it is the maximum over the vectors whose held . plain is that of `begin`.

    Sequential quadratic programming, along axes on which the information in the scores is 1: its first step is then
    that of Fisher scoring. It moves stds as they are, since in its logarithm a std near 0 has no slope to climb.
    """
    low, middle, high = (space.to_natural(vector) for vector in (space.lower, begin, space.upper))
    span, best = high - low, (begin, -np.inf)

    def scores(vector: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal best
        density, gradient = natural_scores(problem, space, vector)
        whole = float(density.sum())
        if whole > best[1]:
            best = (vector, whole)
        return whole, gradient * span

    first = scores(begin)
    free = np.eye(len(begin)) if held is None else null_space((held * span)[None])
    axes = free @ np.linalg.inv(np.linalg.cholesky(information(first[1] @ free))).T
    share = (middle - low) / span

    def loss(step: np.ndarray) -> tuple[float, np.ndarray]:
        whole, slope = scores(space.from_natural(middle + span * (axes @ step))) if np.any(step) else first
        if not np.isfinite(whole):
            return _WORST, np.zeros(len(step))
        return -_LN10 * whole, -slope.sum(axis=0) @ axes

    minimize(loss, np.zeros(axes.shape[1]), jac=True, method="SLSQP",
             constraints=LinearConstraint(axes, -share, 1 - share),
             options={"maxiter": _ITERATIONS, "ftol": _LN10 * tolerance})
    return best


def natural_scores(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) at a vector (k,), and the derivatives of ln p in its plain values (n, k)."""
    density, gradient = density_and_gradient(problem, space, vector)
    return density, _LN10 * gradient / np.where(space.is_logarithmic, space.to_natural(vector), 1.0)


def information(scores: np.ndarray) -> np.ndarray:
    """The information (f, f) in scores (n, f) of unknowns as shares of their ranges.

    Added is that each lies within its range, give or take. A condition without a density says nothing.
    """
    known = scores[np.all(np.isfinite(scores), axis=1)]
    matrix: np.ndarray = matrix_product(known.T, known) + np.eye(scores.shape[1])
    return matrix


def _ascend(problem: InferenceProblem, space: Unknowns, start: np.ndarray) -> np.ndarray:
    vector = start
    for _ in range(ROUNDS):
        near, region = local_problem(problem, space, vector)
        before = vector
        vector, reached = constrained_maximum(near, region, before)
        if near.knots is not None or reached - _height(near, region, before) < _GAIN:
            break
    return vector


def _height(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> float:
    return float(exact(problem, space.candidate(vector)).sum())


def _alone(problem: InferenceProblem, space: Unknowns, begin: np.ndarray) -> Iterator[np.ndarray]:
    """Candidates in which one input alone scatters, as widely as all of them together do to the times."""
    d = len(space.axes)
    if not 1 < d <= _FEW:
        return
    inputs = space.candidate(begin).inputs
    steepness = np.sqrt(np.mean(centre_slopes(problem, inputs)[1] ** 2, axis=1))
    whole = np.sqrt(np.sum(steepness**2))
    for axis in range(d):
        if steepness[axis] > 0:
            vector = begin.copy()
            vector[d:2 * d] = space.lower[d:2 * d]
            vector[d + axis] = np.log(inputs.marginal_std[axis] * whole / steepness[axis])
            vector[2 * d + 1:] = 0.0
            yield np.clip(vector, space.lower, space.upper)
