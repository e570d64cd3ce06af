"""The likelihood of measured shifting times (eq. 7), per condition and in logarithms.

    log10 p_i = log10 E_u[ N(t_i; y_i(x(u)), output_std^2) ]    per millisecond

Each run has its own realisation of the standard normals u, so the likelihood is the product over the conditions. Three
methods compute the expectation: `exact` integrates the model along lines, `by_expansion` integrates its expansion along
lines, and `by_sampling` averages over samples of the expansion, as in the paper. The number of samples required for a
given accuracy grows as the output noise decreases, and with the distance of a measured time from the predicted times.
"""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from slipstick.numerics.matrix_product import matrix_product
from slipstick.uncertainty.chaos.expansion import Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood import lattice, lines
from slipstick.uncertainty.likelihood.line_rules import ACROSS, WINDOW, along, domain, knotted_lines
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem, Lattice
from slipstick.uncertainty.likelihood.replicates import LikelihoodEstimate, Target, expected_normals, integrate
from slipstick.uncertainty.sampling import log10_mean_density

SAMPLES = 4096
"""Default number of samples for `by_sampling`, a power of two."""
_BLOCK = 1 << 13  # points per call of the model
TOLERANCE = 0.05
"""Default tolerance of `converged`, in decades."""
PRECISE = 1e-2
"""Largest estimated error of a sum over a lattice in a fit, in decades; the true one is a tenth of it or less."""
_MOST_IN_SEARCH = 1 << 10  # points of a lattice of an expansion; more take as long as lines
MOST_LINES = 1024
KNOTTED = 2
"""Largest number of inputs for which lines have breakpoints at knots; for three such a rule needs too many points."""
_ROUNDING, _CURVED = 5e-6, 2e-4  # decades per condition: see `exact`, the second for inputs that are not normal
_DEPENDENT = 1e-6  # determinant of the factor below which the inputs count as perfectly correlated
_FURTHEST = 60.0  # largest half length of a line in stds
_LINEAR = 4.0  # distance in stds of a measured time from which on that of a linear model is not relied on


def exact(problem: InferenceProblem, candidate: Candidate, count: int = ACROSS, seed: int = 1) -> np.ndarray:
    """log10 p per ms by integration of the model: shape (n,), -inf if all times of a condition are NaN.

    For a model with knots and up to two inputs, the only errors are rounding, the error of the Gauss rule across the
    lines and, for inputs that are not normal, that of the linear interpolation in their scores, about 0.0002 decades
    per condition (line_rules.py). For other models the times are interpolated linearly over half a std, and for three
    or more inputs the lines are `count` seeded samples. Inputs for which the time is NaN have a density of 0.
    """
    quadrature = integration_lines(problem, candidate, count, seed)
    return lines.log10_density(quadrature, times_on_lines(problem, candidate.inputs, quadrature), problem.measured_time,
                               candidate.output_std)


def converged(problem: InferenceProblem, candidate: Candidate, seed: int = 1, tolerance: float = TOLERANCE,
              lattices: bool = True) -> LikelihoodEstimate:
    """The likelihood with an adaptive number of points, and its error.

    For a model with knots and up to two inputs, the points are a lattice (lattice.py), or the lines of `exact` if the
    output noise is too narrow for it or without `lattices`. Otherwise the number of lines (replicates.py) is doubled
    until the error is below `tolerance`, or `MOST_LINES` is reached.
    """
    if is_knotted(problem, candidate.inputs):
        summed = by_lattice(problem, candidate, tolerance) if lattices else None
        if summed:
            return LikelihoodEstimate(summed[0], summed[1] + _unresolved_error(problem, candidate))
        return with_lines(problem, candidate, ACROSS, seed)
    count = ACROSS
    estimate = with_lines(problem, candidate, count, seed)
    while estimate.error > tolerance and count < MOST_LINES:
        count *= 2
        estimate = with_lines(problem, candidate, count, seed + count)
    return estimate


