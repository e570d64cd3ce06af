"""The filter against the dense covariance matrix, which is built from responses to single impulses of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import block_diag

from slipstick.engine.noise import Noise, draw_noise
from slipstick.engine.whitening import CarriedNoise, Whitening, join_steps

SENSORS = Noise(0.5, 0.6), Noise(2.0, -0.3)
INPUTS = Noise(0.4, 0.8), Noise(1.5, 0.0)
LOUD, LOUD_INPUTS = np.array([[1.0, 0.5], [1.7, 2.0]]), np.array([[0.6, 1.0], [1.0, 3.0]])
"""By how much the noise of each run is louder."""
RUNS, SAMPLES, COLUMNS = 2, 24, 11  # more columns than are filtered together


def whiten(columns: np.ndarray, counted: np.ndarray, sensors: Sequence[Noise], loudness: np.ndarray,
           carried: CarriedNoise | None = None) -> np.ndarray:
    return Whitening.of(counted, sensors, loudness, carried).apply(columns)


@dataclass(frozen=True, eq=False)
class Carrier:
    """Noise of r inputs that reaches o outputs through d states, differently at each instant."""

    d: int
    r: int
    o: int
    k: int = SAMPLES
    direct: bool = True

    @property
    def carried(self) -> CarriedNoise:
        rng, (d, r, o, k) = np.random.default_rng(10 * self.d + self.r), (self.d, self.r, self.o, self.k)
        return CarriedNoise(INPUTS[:r], LOUD_INPUTS[:, :r], rng.uniform(-0.6, 0.8, (RUNS, k - 1, d, d)),
                            *rng.standard_normal((2, RUNS, k - 1, d, r)), rng.standard_normal((RUNS, o, k, d)),
                            self.direct * rng.standard_normal((RUNS, o, k, r)))

    def responses(self, run: int) -> np.ndarray:
        """What an impulse of each input at each instant adds to the outputs: (o k, r k)."""
        carried, k = self.carried, self.k
        out = np.zeros((self.o, k, self.r, k))
        for source in range(self.r):
            for begin in range(k):
                x = carried.G[run, begin - 1, :, source] if begin else np.zeros(self.d)
                for t in range(begin, k):
                    impulse = np.eye(self.r)[source] * (t == begin)
                    out[:, t, source, begin] = carried.C[run, :, t] @ x + carried.E[run, :, t] @ impulse
                    if t + 1 < k:
                        x = carried.A[run, t] @ x + carried.F[run, t] @ impulse
        return out.reshape(self.o * k, self.r * k)

    def covariance(self, run: int) -> np.ndarray:
        """Covariance (o k, o k) of the residuals of a run."""
        own = block_diag(*(autocovariance(*pair, self.k) for pair in zip(SENSORS[:self.o], LOUD[run], strict=False)))
        if self.r == 0:
            return own
        responses, pairs = self.responses(run), zip(INPUTS[:self.r], LOUD_INPUTS[run], strict=False)
        inputs = block_diag(*(autocovariance(*pair, self.k) for pair in pairs))
        return np.asarray(own + responses @ inputs @ responses.T)


def autocovariance(noise: Noise, loud: float, k: int) -> np.ndarray:
    lags = np.abs(np.subtract.outer(np.arange(k), np.arange(k)))
    return np.asarray((loud * noise.std) ** 2 * np.power(noise.correlation, lags))


def choose(missing: str, o: int, k: int) -> np.ndarray:
    """Samples (n, o, k) that count."""
    counted = np.ones((RUNS, o, k), bool)
    if missing == "ends":
        counted[0, 0, :3] = counted[1, -1, -4:] = False
    if missing == "gaps":
        counted = np.random.default_rng(5).uniform(size=counted.shape) < 0.6
    if missing == "whole outputs":
        counted[0, 0] = counted[1, -1] = False
    return counted


CARRIERS = [Carrier(0, 0, 1), Carrier(0, 0, 2), Carrier(0, 1, 1), Carrier(0, 2, 2), Carrier(1, 0, 1), Carrier(1, 1, 1),
            Carrier(1, 1, 1, direct=False), Carrier(1, 2, 2), Carrier(2, 1, 1), Carrier(2, 2, 1), Carrier(2, 2, 2),
            Carrier(2, 2, 2, direct=False), Carrier(2, 1, 2, k=1)]


@pytest.mark.parametrize("missing", ["nothing", "ends", "gaps", "whole outputs"])
@pytest.mark.parametrize("carrier", CARRIERS, ids=lambda carrier: f"d{carrier.d}r{carrier.r}o{carrier.o}k{carrier.k}"
                                                                  f"{'' if carrier.direct else ' indirect'}")
def test_products_are_those_under_the_inverse_covariance(carrier: Carrier, missing: str) -> None:
    o, k = carrier.o, carrier.k
    counted = choose(missing, o, k)
    columns = np.random.default_rng(6).standard_normal((RUNS, COLUMNS, o, k))
    white = whiten(np.where(counted[:, None], columns, 1e3), counted, SENSORS[:o], LOUD[:, :o], carrier.carried)
    assert white.shape == (RUNS, COLUMNS, o * k)
    for run in range(RUNS):
        kept = counted[run].ravel()
        rows = columns[run].reshape(COLUMNS, o * k)[:, kept]
        exact = rows @ np.linalg.solve(carrier.covariance(run)[np.ix_(kept, kept)], rows.T) if kept.any() else (
            np.zeros((COLUMNS, COLUMNS)))
        np.testing.assert_allclose(white[run] @ white[run].T, exact, rtol=1e-8, atol=1e-8)
        np.testing.assert_array_equal(white[run][:, ~kept], 0)


@pytest.mark.parametrize("missing", ["nothing", "ends", "gaps", "whole outputs"])
@pytest.mark.parametrize("carrier", [each for each in CARRIERS if each.r], ids=lambda carrier: (
    f"d{carrier.d}r{carrier.r}o{carrier.o}k{carrier.k}{'' if carrier.direct else ' indirect'}"))
def test_the_noise_of_inputs_is_its_mean_given_the_residuals(carrier: Carrier, missing: str) -> None:
    o, k, r = carrier.o, carrier.k, carrier.r
    counted = choose(missing, o, k)
    left = np.random.default_rng(6).standard_normal((RUNS, o, k))
    whitening = Whitening.of(counted, SENSORS[:o], LOUD[:, :o], carrier.carried)
    estimated = whitening.estimate_inputs(np.where(counted, left, 1e3))
    for run in range(RUNS):
        kept, pairs = counted[run].ravel(), zip(INPUTS[:r], LOUD_INPUTS[run], strict=False)
        inputs = block_diag(*(autocovariance(*pair, k) for pair in pairs))
        covariance = (inputs @ carrier.responses(run).T)[:, kept]
        exact = covariance @ np.linalg.solve(carrier.covariance(run)[np.ix_(kept, kept)], left[run].ravel()[kept])
        np.testing.assert_allclose(estimated[run].ravel(), exact, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("missing", ["nothing", "ends", "gaps", "whole outputs"])
@pytest.mark.parametrize("o", [1, 2])
def test_noise_of_sensors_alone_has_a_faster_filter_of_the_same_values(o: int, missing: str) -> None:
    counted = choose(missing, o, SAMPLES)
    columns = np.random.default_rng(7).standard_normal((RUNS, COLUMNS, o, SAMPLES))
    white, carrier = whiten(columns, counted, SENSORS[:o], LOUD[:, :o]), Carrier(0, 0, o)
    np.testing.assert_allclose(white, whiten(columns, counted, SENSORS[:o], LOUD[:, :o], carrier.carried), atol=1e-12)
    for run in range(RUNS):
        kept = counted[run].ravel()
        rows = columns[run].reshape(COLUMNS, -1)[:, kept]
        covariance = carrier.covariance(run)[np.ix_(kept, kept)]
        exact = rows @ np.linalg.solve(covariance, rows.T) if kept.any() else np.zeros((COLUMNS, COLUMNS))
        np.testing.assert_allclose(white[run] @ white[run].T, exact, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("carrier", [Carrier(0, 0, 2, 300), Carrier(0, 1, 1, 300), Carrier(1, 1, 1, 300),
                                     Carrier(2, 2, 2, 300)],
                         ids=lambda carrier: f"d{carrier.d}r{carrier.r}o{carrier.o}")
@pytest.mark.parametrize("missing", ["nothing", "gaps"])
def test_noise_comes_out_white_with_unit_variance(carrier: Carrier, missing: str) -> None:
    """Noise in the columns: drawn for inputs and sensors, and carried by the recurrence."""
    rng, o, k, draws = np.random.default_rng(8), carrier.o, carrier.k, 100
    carried, counted = carrier.carried, choose(missing, o, k)
    columns = np.empty((RUNS, draws, o, k))
    for run in range(RUNS):
        u = np.array([loud * draw_noise(noise, (draws, k), rng) for noise, loud in zip(
            carried.inputs, LOUD_INPUTS[run], strict=False)]).reshape(carrier.r, draws, k)
        x = np.zeros((carrier.d, draws))
        for t in range(k):
            columns[run, :, :, t] = (carried.C[run, :, t] @ x + carried.E[run, :, t] @ u[:, :, t]).T
            if t + 1 < k:
                x = carried.A[run, t] @ x + carried.F[run, t] @ u[:, :, t] + carried.G[run, t] @ u[:, :, t + 1]
        for output in range(o):
            columns[run, :, output] += LOUD[run, output] * draw_noise(SENSORS[output], (draws, k), rng)
    white = whiten(columns, counted, SENSORS[:o], LOUD[:, :o], carried).reshape(RUNS, draws, o, k)
    values = np.where(counted[:, None], white, np.nan)
    assert np.nanvar(values) == pytest.approx(1, abs=0.03)
    np.testing.assert_allclose(np.nanvar(values, axis=(0, 1, 3)), 1, atol=0.04)
    np.testing.assert_allclose(np.nanvar(values[..., :5]), 1, atol=0.3)  # from the first sample on
    for later in (1, 2, 5):
        assert abs(np.nanmean(values[..., later:] * values[..., :-later])) < 0.03
    if o == 2:
        assert abs(np.nanmean(values[:, :, 0] * values[:, :, 1])) < 0.03


def test_columns_are_filtered_as_they_are_alone() -> None:
    carrier, counted = Carrier(2, 2, 2), choose("gaps", 2, SAMPLES)
    columns = np.random.default_rng(9).standard_normal((RUNS, COLUMNS, 2, SAMPLES))
    columns[:, 3] *= 1e200  # what overflows in a column stays there
    white = whiten(columns, counted, SENSORS, LOUD, carrier.carried)
    for column in (0, 8, 10):
        alone = whiten(columns[:, column:column + 1], counted, SENSORS, LOUD, carrier.carried)
        np.testing.assert_allclose(white[:, column], alone[:, 0], rtol=1e-12)


def test_the_unit_of_a_column_is_that_of_the_sensor() -> None:
    columns, counted = np.random.default_rng(9).standard_normal((RUNS, 3, 1, SAMPLES)), choose("ends", 1, SAMPLES)
    white = whiten(columns, counted, [Noise(0.5, 0.6)], LOUD[:, :1])
    np.testing.assert_allclose(whiten(1e3 * columns, counted, [Noise(500.0, 0.6)], LOUD[:, :1]), white)
    np.testing.assert_allclose(whiten(columns, counted, [Noise(5.0, 0.6)], LOUD[:, :1]), white / 10)
    np.testing.assert_allclose(whiten(columns, counted, [Noise(0.5, 0.6)], 10 * LOUD[:, :1]), white / 10)


@pytest.mark.parametrize("fine", [1, 2, 5])
def test_joined_steps_carry_noise_as_each_of_the_steps_does(fine: int) -> None:
    """Of noise that is linear between the samples, and of which a share passes at each instant."""
    rng, (n, samples, d, r) = np.random.default_rng(fine), (3, 6, 2, 2)
    steps = fine * (samples - 1)
    A, B = rng.uniform(-0.6, 0.8, (n, steps, d, d)), rng.standard_normal((r, n, steps, 2, d))
    passed, noise = rng.uniform(0.5, 1, (r, n, steps + 1)), rng.standard_normal((r, n, samples))
    A_joined, F, G = join_steps(A, B, passed, fine)
    for run in range(n):
        x, joined = rng.standard_normal((2, d)) * [[1], [0]]
        joined[:] = x
        between = np.stack([np.interp(np.arange(steps + 1) / fine, np.arange(samples), row[run]) for row in noise])
        acting = between * passed[:, run]
        for t in range(samples - 1):
            for j in range(t * fine, (t + 1) * fine):
                x = A[run, j] @ x + sum(B[source, run, j, 0] * acting[source, j]
                                        + B[source, run, j, 1] * acting[source, j + 1] for source in range(r))
            joined = A_joined[run, t] @ joined + F[run, t] @ noise[:, run, t] + G[run, t] @ noise[:, run, t + 1]
            np.testing.assert_allclose(joined, x, atol=1e-12)
