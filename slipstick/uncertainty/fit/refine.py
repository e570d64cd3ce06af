"""The refinement of a fit: gradient-based maximization of the exact likelihood within the bounds.

The scatter of one input can often be exchanged for that of another, and the likelihood then has several local maxima.
The optimizer is therefore also started from candidates in which a single input has all the scatter.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy

from slipstick.numerics.matrix_product import matrix_product
from slipstick.uncertainty.likelihood.gradient import density_and_gradient
from slipstick.uncertainty.likelihood.likelihood import (
    KNOTTED,
    centre_slopes,
    optimizer_lattice,
    precise,
    steepest_direction,
)
from slipstick.uncertainty.likelihood.local import polynomial_problem
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

_TOLERANCE = 1e-6  # tolerance of the optimizer in decades, far below the integration error
_ITERATIONS = 60
_FEW = 3  # largest number of inputs for which starts with the scatter in a single input are tried
ROUNDS = 24
"""Largest number of successive local expansions, each around the optimum of the previous one."""
_IMPROVEMENT = 0.02  # improvement in decades below which no further expansion is made
AGREEMENT = 1e-3
"""Largest difference in decades of the sum over a lattice from a converged one; beyond it the lattice is renewed."""
_WORST = 1e6  # loss for a likelihood of 0, which has no gradient
_LN10 = np.log(10.0)


def refined_vector(problem: InferenceProblem, space: Unknowns, begin: np.ndarray) -> np.ndarray:
    """The best vector of unknowns (k,): `begin`, or a local maximum reached from it or from an additional start.

    The vectors are compared by the likelihood of the model itself, because local expansions around different candidates
    have different errors. The best one, found on a lattice where possible, is then the start of a maximization of the
    integral along lines.
    """
    starts = (begin, *single_input_starts(problem, space, begin))
    best = max((begin, *(_local_maximum(problem, space, start) for start in starts)),
               key=lambda vector: log10_likelihood(problem, space, vector))
    local, region = local_problem(problem, space, best)
    return best if local.lattice is None else constrained_maximum(replace(local, lattice=None), region, best)[0]


def local_problem(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> tuple[InferenceProblem, Unknowns]:
    """The problem for the optimizer around `vector`, and the search space in which it is valid.

    This is the problem itself if it has knots and all inputs are normal. Otherwise it is a local expansion, whose
    gradient requires no differences. For a table of more than `KNOTTED` inputs the direction of the integration lines
    is fixed, because a change of direction would make the likelihood discontinuous.
    """
    if problem.knots is None or set(space.families) != {"normal"}:
        return polynomial_problem(problem, space, vector)
    if len(space.axes) > KNOTTED and problem.direction is None:
        inputs = space.candidate(vector).inputs
        return replace(problem, direction=steepest_direction(inputs, centre_slopes(problem, inputs)[1])), space
    return replace(problem, lattice=optimizer_lattice(problem, space.candidate(vector))), space


def constrained_maximum(problem: InferenceProblem, space: Unknowns, begin: np.ndarray, fixed: np.ndarray | None = None,
                        tolerance: float = _TOLERANCE) -> tuple[np.ndarray, float]:
    """The local maximum reached from `begin` (k,) within the bounds, and its log10 likelihood.

    With a direction `fixed` (k,), the maximum is constrained to vectors with the same value of fixed . natural as
    `begin`, where natural are the unknowns on natural scale. `tolerance` is in decades.

    The method is sequential quadratic programming. The coordinates are scaled so that the information matrix is the
    identity, and the first step is then that of Fisher scoring. Stds are optimized on natural scale, because the
    derivative with respect to a log std vanishes as the std approaches 0.
    """
    low, middle, high = (space.to_natural(vector) for vector in (space.lower, begin, space.upper))
    span, best = high - low, (begin, -np.inf)

    def likelihood_and_scores(vector: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal best
        density, scores = natural_scores(problem, space, vector)
        likelihood = float(density.sum())
        if likelihood > best[1]:
            best = (vector, likelihood)
        return likelihood, scores * span

    first = likelihood_and_scores(begin)
    free = np.eye(len(begin)) if fixed is None else scipy.linalg.null_space((fixed * span)[None])
    values, vectors = np.linalg.eigh(information(first[1] @ free))
    axes = free @ (vectors / np.sqrt(np.maximum(values, 1.0)))  # `information` has no smaller ones but by rounding
    position = (middle - low) / span

    def loss(step: np.ndarray) -> tuple[float, np.ndarray]:
        likelihood, scores = (likelihood_and_scores(space.from_natural(middle + span * (axes @ step)))
                              if np.any(step) else first)
        if not np.isfinite(likelihood):
            return _WORST, np.zeros(len(step))
        return -_LN10 * likelihood, -scores.sum(axis=0) @ axes

    scipy.optimize.minimize(loss, np.zeros(axes.shape[1]), jac=True, method="SLSQP",
                            constraints=scipy.optimize.LinearConstraint(axes, -position, 1 - position),
                            options={"maxiter": _ITERATIONS, "ftol": _LN10 * tolerance})
    return best


def natural_scores(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) at a vector (k,), and the derivatives of ln p with respect to the natural unknowns (n, k)."""
    density, gradient = density_and_gradient(problem, space, vector)
    return density, _LN10 * gradient / np.where(space.is_logarithmic, space.to_natural(vector), 1.0)


def information(scores: np.ndarray) -> np.ndarray:
    """The empirical information matrix (f, f) of scores (n, f) with respect to unknowns in units of their ranges.

    The identity is added as a weak prior, with a std of one range per unknown. Conditions with a density of 0, whose
    scores are NaN, are left out.
    """
    finite = scores[np.all(np.isfinite(scores), axis=1)]
    return np.asarray(matrix_product(finite.T, finite) + np.eye(scores.shape[1]))


def _local_maximum(problem: InferenceProblem, space: Unknowns, start: np.ndarray) -> np.ndarray:
    vector = start
    for _ in range(ROUNDS):
        local, region = local_problem(problem, space, vector)
        before = vector
        vector, likelihood = constrained_maximum(local, region, before)
        if local.lattice is not None:
            is_settled = abs(likelihood - log10_likelihood(problem, space, vector)) < AGREEMENT
        else:
            is_settled = local.knots is not None \
                or likelihood - log10_likelihood(local, region, before) < _IMPROVEMENT
        if is_settled:
            break
    return vector


def log10_likelihood(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> float:
    """log10 L of a vector (k,), by which candidates are compared."""
    return float(precise(problem, space.candidate(vector))[0].sum())


def single_input_starts(problem: InferenceProblem, space: Unknowns, begin: np.ndarray) -> Iterator[np.ndarray]:
    """Candidates in which a single input causes the scatter of the times that all inputs together cause at `begin`.

    The last one is that of the input which causes most of it.
    """
    d = len(space.axes)
    if not 1 < d <= _FEW:
        return
    inputs = space.candidate(begin).inputs
    scatter = np.sqrt(np.mean(centre_slopes(problem, inputs)[1] ** 2, axis=1))
    total = np.sqrt(np.sum(scatter**2))
    for axis in np.argsort(scatter):
        if scatter[axis] > 0:
            vector = begin.copy()
            vector[d:2 * d] = space.lower[d:2 * d]
            vector[d + axis] = np.log(inputs.marginal_std[axis] * total / scatter[axis])
            vector[2 * d + 1:] = 0.0
            yield np.clip(vector, space.lower, space.upper)
