"""Sums over lattices compared with the integral along lines and with plain sums by SciPy."""

import platform
import re
from dataclasses import replace

import numba
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.special import logsumexp
from scipy.stats import norm

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood import (
    TOLERANCE,
    Candidate,
    InferenceProblem,
    converged,
    exact,
    lattice,
    lattice_points,
    lattice_terms,
)
from slipstick.uncertainty.likelihood.likelihood import by_lattice, density_and_moments, optimizer_lattice, precise

KNOTS = (np.linspace(0.5, 1.5, 21), np.linspace(0.5, 1.5, 16))
CONDITIONS = 30
_MANY = 1 << 17
"""Points for errors far below those that a likelihood needs."""
CASES = {
    "wide noise": Candidate(Inputs([1.0, 1.0], [0.05, 0.08]), 0.02),
    "narrow noise": Candidate(Inputs([1.05, 0.95], [0.05, 0.08]), 0.002),
    "narrow inputs": Candidate(Inputs([1.0, 1.0], [0.002, 0.002]), 0.003),
    "one input without scatter": Candidate(Inputs([1.0, 1.0], [0.05, 0.0]), 0.005),
    "wider than the table": Candidate(Inputs([1.0, 1.0], [0.3, 0.3]), 0.01),
    "correlated": Candidate(Inputs([1.0, 1.0], [0.05, 0.08], correlation=[[1.0, 0.8], [0.8, 1.0]]), 0.005),
    "mixed": Candidate(Inputs([1.0, 1.0], mixing=[[0.05, 0.04], [0.01, 0.03]]), 0.004),
    "other families": Candidate(Inputs([1.0, 1.0], [0.08, 0.06], families=("lognormal", "gamma")), 0.005),
    "one input": Candidate(Inputs([1.02], [0.06]), 0.003),
}


def posed(truth: Candidate) -> InferenceProblem:
    """A table of smooth surfaces with small random kinks at its knots, and one measured time per condition."""
    random, d = np.random.default_rng(3), truth.inputs.dimension
    mesh = np.stack(np.meshgrid(*KNOTS[:d], indexing="ij"), axis=-1) - 1.0
    slopes = random.uniform(0.05, 0.25, (d, CONDITIONS)) * np.array([[1.0], [-1.0]])[:d]
    times = 0.5 + np.expm1(mesh @ slopes) + random.uniform(-1e-3, 1e-3, (*mesh.shape[:-1], CONDITIONS))
    table = RegularGridInterpolator(KNOTS[:d], times)

    def model(points: np.ndarray, conditions: object) -> np.ndarray:
        return np.asarray(table(np.clip(points, 0.5, 1.5)))

    measured = (np.diagonal(model(truth.inputs.points(random.standard_normal((CONDITIONS, d))), None))
                + truth.output_std * random.standard_normal(CONDITIONS))
    return InferenceProblem(model, None, measured, np.full(d, 0.5), np.full(d, 1.5), ("a", "b")[:d], KNOTS[:d])


@pytest.mark.parametrize("case", CASES)
def test_lattices_agree_with_lines(case: str) -> None:
    """The true error is below the estimated one, and both are below the tolerance."""
    candidate = CASES[case]
    problem = posed(candidate)
    summed = by_lattice(problem, candidate, TOLERANCE)
    assert summed is not None
    density, error, _ = summed
    reference = exact(problem, candidate)
    assert abs(density.sum() - reference.sum()) <= error + 1e-5 < TOLERANCE
    np.testing.assert_allclose(density, reference, atol=3e-3)
    np.testing.assert_array_equal(converged(problem, candidate)[0], density)
    # Negative control: the candidates of the test differ by more than their tolerances.
    shifted = Candidate(candidate.inputs, 1.05 * candidate.output_std)
    assert np.abs(exact(problem, shifted) - reference).max() > 3e-3


