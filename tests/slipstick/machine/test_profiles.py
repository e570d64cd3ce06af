"""Commands between instants: lines that have the integral of what bends between them."""

import numpy as np
import pytest
from scipy.integrate import quad_vec

from slipstick.machine.runs import Profile

RNG = np.random.default_rng(4)
CORNERS = np.sort(RNG.uniform(0, 1, (3, 9)), axis=1)
PROFILE = Profile(CORNERS, RNG.normal(size=(3, 9)))
TIME = np.linspace(0.1, 0.9, 41)


def test_lines_are_the_closest_ones() -> None:
    """No change of an inner value brings the lines closer, by quadrature."""
    step, values = TIME[1] - TIME[0], PROFILE.approximate(TIME)
    np.testing.assert_array_equal(values[:, [0, -1]], PROFILE.at(TIME[[0, -1]]))
    for place in (1, 7, 20, 39):
        def weigh(t: float, place: int = place) -> np.ndarray:
            lines = np.array([np.interp(t, TIME, row) for row in values])
            return (PROFILE.at(np.array([t]))[:, 0] - lines) * max(0.0, 1 - abs(t - TIME[place]) / step)

        inner = np.unique(CORNERS[(TIME[place - 1] < CORNERS) & (TIME[place + 1] > CORNERS)])
        left, _ = quad_vec(weigh, TIME[place - 1], TIME[place + 1], epsabs=1e-13, points=[TIME[place], *inner])
        np.testing.assert_allclose(left, 0, atol=1e-10)


def test_a_command_with_its_corners_on_instants_is_what_it_is() -> None:
    profile = Profile(np.tile(TIME[[0, 5, 6, 30, 40]], (2, 1)), RNG.normal(size=(2, 5)))
    np.testing.assert_allclose(profile.approximate(TIME), profile.at(TIME), atol=1e-12)


def test_runs_with_the_same_command_have_the_same_lines() -> None:
    rows = np.array([2, 0, 2, 1, 0])
    repeated = Profile(PROFILE.time[rows], PROFILE.value[rows])
    np.testing.assert_array_equal(repeated.approximate(TIME), PROFILE.approximate(TIME)[rows])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_instants(count: int) -> None:
    values = PROFILE.approximate(TIME[:count])
    assert values.shape == (3, count)
    np.testing.assert_array_equal(values[:, 0], PROFILE.at(TIME[:1])[:, 0])


def test_what_is_driven_by_the_lines_lacks_nothing_of_the_integral() -> None:
    """Samples lack the integral beside each corner: at the end far more is left of it."""
    fine = np.linspace(TIME[0], TIME[-1], 400_001)
    exact = np.trapezoid(PROFILE.at(fine), fine, axis=1)
    off = [np.abs(np.trapezoid(values, TIME, axis=1) - exact).max()
           for values in (PROFILE.approximate(TIME), PROFILE.at(TIME))]
    assert off[0] < 0.05 * off[1]


def test_long_recordings_lose_no_digits() -> None:
    time = np.linspace(0, 100, 400_001)
    profile = Profile(np.array([[0.0, 30, 70, 100]]), np.array([[1.0, 2, -1, 0]]))
    np.testing.assert_allclose(profile.approximate(time), profile.at(time), atol=1e-9)