def with_lines(problem: InferenceProblem, candidate: Candidate, count: int = ACROSS,
               seed: int = 1) -> LikelihoodEstimate:
    """The likelihood with a given number of lines, and its error.

    For a model with knots and up to two inputs, lines between the knots are as many as these require. Where a measured
    time is far, their rule, which is chosen at the mean of the inputs, may be too coarse: one node less for each of its
    pieces shows what it leaves out. For inputs that are not normal, other lines are used there.
    """
    inputs = candidate.inputs
    centre, of_scores = centre_slopes(problem, inputs)
    unresolved = _unresolved_error(problem, candidate)
    if is_knotted(problem, inputs):
        distance = _distance(problem.measured_time, centre, inputs.factor.T @ of_scores, candidate.output_std)
        is_near = distance < _LINEAR
        if is_near or set(inputs.families) == {"normal"}:
            density = exact(problem, candidate)
            return LikelihoodEstimate(density, unresolved + (
                0.0 if is_near or inputs.dimension == 1 else _last_node_change(problem, candidate, density)))
    estimate = integrate(_target(problem, candidate, centre, of_scores), count, seed)
    return LikelihoodEstimate(estimate.density, estimate.error + unresolved)


def _last_node_change(problem: InferenceProblem, candidate: Candidate, density: np.ndarray) -> float:
    """The change of the sum over log10 p (n,) between knots by the last node of each piece across the lines."""
    quadrature = integration_lines(problem, candidate, more=-1)
    times = times_on_lines(problem, candidate.inputs, quadrature)
    fewer = lines.log10_density(quadrature, times, problem.measured_time, candidate.output_std)
    with np.errstate(invalid="ignore"):  # two likelihoods of 0
        change = abs(float(density.sum() - fewer.sum()))
    return change if math.isfinite(change) else math.inf


def _target(problem: InferenceProblem, candidate: Candidate, centre: np.ndarray, of_scores: np.ndarray) -> Target:
    """The model as a function of standard normals; `of_scores` (d, n) are its derivatives by the normal scores."""
    inputs = candidate.inputs
    return Target(lambda normals: problem.model(inputs.points(normals), problem.conditions), np.nan_to_num(centre),
                  inputs.factor.T @ of_scores, problem.measured_time, candidate.output_std)


def _unresolved_error(problem: InferenceProblem, candidate: Candidate) -> float:
    """What no refinement shows: rounding, and the interpolation between the knots of a model, in decades."""
    is_linear = not is_knotted(problem, candidate.inputs) or set(candidate.inputs.families) == {"normal"}
    return len(problem.measured_time) * (_ROUNDING if is_linear else _CURVED)


def integration_lines(problem: InferenceProblem, candidate: Candidate, count: int = ACROSS, seed: int = 1,
                      more: int = 0) -> lines.Lines:
    """The lines along which `exact` integrates the model for the candidate, with `more` nodes (see `knotted_lines`)."""
    inputs, noise = candidate.inputs, candidate.output_std
    centre, slopes = centre_slopes(problem, inputs)
    distance = _distance(problem.measured_time, centre, inputs.factor.T @ slopes, noise)
    if is_knotted(problem, inputs):
        assert problem.knots is not None
        if distance > _LINEAR:
            normals = _target(problem, candidate, centre, slopes).most_likely()
            distance = float(np.max(np.linalg.norm(normals, axis=0)))
        return knotted_lines(inputs, problem.knots, slopes, noise, min(WINDOW + distance, _FURTHEST), more)
    direction = steepest_direction(inputs, slopes) if problem.direction is None else problem.direction
    return along(direction, inputs.factor, WINDOW + min(distance, WINDOW), count, seed)


def precise(problem: InferenceProblem, candidate: Candidate) -> tuple[np.ndarray, Lattice | None]:
    """log10 p (n,) per ms as fits compare it, and the lattice over which it is a sum, if any.

    It is `exact`, or for a model with knots and up to two inputs a sum with an estimated error of at most `PRECISE`.
    """
    if is_knotted(problem, candidate.inputs):
        summed = by_lattice(problem, candidate, PRECISE)
        if summed:
            density, _, points = summed
            return density, points
    return exact(problem, candidate), None


def optimizer_lattice(problem: InferenceProblem, candidate: Candidate) -> Lattice | None:
    """The lattice of `precise` without its negligible points, which an optimizer keeps near the candidate."""
    points = precise(problem, candidate)[1]
    return None if points is None else lattice.trim(problem, candidate, points, _box_of(problem, candidate, points))


