"""The algebra of the mixed-effects fit, against dense matrices that hold every number."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from slipstick.study.climb import bounded
from slipstick.study.linearised import Linearised
from slipstick.study.mixed import State, marginal

N, VALUES, P, SCATTERING = 5, (6, 4), 3, (0, 2)


@pytest.fixture
def dense() -> tuple[np.ndarray, np.ndarray, State]:
    """Jacobians (n, N, p) and residuals (n, N) in sensors' noise, and a state with modes, covariance and noise."""
    rng = np.random.default_rng(3)
    jacobian, residual = rng.standard_normal((N, sum(VALUES), P)), rng.standard_normal((N, sum(VALUES)))
    state = State(rng.standard_normal(P), rng.standard_normal((N, 2)), np.diag([0.5, 2.0]), np.array([1.5, 4.0]))
    return jacobian, residual, state


def summed(jacobian: np.ndarray, residual: np.ndarray) -> Linearised:
    rows = np.concatenate([jacobian, residual[..., None]], axis=2)
    first, second = rows[:, :VALUES[0]], rows[:, VALUES[0]:]
    return Linearised(np.array([one.transpose(0, 2, 1) @ one for one in (first, second)]), residual)


def test_products_under_the_marginal_covariance(dense: tuple[np.ndarray, np.ndarray, State]) -> None:
    jacobian, residual, state = dense
    found = marginal(summed(jacobian, residual), state, SCATTERING)
    noise = np.diag(np.repeat(state.noise, VALUES))
    for i in range(N):
        scattering = jacobian[i][:, SCATTERING]
        covariance = noise + scattering @ state.covariance @ scattering.T
        columns = np.column_stack([jacobian[i], residual[i] + scattering @ state.modes[i]])
        assert np.allclose(found.products[i], columns.T @ np.linalg.solve(covariance, columns), rtol=1e-9)
        assert found.logdet[i] == pytest.approx(np.linalg.slogdet(covariance)[1] - np.linalg.slogdet(noise)[1])
        posterior = np.linalg.inv(scattering.T @ np.linalg.solve(noise, scattering) + np.linalg.inv(state.covariance))
        assert np.allclose(found.gain[i], posterior, rtol=1e-9)


def test_the_marginal_density_is_that_of_scipy(dense: tuple[np.ndarray, np.ndarray, State]) -> None:
    jacobian, residual, state = dense
    found = marginal(summed(jacobian, residual), state, SCATTERING)
    for i in range(N):
        scattering = jacobian[i][:, SCATTERING]
        noise = np.diag(np.repeat(state.noise, VALUES))
        expected = multivariate_normal(cov=noise + scattering @ state.covariance @ scattering.T).logpdf(
            residual[i] + scattering @ state.modes[i])
        constant = sum(VALUES) * np.log(2 * np.pi) + np.linalg.slogdet(noise)[1]
        assert -0.5 * (found.products[i, -1, -1] + found.logdet[i] + constant) == pytest.approx(expected)


@pytest.mark.parametrize("seed", range(8))
def test_a_bounded_step_meets_the_conditions_of_its_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root, score = rng.standard_normal((9, 4)), 10 * rng.standard_normal(4)
    information, lower, upper = root.T @ root, np.full(4, -0.5), np.full(4, 0.7)
    step = bounded(information, score, lower, upper)
    slope = score - information @ step
    assert np.all((step >= lower) & (step <= upper))
    assert np.all(slope[step < upper - 1e-9] < 1e-6), "it could go up"
    assert np.all(slope[step > lower + 1e-9] > -1e-6), "it could go down"
