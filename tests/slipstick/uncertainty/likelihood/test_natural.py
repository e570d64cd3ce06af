"""The likelihood on natural scale, with its derivatives compared with differences of it."""

import numpy as np
import pytest
from test_gradient import by_differences, knotted, linear, smooth

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, exact
from slipstick.uncertainty.likelihood.natural import NaturalLikelihood

CASES = {"table of 2 inputs": knotted(), "linear, 1 input": linear(1), "smooth, 3 inputs": smooth(3)}


def vector(problem: InferenceProblem) -> np.ndarray:
    d = len(problem.axes)
    return np.array([*[1.02, 0.97, 1.05][:d], *[0.06, 0.09, 0.05][:d], 0.008])


@pytest.mark.parametrize("case", CASES)
def test_values_and_derivatives_agree_with_the_likelihood(case: str) -> None:
    likelihood = NaturalLikelihood(CASES[case])
    point, d = vector(CASES[case]), len(CASES[case].axes)
    candidate = Candidate(Inputs(point[:d], point[d:2 * d]), point[-1])
    assert likelihood.value(point) == exact(CASES[case], candidate).sum()
    step = 1e-2 * point[-1]  # the output std is the smallest scale
    gradient = by_differences(lambda moved: np.array([likelihood.value(moved)]), point, step)[0]
    tolerance = 1e-4 if d < 3 else 5e-3
    np.testing.assert_allclose(likelihood.gradient(point), gradient, atol=tolerance * np.abs(gradient).max())
    hessian = by_differences(likelihood.gradient, point, step)
    for direction in np.random.default_rng(1).normal(size=(2, len(point))) * point:
        expected = hessian @ direction
        np.testing.assert_allclose(likelihood.apply_hessian(point, direction), expected,
                                   atol=tolerance * np.abs(expected).max())
    assert not likelihood.apply_hessian(point, np.zeros(len(point))).any()


def test_where_the_likelihood_is_zero_it_has_no_derivatives() -> None:
    likelihood = NaturalLikelihood(linear(2))
    for change in ((2, -0.01), (4, 0.0), (4, -0.1)):
        point = vector(linear(2))
        point[change[0]] = change[1]
        assert likelihood.value(point) == -np.inf
        with pytest.raises(InvalidValue, match="no derivatives"):
            likelihood.gradient(point)
    fixed = vector(linear(2)) * np.array([1, 1, 0, 1, 1])
    assert np.isfinite(likelihood.value(fixed))  # an input without scatter is possible
    for act in (likelihood.gradient, lambda point: likelihood.apply_hessian(point, np.ones(5))):
        with pytest.raises(InvalidValue, match="no derivatives"):
            act(fixed)
