"""The exact log-likelihood with its gradient in the unknowns of a fit.

Polynomials (local.py) have slopes, and what the integral changes with each time on its lines has a closed form: the
derivative is that of the integral as it is computed, however few its lines.

A table's slopes jump. For normal inputs its gradient follows by Fisher's identity: the derivative of log p_i is that of
the log density of inputs and noise, taken in the mean over all inputs that explain the measured time, whose moments the
integration along lines yields on the way. For other families, and for more inputs than lines are exact in, by central
differences of the same smooth integral.
"""

import numpy as np

from slipstick.matrix_product import product
from slipstick.uncertainty.likelihood import lines
from slipstick.uncertainty.likelihood.likelihood import KNOTTED, exact, lay, outputs
from slipstick.uncertainty.likelihood.local import Polynomial
from slipstick.uncertainty.likelihood.problem import Candidate, Problem
from slipstick.uncertainty.likelihood.unknowns import Unknowns, correlation_of, partial_of

_DIFFERENCE = 1e-4
_SMALL = 1e-6  # for derivatives of inputs and correlations, smooth to the last digit
_LN10 = np.log(10.0)


def with_gradient(problem: Problem, space: Unknowns, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) per ms at a vector of unknowns (k,), and its derivatives (n, k); NaN where p is 0."""
    candidate = space.candidate(vector)
    if isinstance(problem.model, Polynomial):
        return _along_paths(problem, problem.model, space, vector)
    if set(space.families) != {"normal"} or len(space.axes) > KNOTTED:
        return exact(problem, candidate), _differences(problem, space, vector)
    laid = lay(problem, candidate)
    density, moments = lines.with_moments(laid, outputs(problem, candidate.inputs, laid), problem.measured_time,
                                          candidate.output_std)
    return density, _by_moments(space, candidate, laid, moments) / _LN10


def _along_paths(problem: Problem, model: Polynomial, space: Unknowns,
                 vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    candidate, noise = space.candidate(vector), 2 * len(space.axes)
    laid = lay(problem, candidate)
    points = candidate.inputs.at_scores(laid.scores)
    density, changes, of_noise = lines.with_changes(laid, model(points, problem.conditions), problem.measured_time,
                                                    candidate.output_std)
    theta = laid.scores @ np.linalg.inv(candidate.inputs.factor).T
    paths = np.array([_path(space, vector, place, theta) for place in range(len(vector))])
    gradient = sum((product(paths[:, :, axis], changes * slopes).T for axis, slopes in enumerate(model.slopes(points))),
                   np.zeros((len(density), len(vector))))
    gradient[:, noise] = of_noise
    return density, np.where(np.isfinite(density)[:, None], gradient, np.nan) / _LN10


def _path(space: Unknowns, vector: np.ndarray, place: int, theta: np.ndarray) -> np.ndarray:
    """How inputs at the standard normals (m, d) move with one unknown, shape (m, d)."""
    step = _SMALL * np.eye(len(vector))[place]
    ends = [np.clip(vector + move, space.lower, space.upper) for move in (step, -step)]
    ahead, behind = (space.candidate(end).inputs.points(theta) for end in ends)
    path: np.ndarray = (ahead - behind) / (ends[0] - ends[1])[place]
    return path


def _by_moments(space: Unknowns, candidate: Candidate, laid: lines.Lines, moments: lines.Moments) -> np.ndarray:
    d, inverse = len(laid.factor), np.linalg.inv(laid.factor)
    mean = moments.first @ inverse / candidate.inputs.marginal_std
    std = np.einsum("ia,nab,bi->ni", laid.factor, moments.second, inverse) - 1.0
    noise = moments.residual / candidate.output_std**2 - 1.0
    columns = [mean, std, noise[:, None]]
    if space.correlated:
        by_entry = np.einsum("ai,nab,bj->nij", inverse, moments.second - np.eye(d), inverse)
        partial = partial_of(candidate.inputs.factor)
        for number in range(len(partial)):
            step = np.zeros(len(partial))
            step[number] = _SMALL
            change = (correlation_of(partial + step, d) - correlation_of(partial - step, d)) / (2 * _SMALL)
            columns.append(0.5 * np.einsum("nij,ij->n", by_entry, change)[:, None])
    return np.concatenate(columns, axis=1)


def _differences(problem: Problem, space: Unknowns, vector: np.ndarray) -> np.ndarray:
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
