"""How likely measured shifting times are (eq. 7), condition by condition, in logarithms throughout.

    log10 p_i = log10 E_theta[ N(t_i; y_i(x(normals)), output_std^2) ]    per millisecond

normals is drawn afresh for every run, so the conditions multiply. The expectation is taken in one of three ways: `exact`
integrates the model itself along lines, `by_expansion` integrates its polynomials, and `by_sampling` takes the mean
over samples of the polynomials, as the paper does: the narrower the output noise, and the further a time lies from what
the samples reach, the more of them that asks for.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from slipstick.matrix_product import matrix_product
from slipstick.uncertainty.chaos.expansion import Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood import lines
from slipstick.uncertainty.likelihood.line_rules import ACROSS, WINDOW, along, knotted
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem
from slipstick.uncertainty.sampling import log10_mean_density

SAMPLES = 4096
"""Samples of normals for `by_sampling`, a power of two."""
_BLOCK = 1 << 13  # points that go to the model in one call
TOLERANCE = 0.05
"""Error in decades that `settled` stays below."""
MOST_LINES = 1024
KNOTTED = 2
"""Inputs up to which lines are broken at knots: in three a rule broken at them is too much for any model."""
_DEPENDENT = 1e-6  # of the scores' correlation matrix: one input then fixes the other
_FURTHEST = 60.0  # stds from the centre to look for what explains a measured time


def exact(problem: InferenceProblem, candidate: Candidate, count: int = ACROSS, seed: int = 1) -> np.ndarray:
    """log10 p, per ms, with the model itself integrated: shape (n,), -inf where it gives no time at all.

    For a model with knots and up to two inputs there is no error but that of rounding, of a Gauss rule across the
    lines, and where inputs are not normal that of their bend, some 0.0002 decades a condition (line_rules.py).
    Otherwise the times are taken as linear over half a std, and from three inputs on `count` seeded lines sample what
    lies across. Where the model gives no time (NaN) there is no density either.
    """
    quadrature = integration_lines(problem, candidate, count, seed)
    return lines.log10_density(quadrature, times_on_lines(problem, candidate.inputs, quadrature), problem.measured_time,
                               candidate.output_std)


def converged(problem: InferenceProblem, candidate: Candidate, seed: int = 1,
            tolerance: float = TOLERANCE) -> tuple[np.ndarray, float]:
    """`exact` with as many lines as it takes: log10 p (n,), and the error of their sum in decades.

    Lines are doubled until that error is below `tolerance`, or there are `MOST_LINES`. It is the difference that other
    lines make; 0 where the integral is that of a table as it stands.
    """
    count, likelihood, error = ACROSS, exact(problem, candidate, ACROSS, seed), 0.0
    if _is_knotted(problem, candidate.inputs):
        return likelihood, error
    while count < MOST_LINES:
        count *= 2
        before, likelihood = likelihood, exact(problem, candidate, count, seed + count)
        error = abs(float(likelihood.sum() - before.sum()))
        if error < tolerance:  # NaN, the difference of two likelihoods of 0, ends at the most lines
            break
    return likelihood, error


def integration_lines(problem: InferenceProblem, candidate: Candidate, count: int = ACROSS, seed: int = 1) -> lines.Lines:
    """The lines along which `exact` integrates the model under the candidate."""
    inputs, noise = candidate.inputs, candidate.output_std
    centre, steep = centre_slopes(problem, inputs)
    scatter = np.sqrt(noise**2 + np.sum((inputs.factor.T @ steep) ** 2, axis=0))
    distance = np.nanmax(np.abs(problem.measured_time - centre) / scatter, initial=0.0)
    reach = WINDOW + float(distance)
    if _is_knotted(problem, inputs):
        assert problem.knots is not None
        return knotted(inputs, problem.knots, steep, noise, min(reach, _FURTHEST))
    direction = steepest_direction(inputs, steep) if problem.direction is None else problem.direction
    return along(direction, inputs.factor, min(reach, 2 * WINDOW), count, seed)


def times_on_lines(problem: InferenceProblem, inputs: Inputs, quadrature: lines.Lines) -> np.ndarray:
    """Times of the model at the points of the lines, shape (m g, n), s."""
    points = inputs.at_scores(quadrature.scores)
    for edge in (problem.lower, problem.upper):  # rounding must not push a knot at the edge over it
        points = np.where(np.abs(points - edge) < 1e-9 * np.abs(edge), edge, points)
    return problem.model(points, problem.conditions)


def by_expansion(problem: InferenceProblem, candidates: Sequence[Candidate], settings: ExpansionSettings,
                 count: int = ACROSS) -> np.ndarray:
    """log10 p, per ms, of c candidates by their expansions, integrated along lines: shape (c, n).

    -inf where a condition has no expansion. The whole log10 likelihood is the sum over the conditions.
    """
    likelihood = np.empty((len(candidates), len(problem.measured_time)))
    for row, (candidate, expansion) in enumerate(_expansions(problem, candidates, settings)):
        inputs = candidate.inputs
        quadrature = along(_leading(_linear(expansion)), np.eye(inputs.dimension), WINDOW, count)
        times = expansion.at(inputs.germs_of(quadrature.scores))
        likelihood[row] = lines.log10_density(quadrature, times, problem.measured_time, candidate.output_std)
    return likelihood


def by_sampling(problem: InferenceProblem, candidates: Sequence[Candidate], settings: ExpansionSettings,
                normals: np.ndarray) -> np.ndarray:
    """As `by_expansion`, by the mean over the standard normals `normals` (m, d), as in the paper: shape (c, n)."""
    likelihood = np.empty((len(candidates), len(problem.measured_time)))
    for row, (candidate, expansion) in enumerate(_expansions(problem, candidates, settings)):
        times = expansion.at(candidate.inputs.germs_of(normals))
        likelihood[row] = log10_mean_density(times, problem.measured_time, candidate.output_std)
    return likelihood


def _expansions(problem: InferenceProblem, candidates: Sequence[Candidate],
                settings: ExpansionSettings) -> Iterator[tuple[Candidate, Expansion]]:
    size = max(1, _BLOCK // len(make_basis(candidates[0].inputs.germs, settings).nodes)) if candidates else 1
    for first in range(0, len(candidates), size):
        block = candidates[first:first + size]
        bases = [make_basis(candidate.inputs.germs, settings) for candidate in block]
        nodes = [candidate.inputs.at_germs(one.nodes) for candidate, one in zip(block, bases, strict=True)]
        times = problem.model(np.concatenate(nodes), problem.conditions)
        ends = np.cumsum([len(points) for points in nodes])[:-1]
        for candidate, one, at_nodes in zip(block, bases, np.split(times, ends), strict=True):
            yield candidate, expand(one, at_nodes)


def _is_knotted(problem: InferenceProblem, inputs: Inputs) -> bool:
    return problem.knots is not None and inputs.dimension <= KNOTTED and abs(np.linalg.det(inputs.factor)) > _DEPENDENT


def centre_slopes(problem: InferenceProblem, inputs: Inputs) -> tuple[np.ndarray, np.ndarray]:
    """Times at the centre (n,), s, and their change with each normal score (d, n), 0 where the model gives none."""
    d, step = inputs.dimension, np.eye(inputs.dimension)
    times = problem.model(inputs.at_scores(np.concatenate([np.zeros((1, d)), step, -step])), problem.conditions)
    return times[0], np.nan_to_num((times[1:1 + d] - times[1 + d:]) / 2)


def steepest_direction(inputs: Inputs, slopes: np.ndarray) -> np.ndarray:
    """The direction (d,) in standard normals along which times change most, all conditions together.

    `slopes` (d, n) are their changes with each normal score.
    """
    return _leading(inputs.factor.T @ slopes)


def _linear(expansion: Expansion) -> np.ndarray:
    degrees = expansion.basis.degrees
    rows = [np.flatnonzero((degrees.sum(axis=1) == 1) & (degrees[:, axis] == 1)) for axis in range(degrees.shape[1])]
    return np.array([np.nan_to_num(expansion.coefficients[row].sum(axis=0)) for row in rows])


def _leading(slopes: np.ndarray) -> np.ndarray:
    """The direction (d,) along which slopes (d, n) are steepest over all conditions."""
    direction = np.linalg.eigh(matrix_product(slopes, slopes.T))[1][:, -1]
    steepest: np.ndarray = direction * np.where(direction[np.argmax(np.abs(direction))] < 0, -1.0, 1.0)
    return steepest
