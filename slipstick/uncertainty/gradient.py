"""The exact log-likelihood with its gradient in the unknowns of a fit.

For normal inputs by Fisher's identity: the derivative of log p_i is that of the log density of inputs and noise, taken
in the mean over all inputs that explain the measured time, whose moments the integration along lines yields on the way.
For other families by central differences of the same smooth integral.
"""

import numpy as np

from slipstick.uncertainty import lines
from slipstick.uncertainty.likelihood import Candidate, Problem, exact, lay, outputs
from slipstick.uncertainty.line_rules import ACROSS
from slipstick.uncertainty.unknowns import Unknowns, correlation_of, partial_of

_DIFFERENCE = 1e-4
_LN10 = np.log(10.0)


def with_gradient(problem: Problem, space: Unknowns, vector: np.ndarray, count: int = ACROSS,
                  seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) per ms at a vector of unknowns (k,), and its derivatives (n, k); NaN where p is 0."""
    candidate = space.candidate(vector)
    if set(space.families) != {"normal"}:
        return exact(problem, candidate, count, seed), _differences(problem, space, vector, count, seed)
    laid = lay(problem, candidate, count, seed)
    density, moments = lines.with_moments(laid, outputs(problem, candidate.inputs, laid), problem.measured_time,
                                          candidate.output_std)
    return density, _by_moments(space, candidate, laid, moments) / _LN10


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
            step[number] = 1e-6
            change = (correlation_of(partial + step, d) - correlation_of(partial - step, d)) / 2e-6
            columns.append(0.5 * np.einsum("nij,ij->n", by_entry, change)[:, None])
    return np.concatenate(columns, axis=1)


def _differences(problem: Problem, space: Unknowns, vector: np.ndarray, count: int, seed: int) -> np.ndarray:
    columns = []
    for number in range(len(vector)):
        ends = []
        for sign in (-1, 1):
            moved = np.array(vector)
            moved[number] = np.clip(moved[number] + sign * _DIFFERENCE, space.lower[number], space.upper[number])
            ends.append((moved[number], exact(problem, space.candidate(moved), count, seed)))
        (low, before), (high, after) = ends
        columns.append((after - before) / (high - low))
    return np.column_stack(columns)