def test_the_stated_error_holds_beside_the_edge_of_the_table() -> None:
    """Where a clipped model stops changing, two lattices may agree by chance while both are wrong."""
    random, off = np.random.default_rng(7), []
    for _ in range(40):
        inputs = Inputs(random.uniform(0.8, 1.35, 2), np.exp(random.uniform(np.log(0.02), np.log(0.2), 2)))
        candidate = Candidate(inputs, np.exp(random.uniform(np.log(0.005), np.log(0.04))))
        problem = posed(candidate)
        summed = by_lattice(problem, candidate, TOLERANCE)
        if summed is not None:
            off.append((abs(float(summed[0].sum() - exact(problem, candidate).sum())), summed[1]))
    errors, stated = np.array(off).T
    assert len(off) > 30
    assert np.all(errors < stated + 1e-4)


def test_a_time_beyond_all_of_the_table_has_its_likelihood_at_the_edge() -> None:
    """Most of it lies where inputs are clipped; lines and lattices agree with a sum over a fine grid."""
    candidate = Candidate(Inputs([1.06, 1.12], [0.026, 0.051]), 0.005)
    problem = posed(candidate)
    centre, edge = problem.model(np.array([[1.06, 1.12], [1.06, 1.5]]), None)
    problem = replace(problem, measured_time=edge + np.sign(edge - centre) * 0.02)
    grid, total = np.arange(-14, 14, 0.05), np.full(CONDITIONS, -np.inf)
    for first in grid:
        u = np.column_stack([np.full_like(grid, first), grid])
        residual = (problem.measured_time - problem.model(candidate.inputs.points(u), None)) / 0.005
        terms = -0.5 * (np.sum(u**2, axis=1)[:, None] + residual**2)
        total = np.logaddexp(total, logsumexp(terms, axis=0))
    reference = (total + 2 * np.log(0.05) - 1.5 * np.log(2 * np.pi) - np.log(0.005)) / np.log(10) - 3
    np.testing.assert_allclose(exact(problem, candidate), reference, atol=2e-3)
    np.testing.assert_allclose(converged(problem, candidate)[0], reference, atol=TOLERANCE)


@pytest.mark.parametrize("case", CASES)
def test_negligible_points_change_nothing_and_are_many(case: str) -> None:
    candidate = CASES[case]
    problem = posed(candidate)
    whole, kept = precise(problem, candidate)[1], optimizer_lattice(problem, candidate)
    assert whole is not None
    assert kept is not None
    assert len(kept.normals) < 0.95 * len(whole.normals)
    density = {len(one.normals): density_and_moments(replace(problem, lattice=one), candidate)[0]
               for one in (whole, kept)}
    np.testing.assert_allclose(density[len(kept.normals)], density[len(whole.normals)], rtol=0, atol=5e-6)
    # Negative control: the points that are left matter.
    half = replace(kept, normals=kept.normals[::2])
    off = density_and_moments(replace(problem, lattice=half), candidate)[0] - density[len(kept.normals)]
    assert np.abs(off).max() > 0.1


@pytest.mark.parametrize("noise", [1e-5, 1e-9])
def test_noise_too_narrow_for_a_lattice_is_integrated_along_lines(noise: float) -> None:
    candidate = Candidate(CASES["wide noise"].inputs, noise)
    problem = posed(candidate)
    assert by_lattice(problem, candidate, TOLERANCE) is None
    density, error = converged(problem, candidate)
    np.testing.assert_array_equal(density, exact(problem, candidate))
    assert error < 1e-3


def test_without_lattices_the_lines_are_used() -> None:
    candidate = CASES["wide noise"]
    problem = posed(candidate)
    density, error = converged(problem, candidate, lattices=False)
    np.testing.assert_array_equal(density, exact(problem, candidate))
    assert error < 1e-3
    assert np.any(density != converged(problem, candidate)[0])


