"""Nearly normal variables compared with the gamma and beta distributions of SciPy, and the inverse of the quantiles."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from slipstick.uncertainty.chaos.cornish_fisher import FARTHEST, quantile, score


@pytest.mark.parametrize("frozen", [stats.gamma(2e5), stats.beta(9e5, 9e5), stats.beta(9e5, 2e5)],
                         ids=["gamma", "beta", "asymmetric beta"])
def test_quantiles_are_those_of_scipy(frozen: Any) -> None:
    mean, variance, *shape = (float(moment) for moment in frozen.stats("mvsk"))
    z = np.linspace(0, 8, 17)
    for side, of_tail in ((-1, frozen.ppf), (1, frozen.isf)):
        expected = (of_tail(stats.norm.sf(z)) - mean) / np.sqrt(variance)
        np.testing.assert_allclose(quantile(side * z, *shape), expected, atol=3e-7)
        assert np.abs(expected - side * z).max() > 1e-6  # negative control: not the quantiles of a normal variable


@pytest.mark.parametrize("skewness", [0.0, 1e-9, 4e-3, -4e-3])
def test_the_score_is_the_inverse_of_the_quantile(skewness: float) -> None:
    z, shape = np.linspace(-FARTHEST, FARTHEST, 371), (skewness, 1.5 * skewness**2)
    np.testing.assert_allclose(score(quantile(z, *shape), *shape), z, atol=1e-12)
    np.testing.assert_array_equal(score(np.array([-1e9, 1e9]), *shape), [-FARTHEST, FARTHEST])
