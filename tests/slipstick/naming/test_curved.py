"""Laplace's approximation on a block of one formula, against numerical integration over the random parameter."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.naming.curved import CurvedFit, fit_curved

TIME = np.linspace(0, 1, 60)
STD, MEAN, SCATTER, CLOCK, LAW = 0.02, 0.1, 0.2, 0.004, 0.25
SPEED = ("decay rate", "speed")
WAVE = ("offset", "time")  # acts on nothing

Laws = Sequence[tuple[tuple[str, str], np.ndarray]]


@dataclass(frozen=True, eq=False)
class Decay:
    """exp(-3 rate t) with the rate (1 + beta_i) (1 + c speed_i), read by a clock that is late."""

    measured: np.ndarray
    speed: np.ndarray
    counted: np.ndarray
    std: float
    random: tuple[str, ...] = ("rate",)
    fixed: tuple[str, ...] = ("clock",)
    random_std: np.ndarray = field(default_factory=lambda: np.array([np.inf]))
    fixed_std: np.ndarray = field(default_factory=lambda: np.array([0.05]))
    widest: np.ndarray = field(default_factory=lambda: np.array([1.0]))

    def noise(self, points: np.ndarray) -> BlockNoise:
        return BlockNoise(self.std, 0.3)

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        known = dict(laws)
        rate = (1 + points[:, 0]) * (1 + known.get(SPEED, np.zeros(1))[0] * self.speed)
        return np.exp(-3 * rate[:, None] * TIME) + known.get(WAVE, np.zeros(1))[0] * 0.1 * np.sin(20 * TIME)

    def shared_columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        return -np.gradient(predicted, TIME, axis=1)[:, None]

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        own = (self.base(points + 1e-5, laws) - self.base(points - 1e-5, laws)) / 2e-5
        return own[:, None], self.shared_columns(points, laws, predicted)

    def size(self, pair: tuple[str, str]) -> int:
        return 1

    def basis(self, pair: tuple[str, str], points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        known = dict(laws)
        up, down = ({**known, pair: known[pair] + step} for step in (1e-5, -1e-5))
        return ((self.base(points, [*up.items()]) - self.base(points, [*down.items()])) / 2e-5)[:, None]


def drawn(seed: int, n: int = 40, law: float = 0.0, std: float = STD) -> tuple[Decay, np.ndarray]:
    """A block with its noise, and the rates of its engagements."""
    rng = np.random.default_rng(seed)
    own, speed = MEAN + SCATTER * rng.normal(size=(n, 1)), rng.choice([-1.0, 0.0, 1.0], n)
    block = Decay(np.zeros((n, len(TIME))), speed, rng.random((n, len(TIME))) < 0.9, std)
    clean = block.base(own, [(SPEED, np.array([law]))])
    clean = clean + CLOCK * block.shared_columns(own, (), clean)[:, 0]
    noise = rng.normal(size=clean.shape)
    for k in range(1, len(TIME)):
        noise[:, k] = 0.3 * noise[:, k - 1] + np.sqrt(1 - 0.3**2) * noise[:, k]
    return replace(block, measured=clean + std * noise), own


def integrated(block: Decay, fit: CurvedFit, i: int) -> float:
    """Log-likelihood of an engagement, integrated over its rate at the mean and variance of a fit."""
    def squares(value: float) -> float:
        points = fit.points.copy()
        points[i] = value
        predicted = block.base(points, list(fit.coefficients.items()))
        predicted = predicted + fit.shared[0] * block.shared_columns(points, (), predicted)[:, 0]
        left = (block.measured - predicted)[i:i + 1, None]
        return float((whitened(left, block.counted[i:i + 1], block.noise(points)) ** 2).sum())

    best, std, scatter = fit.points[i, 0], fit.variance[0] ** 0.5, squares(fit.points[i, 0])
    found = quad(lambda x: np.exp(-0.5 * (squares(x) - scatter)) * norm.pdf(x, fit.mean[0], std), best - 0.4, best + 0.4,
                 points=[best], epsrel=1e-4, limit=30)[0]
    return float(np.log(found) - 0.5 * scatter)


def prior(fit: CurvedFit) -> float:
    """Logarithm of the priors: of the mean (0.3 wide), the clock (0.05) and each coefficient (3)."""
    laws = sum((one**2).sum() for one in fit.coefficients.values()) / 9
    return float(-0.5 * ((fit.mean[0] / 0.3) ** 2 + (fit.shared[0] / 0.05) ** 2 + laws))


def test_the_evidence_is_the_integral_over_the_random_parameter() -> None:
    block, _ = drawn(1, n=8, std=4 * STD)
    block = replace(block, widest=np.array([0.15]))
    fit = fit_curved(block, iterations=20)
    expected = np.array([integrated(block, fit, i) for i in range(8)]) + prior(fit) / 8
    np.testing.assert_allclose(fit.evidence, expected, atol=0.03)
    # The determinant is a hundred times that.
    assert np.all(-0.5 * fit.squares - fit.evidence > 1)


def test_estimates_are_those_that_the_data_were_drawn_from() -> None:
    block, own = drawn(2, law=LAW)
    fit = fit_curved(block, [SPEED], iterations=20)
    assert np.abs(fit.points - own).std() < 0.03
    assert fit.mean[0] == pytest.approx(own.mean(), abs=0.02)
    assert fit.variance[0] ** 0.5 == pytest.approx(own.std(), rel=0.05)
    assert fit.shared[0] == pytest.approx(CLOCK, abs=5e-4)
    assert fit.coefficients[SPEED][0] == pytest.approx(LAW, abs=0.08)  # three standard errors
    assert fit.chi2.mean() == pytest.approx(1, abs=0.06)