@pytest.mark.parametrize("case", [name for name in CASES if CASES[name].inputs.marginal_std.all()])
def test_moments_on_a_lattice_are_those_along_lines(case: str) -> None:
    """Moments of the scores, because lattice and lines have different coordinates u; also at another candidate."""
    candidate = CASES[case]
    problem = posed(candidate)
    summed = by_lattice(problem, candidate, 3e-3, _MANY)
    assert summed is not None
    on_lattice = replace(problem, lattice=summed[2])
    wider = Candidate(candidate.inputs, 1.2 * candidate.output_std)
    for each, other in ((candidate, wider), (wider, candidate)):
        (density, first, second, residual), expected = _of_scores(on_lattice, each), _of_scores(problem, each)
        np.testing.assert_allclose(density, expected[0], atol=3e-3)
        np.testing.assert_allclose(first, expected[1], atol=0.01)
        np.testing.assert_allclose(second, expected[2], atol=0.03)
        np.testing.assert_allclose(residual, expected[3], rtol=0.02)
        assert np.abs(density - _of_scores(problem, other)[0]).max() > 0.01  # negative control


def _of_scores(problem: InferenceProblem, candidate: Candidate) -> tuple[np.ndarray, ...]:
    density, factor, moments = density_and_moments(problem, candidate)
    return (density, moments.first @ factor.T, np.einsum("ia,nab,jb->nij", factor, moments.second, factor),
            moments.residual)


def test_a_sufficient_lattice_is_accurate_for_a_linear_model_and_coarser_than_a_converged_one() -> None:
    random = np.random.default_rng(2)
    slopes = random.uniform(-0.03, 0.03, (2, 40))
    direction, noise, measured = np.array([0.6, 0.8]), 0.015, random.normal(0.5, 0.03, 40)
    scatter = np.sqrt(noise**2 + np.sum(slopes**2, axis=0))
    expected = slopes * (measured - 0.5) / scatter**2
    points = lattice.sufficient_lattice(slopes, direction, noise, expected, 1 << 12)
    assert points is not None
    density = lattice.log10_density(points, 0.5 + points.normals @ slopes, measured, noise)
    np.testing.assert_allclose(density, norm.logpdf(measured, 0.5, scatter) / np.log(10) - 3, atol=1e-5)
    assert lattice.sufficient_lattice(slopes, direction, noise / 100, expected, 1 << 12) is None


def test_a_time_far_from_the_predicted_ones_is_integrated() -> None:
    """Up to ten stds, where the density is 10^-23 of its peak."""
    candidate = CASES["wide noise"]
    problem = posed(candidate)
    problem.measured_time[:3] += (0.1, -0.2, 0.25)
    density, error = converged(problem, candidate)
    reference = exact(problem, candidate)
    assert reference.min() < -15
    assert abs(density.sum() - reference.sum()) < TOLERANCE
    assert error < TOLERANCE


def test_a_condition_without_times_has_a_density_of_zero_and_a_partly_missing_one_is_right() -> None:
    candidate = CASES["wide noise"]
    problem = posed(candidate)
    complete = problem.model

    def model(points: np.ndarray, conditions: object) -> np.ndarray:
        times = complete(points, conditions)
        times[:, 0] = np.nan
        times[points[:, 0] > 1.05, 1] = np.nan
        return times

    partial = InferenceProblem(model, None, problem.measured_time, problem.lower, problem.upper, ("a", "b"), KNOTS)
    density = converged(partial, candidate)[0]
    assert density[0] == -np.inf
    assert density[1] < converged(problem, candidate)[0][1] - 0.01
    np.testing.assert_allclose(density[1:], exact(partial, candidate)[1:], atol=0.01)


