"""Intervals of the coefficients of a finding in the simulation."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.naming.scene import Pair
from slipstick.studies import StudySettings, findings


@pytest.mark.parametrize(("pair", "expected"), [
    (("pressure sensor", "lag"), 5e-4),  # a later clock and a shorter lag look alike
    (("contact pressure", "lag"), 1e-5), (("pressure sensor", "offset"), 1e-5)])
def test_the_interval_of_a_lag_of_a_sensor_has_the_error_of_its_clock(pair: Pair, expected: float) -> None:
    law: Any = SimpleNamespace(std=np.array([5e-4]))
    unknown = SimpleNamespace(name="lag", unit="s", lower=0.0, upper=0.1, span=0.1)
    after: Any = SimpleNamespace(covariance=np.array([[1e-10]]), values=np.array([0.01]),
                                 block=SimpleNamespace(terms=SimpleNamespace(unknowns=[unknown])))
    result = findings._confirmation(StudySettings(), after, [0], "effect", True, findings._clock_error(pair, law))
    coefficient, = result.coefficients
    assert coefficient.upper - coefficient.value == pytest.approx(1.645 * expected, rel=0.01)
    assert coefficient.value - coefficient.lower == pytest.approx(1.645 * expected, rel=0.01)