def by_lattice(problem: InferenceProblem, candidate: Candidate, tolerance: float,
               most: int = lattice.MOST) -> tuple[np.ndarray, float, Lattice] | None:
    """As `converged` for a model with knots and up to two inputs, with the lattice; None if lines are required."""
    inputs = candidate.inputs
    centre, of_scores = centre_slopes(problem, inputs)
    slopes = inputs.factor.T @ of_scores
    distance = _distance(problem.measured_time, centre, slopes, candidate.output_std)
    expected = expected_normals(problem.measured_time - centre, slopes, candidate.output_std)
    return lattice.sum_to_tolerance(problem, candidate, slopes, _leading_direction(slopes), expected,
                                    _box(problem, inputs, distance), tolerance, most)


def density_and_moments(problem: InferenceProblem,
                        candidate: Candidate) -> tuple[np.ndarray, np.ndarray, lines.Moments]:
    """log10 p (n,) per ms, the matrix `factor` (d, d) of the scores `factor` u, and the conditional moments of u."""
    inputs = candidate.inputs
    if problem.lattice is None:
        quadrature = integration_lines(problem, candidate)
        times = times_on_lines(problem, inputs, quadrature)
        density, moments = lines.density_and_moments(quadrature, times, problem.measured_time, candidate.output_std)
        return density, quadrature.factor, moments
    box = _box_of(problem, candidate, problem.lattice)
    density, moments = lattice.density_and_moments(problem, candidate, problem.lattice, box)
    return density, inputs.factor, moments


def _box_of(problem: InferenceProblem, candidate: Candidate, points: Lattice) -> np.ndarray:
    return _box(problem, candidate.inputs, float(np.max(np.abs(points.normals))))


def _box(problem: InferenceProblem, inputs: Inputs, distance: float) -> np.ndarray:
    assert problem.knots is not None
    return np.array([domain(inputs, problem.knots, axis, WINDOW + distance) for axis in range(inputs.dimension)])


def _distance(measured: np.ndarray, centre: np.ndarray, slopes: np.ndarray, noise: float) -> float:
    """The largest distance of a measured time (n,) from its mean in stds, for a linear model with slopes (d, n)."""
    scatter = np.sqrt(noise**2 + np.sum(slopes**2, axis=0))
    return float(np.nanmax(np.abs(measured - centre) / scatter, initial=0.0))


def times_on_lines(problem: InferenceProblem, inputs: Inputs, quadrature: lines.Lines) -> np.ndarray:
    """Times of the model at the breakpoints of the lines, shape (m g, n), s."""
    points = inputs.at_scores(quadrature.scores)
    for edge in (problem.lower, problem.upper):  # rounding must not move a knot at the edge outside the domain
        points = np.where(np.abs(points - edge) < 1e-9 * np.abs(edge), edge, points)
    return problem.model(points, problem.conditions)


def by_expansion(problem: InferenceProblem, candidates: Sequence[Candidate],
                 settings: ExpansionSettings) -> np.ndarray:
    """log10 p per ms of c candidates by integration of their expansions, as a search compares them: shape (c, n).

    The integral is along the lines of `exact`, or for one or two inputs a sum over a lattice, if a lattice is accurate
    and takes less time. The value is -inf for a condition without an expansion. The log10 likelihood is the sum over
    the conditions.
    """
    likelihood = np.empty((len(candidates), len(problem.measured_time)))
    for row, (candidate, expansion) in enumerate(_expansions(problem, candidates, settings)):
        inputs, measured, noise = candidate.inputs, problem.measured_time, candidate.output_std
        slopes, points = expansion.linear, None
        direction = _leading_direction(slopes)
        if inputs.dimension <= KNOTTED:
            expected = expected_normals(measured - expansion.mean, slopes, noise)
            points = lattice.sufficient_lattice(slopes, direction, noise, expected, _MOST_IN_SEARCH)
        if points is None:
            quadrature = along(direction, np.eye(inputs.dimension))
            times = expansion.at(inputs.germs_of(quadrature.scores))
            likelihood[row] = lines.log10_density(quadrature, times, measured, noise)
        else:
            times = expansion.at(inputs.germs_of(points.normals))
            likelihood[row] = lattice.log10_density(points, times, measured, noise)
    return likelihood


def by_sampling(problem: InferenceProblem, candidates: Sequence[Candidate], settings: ExpansionSettings,
                normals: np.ndarray) -> np.ndarray:
    """As `by_expansion`, but averaged over the standard normals `normals` (m, d), as in the paper: shape (c, n)."""
    likelihood = np.empty((len(candidates), len(problem.measured_time)))
    for row, (candidate, expansion) in enumerate(_expansions(problem, candidates, settings)):
        times = expansion.at(candidate.inputs.germs_of(normals))
        likelihood[row] = log10_mean_density(times, problem.measured_time, candidate.output_std)
    return likelihood


