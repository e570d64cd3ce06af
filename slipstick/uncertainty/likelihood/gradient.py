"""The exact log likelihood and its gradient with respect to the unknowns of a fit.

Expansions (local.py) are differentiable, and the derivative of the integral with respect to each time on the lines has
a closed form. The gradient is therefore exact for the computed integral, regardless of the number of lines.

The slopes of a table are discontinuous. For normal inputs the gradient follows from Fisher's identity: the derivative
of log p_i is the conditional mean, given the measured time, of the derivative of the log density of inputs and noise.
The integration along lines, or the sum over the lattice of the problem, yields the moments required for this mean. A
sum over a lattice changes its slope where a point crosses a knot; its derivative agrees with the mean up to the error
of the sum. For other families, and for tables of more than two inputs, the gradient is computed by central differences
of the same smooth integral.
"""

import numpy as np

from slipstick.numerics.matrix_product import matrix_product
from slipstick.uncertainty.likelihood import lines
from slipstick.uncertainty.likelihood.likelihood import KNOTTED, density_and_moments, exact, integration_lines
from slipstick.uncertainty.likelihood.local import PolynomialModel
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns, correlation_from_partial, partial_from_factor

_DIFFERENCE = 1e-4  # step of the differences of a likelihood
_SMALL = 1e-6  # step of the differences of inputs and correlations, which are smooth functions
_LN10 = np.log(10.0)


def density_and_gradient(problem: InferenceProblem, space: Unknowns,
                         vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) per ms at a vector of unknowns (k,), and its derivatives (n, k); NaN where p is 0."""
    candidate = space.candidate(vector)
    if isinstance(problem.model, PolynomialModel):
        return _by_chain_rule(problem, problem.model, space, vector)
    if set(space.families) != {"normal"} or len(space.axes) > KNOTTED:
        return exact(problem, candidate), _by_differences(problem, space, vector)
    density, factor, moments = density_and_moments(problem, candidate)
    return density, _by_moments(space, candidate, factor, moments) / _LN10


def _by_chain_rule(problem: InferenceProblem, model: PolynomialModel, space: Unknowns,
                   vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    candidate, noise = space.candidate(vector), 2 * len(space.axes)
    quadrature = integration_lines(problem, candidate)
    points = candidate.inputs.at_scores(quadrature.scores)
    density, by_time, by_noise = lines.density_and_derivatives(quadrature, model(points, problem.conditions),
                                                               problem.measured_time, candidate.output_std)
    normals = quadrature.scores @ np.linalg.inv(candidate.inputs.factor).T
    by_unknown = np.array([_input_derivatives(space, vector, index, normals) for index in range(len(vector))])
    gradient = sum((matrix_product(by_unknown[:, :, axis], by_time * slopes).T
                    for axis, slopes in enumerate(model.slopes(points))), np.zeros((len(density), len(vector))))
    gradient[:, noise] = by_noise
    return density, np.where(np.isfinite(density)[:, None], gradient, np.nan) / _LN10


def _input_derivatives(space: Unknowns, vector: np.ndarray, index: int, normals: np.ndarray) -> np.ndarray:
    """Derivatives of the inputs at the standard normals (m, d) with respect to the unknown `index`, shape (m, d)."""
    step = _SMALL * np.eye(len(vector))[index]
    ends = [np.clip(vector + move, space.lower, space.upper) for move in (step, -step)]
    ahead, behind = (space.candidate(end).inputs.points(normals) for end in ends)
    return np.asarray((ahead - behind) / (ends[0] - ends[1])[index])


def _by_moments(space: Unknowns, candidate: Candidate, factor: np.ndarray, moments: lines.Moments) -> np.ndarray:
    """Derivatives of ln p (n, k) by Fisher's identity; the scores are `factor` u."""
    d, inverse = len(factor), np.linalg.inv(factor)
    mean = moments.first @ inverse / candidate.inputs.marginal_std
    std = np.einsum("ia,nab,bi->ni", factor, moments.second, inverse) - 1.0
    noise = moments.residual / candidate.output_std**2 - 1.0
    columns = [mean, std, noise[:, None]]
    if space.correlated:
        by_entry = np.einsum("ai,nab,bj->nij", inverse, moments.second - np.eye(d), inverse)
        partial = partial_from_factor(candidate.inputs.factor)
        for step in _SMALL * np.eye(len(partial)):
            ahead, behind = (correlation_from_partial(partial + move, d) for move in (step, -step))
            columns.append(0.5 * np.einsum("nij,ij->n", by_entry, (ahead - behind) / (2 * _SMALL))[:, None])
    return np.concatenate(columns, axis=1)


def _by_differences(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> np.ndarray:
    columns = []
    for index in range(len(vector)):
        ends = []
        for sign in (-1, 1):
            moved = np.array(vector)
            moved[index] = np.clip(moved[index] + sign * _DIFFERENCE, space.lower[index], space.upper[index])
            ends.append((moved[index], exact(problem, space.candidate(moved))))
        (low, before), (high, after) = ends
        with np.errstate(invalid="ignore"):  # -inf minus -inf, the difference of two densities of 0
            columns.append((after - before) / (high - low))
    return np.column_stack(columns)
