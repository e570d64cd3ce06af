"""The regression compared with NumPy, and linearly dependent terms."""

import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.least_squares import projection


def test_agrees_with_numpy() -> None:
    random = np.random.default_rng(1)
    values, weights = random.standard_normal((40, 12)), random.uniform(0.1, 3.0, 40)
    observed = random.standard_normal((40, 5))
    root = np.sqrt(weights)[:, None]
    expected = np.linalg.lstsq(root * values, root * observed)[0]
    np.testing.assert_allclose(projection(values, weights) @ observed, expected, atol=1e-12)


def test_linearly_dependent_terms_raise() -> None:
    values = np.random.default_rng(1).standard_normal((40, 12))
    values[:, 7] = values[:, 3] - 2 * values[:, 5]
    with pytest.raises(InvalidValue, match="Take more samples"):
        projection(values, np.ones(40))