def test_the_compiled_sum_is_that_of_scipy() -> None:
    """Also if the points come in two calls, and with NaN, which has a density of 0."""
    random = np.random.default_rng(1)
    times, distances = random.normal(0.5, 0.05, (300, 21)), random.chisquare(2, 300)
    measured = random.normal(0.5, 0.1, 21)
    monomials = random.normal(2.0, 1.0, (300, 2))
    times[random.uniform(size=times.shape) < 0.1] = np.nan
    for noise in (0.002, 0.05):
        peaks, largest, sums = np.full(21, -np.inf), np.zeros(21), np.zeros((4, 21))
        for first, part in ((0, slice(0, 100)), (100, slice(100, None))):
            numbers = np.full(21, -1.0)
            lattice_terms.add(times[part], measured, noise, distances[part], monomials[part], peaks, numbers, sums)
            largest = np.where(numbers >= 0, first + numbers, largest)
        terms = norm.logpdf(measured, times, noise) - norm.logpdf(0, 0, noise) - 0.5 * distances[:, None]
        terms = np.where(np.isnan(terms), -np.inf, terms)
        weights = np.exp(terms - logsumexp(terms, axis=0))
        np.testing.assert_allclose(peaks + np.log(sums[0]), logsumexp(terms, axis=0), rtol=1e-12, atol=1e-12)
        residual = 0.5 * np.nansum(weights * ((measured - times) / noise) ** 2, axis=0)
        np.testing.assert_allclose(sums[1:] / sums[0], [residual, *(monomials.T @ weights)], rtol=1e-9)
        np.testing.assert_array_equal(largest, np.argmax(terms, axis=0))


@pytest.mark.parametrize("direction", [np.ones(1), np.array([0.6, 0.8])])
def test_refinements_are_nested_lattices_of_half_the_cell(direction: np.ndarray) -> None:
    """All points so far, of each refinement, are the integer multiples of two (one) of them, within the edges."""
    edges = np.array([[-5.0, 3.0], [-4.0, 4.0]])[:len(direction)]
    refinements = lattice_points.refinements(direction, np.array([0.5, 0.7])[:len(direction)], edges, lattice.MOST)
    points, size = next(refinements)
    for _ in range(4):
        added, half = next(refinements)
        assert half == pytest.approx(size / 2)
        size, points = half, np.concatenate([points, added])
        assert len(np.unique(points.round(9), axis=0)) == len(points)
        assert len(points) * size == pytest.approx(8.0 ** len(direction), rel=0.15)
        coordinates = points @ lattice_points.axes_of(direction)
        assert np.all((coordinates >= edges[:, 0] - 1e-9) & (coordinates <= edges[:, 1] + 1e-9))
        nearest = points[np.argsort(np.linalg.norm(points, axis=1))[1:len(direction) + 2]]
        basis = nearest[:1] if len(direction) == 1 else nearest[[0, 1 if abs(np.linalg.det(nearest[:2])) > 1e-9 else 2]]
        multiples = points @ np.linalg.inv(basis)
        np.testing.assert_allclose(multiples, multiples.round(), atol=1e-9)


@pytest.mark.parametrize("d", [1, 2])
def test_the_points_inside_a_box_of_scores_are_those_of_numpy(d: int) -> None:
    random = np.random.default_rng(4)
    normals, factor = random.standard_normal((200, d)), random.standard_normal((d, d))
    box = np.array([[-0.7, 1.2], [-0.4, 0.9]])[:d]
    every = normals @ factor.T
    is_inside = np.all((every >= box[:, 0]) & (every <= box[:, 1]), axis=1)
    scores, points, squares = lattice_points.inside(normals, factor, box)
    assert 10 < len(points) < 190
    np.testing.assert_array_equal(points, normals[is_inside])
    np.testing.assert_allclose(scores, every[is_inside], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(squares, (points**2).sum(axis=1), rtol=1e-14)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 assembly")
def test_the_sum_is_compiled_to_vector_instructions() -> None:
    """A loss of vectorization is silent, and costs a factor of about eight."""
    plain = lattice_terms.add.py_func  # a cached one has no assembly
    add = numba.njit(error_model="numpy", fastmath={"contract"})(plain)
    add(np.zeros((2, 9)), np.zeros(9), 1.0, np.zeros(2), np.zeros((2, 0)), np.zeros(9), np.zeros(9), np.zeros((1, 9)))
    packed = re.findall(r"v?(?:add|sub|mul|f\w+)pd\s", "".join(add.inspect_asm().values()))
    assert len(packed) > 16  # the exp alone has a polynomial of degree 12