def expanded_with_lines(problem: InferenceProblem, candidates: Sequence[Candidate], settings: ExpansionSettings,
                        count: int = ACROSS, seed: int = 1) -> np.ndarray:
    """log10 p per ms of c candidates by expansions, integrated as `with_lines` integrates a model: shape (c, n)."""
    likelihood = np.empty((len(candidates), len(problem.measured_time)))
    for row, (candidate, expansion) in enumerate(_expansions(problem, candidates, settings)):
        def times_at(normals: np.ndarray, inputs: Inputs = candidate.inputs, expansion: Expansion = expansion
                     ) -> np.ndarray:
            return expansion.at(inputs.germs_of(normals))

        centre, slopes = _differences(times_at, candidate.inputs.dimension)
        target = Target(times_at, np.nan_to_num(centre), slopes, problem.measured_time, candidate.output_std)
        likelihood[row] = integrate(target, count, seed).density
    return likelihood


def compared(problem: InferenceProblem, candidates: Sequence[Candidate], likelihood: np.ndarray,
             seed: int = 1) -> list[LikelihoodEstimate]:
    """The likelihood (c, n) by expansion or sampling with its error: the difference to that of `converged`.

    It contains the error of the expansions, which their own terms do not show at kinks and far from their nodes, and
    that of the mean over samples, whose spread does not show that no sample is near a measured time.
    """
    estimates = []
    for candidate, density in zip(candidates, likelihood, strict=True):
        reference = converged(problem, candidate, seed)
        error = abs(float(density.sum() - reference.density.sum())) + reference.error
        estimates.append(LikelihoodEstimate(density, error if math.isfinite(error) else math.inf))
    return estimates


def _expansions(problem: InferenceProblem, candidates: Sequence[Candidate],
                settings: ExpansionSettings) -> Iterator[tuple[Candidate, Expansion]]:
    size = max(1, _BLOCK // len(make_basis(candidates[0].inputs.germs, settings).nodes)) if candidates else 1
    for first in range(0, len(candidates), size):
        block = candidates[first:first + size]
        bases = [make_basis(candidate.inputs.germs, settings) for candidate in block]
        nodes = [candidate.inputs.at_germs(basis.nodes) for candidate, basis in zip(block, bases, strict=True)]
        times = problem.model(np.concatenate(nodes), problem.conditions)
        ends = np.cumsum([len(points) for points in nodes])[:-1]
        for candidate, basis, times_at_nodes in zip(block, bases, np.split(times, ends), strict=True):
            yield candidate, expand(basis, times_at_nodes)


def is_knotted(problem: InferenceProblem, inputs: Inputs) -> bool:
    """Whether the likelihood is integrated between the knots of the model."""
    return problem.knots is not None and inputs.dimension <= KNOTTED and abs(np.linalg.det(inputs.factor)) > _DEPENDENT


def centre_slopes(problem: InferenceProblem, inputs: Inputs) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) in s at scores of 0, and their derivatives with respect to each normal score (d, n), 0 where NaN."""
    return _differences(lambda scores: problem.model(inputs.at_scores(scores), problem.conditions), inputs.dimension)


def _differences(times_at: Callable[[np.ndarray], np.ndarray], d: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) at coordinates of 0, and their derivatives (d, n) by differences over one std on either side."""
    step = np.eye(d)
    times = times_at(np.concatenate([np.zeros((1, d)), step, -step]))
    return times[0], np.nan_to_num((times[1:1 + d] - times[1 + d:]) / 2)


def steepest_direction(inputs: Inputs, slopes: np.ndarray) -> np.ndarray:
    """The unit vector (d,) in the space of the standard normals along which the times of all conditions change most.

    `slopes` (d, n) are the derivatives of the times with respect to each normal score.
    """
    return _leading_direction(inputs.factor.T @ slopes)


def _leading_direction(slopes: np.ndarray) -> np.ndarray:
    """The leading left singular vector (d,) of the slopes (d, n), with its largest entry positive."""
    direction = np.linalg.eigh(matrix_product(slopes, slopes.T))[1][:, -1]
    return np.asarray(direction * np.where(direction[np.argmax(np.abs(direction))] < 0, -1.0, 1.0))
