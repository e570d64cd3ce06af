"""The exact log-likelihood with its gradient in the unknowns of a fit.

Polynomials (local.py) have slopes, and what the integral changes with each time on its lines has a closed form: the
derivative is that of the integral as it is computed, however few its lines.

A table's slopes jump. For normal inputs its gradient follows by Fisher's identity: the derivative of log p_i is that of
the log density of inputs and noise, taken in the mean over all inputs that explain the measured time, whose moments the
integration along lines yields on the way. For other families, and for more inputs than lines are exact in, by central
differences of the same smooth integral.
"""

import numpy as np

from slipstick.matrix_product import matrix_product
from slipstick.uncertainty.likelihood import lines
from slipstick.uncertainty.likelihood.likelihood import KNOTTED, exact, integration_lines, times_on_lines
from slipstick.uncertainty.likelihood.local import PolynomialModel
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns, correlation_from_partial, partial_from_factor

_DIFFERENCE = 1e-4
_SMALL = 1e-6  # for derivatives of inputs and correlations, smooth to the last digit
_LN10 = np.log(10.0)


def density_and_gradient(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) per ms at a vector of unknowns (k,), and its derivatives (n, k); NaN where p is 0."""
    candidate = space.candidate(vector)
    if isinstance(problem.model, PolynomialModel):
        return _along_paths(problem, problem.model, space, vector)
    if set(space.families) != {"normal"} or len(space.axes) > KNOTTED:
        return exact(problem, candidate), _differences(problem, space, vector)
    quadrature = integration_lines(problem, candidate)
    density, moments = lines.density_and_moments(quadrature, times_on_lines(problem, candidate.inputs, quadrature), problem.measured_time,
                                          candidate.output_std)
    return density, _by_moments(space, candidate, quadrature, moments) / _LN10


def _along_paths(problem: InferenceProblem, model: PolynomialModel, space: Unknowns,
                 vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    candidate, noise = space.candidate(vector), 2 * len(space.axes)
    quadrature = integration_lines(problem, candidate)
    points = candidate.inputs.at_scores(quadrature.scores)
    density, changes, of_noise = lines.density_and_derivatives(quadrature, model(points, problem.conditions), problem.measured_time,
                                                    candidate.output_std)
    normals = quadrature.scores @ np.linalg.inv(candidate.inputs.factor).T
    paths = np.array([_path(space, vector, place, normals) for place in range(len(vector))])
    gradient = sum((matrix_product(paths[:, :, axis], changes * slopes).T for axis, slopes in enumerate(model.slopes(points))),
                   np.zeros((len(density), len(vector))))
    gradient[:, noise] = of_noise
    return density, np.where(np.isfinite(density)[:, None], gradient, np.nan) / _LN10


def _path(space: Unknowns, vector: np.ndarray, place: int, normals: np.ndarray) -> np.ndarray:
    """How inputs at the standard normals (m, d) move with one unknown, shape (m, d)."""
    step = _SMALL * np.eye(len(vector))[place]
    ends = [np.clip(vector + move, space.lower, space.upper) for move in (step, -step)]
    ahead, behind = (space.candidate(end).inputs.points(normals) for end in ends)
    path: np.ndarray = (ahead - behind) / (ends[0] - ends[1])[place]
    return path


def _by_moments(space: Unknowns, candidate: Candidate, quadrature: lines.Lines, moments: lines.Moments) -> np.ndarray:
    d, inverse = len(quadrature.factor), np.linalg.inv(quadrature.factor)
    mean = moments.first @ inverse / candidate.inputs.marginal_std
    std = np.einsum("ia,nab,bi->ni", quadrature.factor, moments.second, inverse) - 1.0
    noise = moments.residual / candidate.output_std**2 - 1.0
    columns = [mean, std, noise[:, None]]
    if space.correlated:
        by_entry = np.einsum("ai,nab,bj->nij", inverse, moments.second - np.eye(d), inverse)
        partial = partial_from_factor(candidate.inputs.factor)
        for number in range(len(partial)):
            step = np.zeros(len(partial))
            step[number] = _SMALL
            change = (correlation_from_partial(partial + step, d) - correlation_from_partial(partial - step, d)) / (2 * _SMALL)
            columns.append(0.5 * np.einsum("nij,ij->n", by_entry, change)[:, None])
    return np.concatenate(columns, axis=1)


def _differences(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> np.ndarray:
    columns = []
    for number in range(len(vector)):
        ends = []
        for sign in (-1, 1):
            moved = np.array(vector)
            moved[number] = np.clip(moved[number] + sign * _DIFFERENCE, space.lower[number], space.upper[number])
            ends.append((moved[number], exact(problem, space.candidate(moved))))
        (low, before), (high, after) = ends
        with np.errstate(invalid="ignore"):  # two densities of 0 have no difference
            columns.append((after - before) / (high - low))
    return np.column_stack(columns)
