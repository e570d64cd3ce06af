"""Laplace's approximation on a block of one formula, against numerical integration over the random parameter."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import lsq_linear, minimize_scalar
from scipy.stats import norm

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.engine.linear_model import Gram
from slipstick.naming.curved import CurvedFit, _linearised, _spread, fit_curved
from slipstick.naming.curved_steps import (
    HIGHEST,
    LOWEST,
    Values,
    _follow_by_chords,
    _own_terms,
    _try_dampings,
    stepped,
    within_bounds,
)

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
    bounds: np.ndarray = field(default_factory=lambda: np.array([[-np.inf], [np.inf]]))
    widest: np.ndarray = field(default_factory=lambda: np.array([1.0]))
    follows_chords: bool = False
    shared: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def at(self, shared: np.ndarray) -> "Decay":
        return replace(self, shared=shared)

    def noise(self, points: np.ndarray) -> BlockNoise:
        return BlockNoise(self.std, 0.3)

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        known = dict(laws)
        rate = (1 + points[:, 0]) * (1 + known.get(SPEED, np.zeros(1))[0] * self.speed)
        early = np.exp(-3 * rate[:, None] * TIME) + known.get(WAVE, np.zeros(1))[0] * 0.1 * np.sin(20 * TIME)
        return early + self.shared @ self.shared_columns(points, laws, early)

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
        predicted = fit.block.base(points, fit.held)
        left = (block.measured - predicted)[i:i + 1, None]
        return float((whitened(left, block.counted[i:i + 1], block.noise(points)) ** 2).sum())

    best, std, scatter = fit.points[i, 0], fit.variance[0] ** 0.5, squares(fit.points[i, 0])
    found = quad(lambda x: np.exp(-0.5 * (squares(x) - scatter)) * norm.pdf(x, fit.mean[0], std), best - 0.6,
                 best + 0.6, points=[best], epsrel=1e-4, limit=30)[0]
    return float(np.log(found) - 0.5 * scatter)


def prior(fit: CurvedFit) -> float:
    """Logarithm of the priors: of the mean (0.3 wide), the clock (0.05) and each coefficient (3)."""
    laws = sum((one**2).sum() for one in fit.coefficients.values()) / 9
    return float(-0.5 * ((fit.mean[0] / 0.3) ** 2 + (fit.shared[0] / 0.05) ** 2 + laws))


def test_the_evidence_is_the_integral_over_the_random_parameter() -> None:
    block, _ = drawn(1, n=8, std=4 * STD)
    fit = fit_curved(block, iterations=20)
    expected = np.array([integrated(block, fit, i) for i in range(8)]) + prior(fit) / 8
    np.testing.assert_allclose(fit.evidence, expected, atol=0.06)
    # That is a few percent of what the scatter and the determinant are worth.
    assert np.all(-0.5 * fit.squares - expected > 0.9)


def test_estimates_are_those_that_the_data_were_drawn_from() -> None:
    block, own = drawn(2, law=LAW)
    fit = fit_curved(block, [SPEED], iterations=20)
    assert np.abs(fit.points - own).std() < 0.03
    assert fit.mean[0] == pytest.approx(own.mean(), abs=0.02)
    assert fit.variance[0] ** 0.5 == pytest.approx(own.std(), rel=0.05)
    assert fit.shared[0] == pytest.approx(CLOCK, abs=5e-4)
    assert fit.coefficients[SPEED][0] == pytest.approx(LAW, abs=0.08)  # three standard errors
    assert fit.chi2.mean() == pytest.approx(1, abs=0.06)


def slowed(plain: CurvedFit, speed: np.ndarray, law: float) -> np.ndarray:
    """Points that predict with a law what those of a fit without it do."""
    return np.asarray((1 + plain.points) / (1 + law * speed[:, None]) - 1)


@pytest.mark.parametrize("law", [0.0, 0.15])
def test_a_further_law_does_not_lower_the_evidence_and_is_as_good_as_from_the_truth(law: float) -> None:
    for seed in range(2):
        block, _ = drawn(seed, law=law)
        plain = fit_curved(block)
        useless = fit_curved(block, [WAVE], start=plain)
        assert -0.3 < useless.evidence.sum() - plain.evidence.sum() < 5  # half of chi-square of one
        both = fit_curved(block, [WAVE, SPEED], start=useless)
        gain = both.evidence.sum() - useless.evidence.sum()
        assert gain > 4 if law else -0.3 < gain < 5
        truth = {SPEED: np.array([law]), **useless.coefficients}
        again = fit_curved(block, [WAVE, SPEED], points=slowed(plain, block.speed, law), coefficients=truth)
        assert both.evidence.sum() == pytest.approx(again.evidence.sum(), abs=0.3)


def test_a_strong_law_is_found_from_starts_of_it_and_from_the_fit_without_it() -> None:
    block, _ = drawn(3, law=0.7)
    plain = fit_curved(block)
    starts = [fit_curved(block, [SPEED], points=slowed(plain, block.speed, value),
                         coefficients={SPEED: np.array([value])}) for value in (0.15, 0.6)]
    best = max(starts, key=lambda one: one.evidence.sum())
    assert best.coefficients[SPEED][0] == pytest.approx(0.7, abs=0.1)
    for found in (best, fit_curved(block, [SPEED], start=plain)):
        assert found.evidence.sum() > plain.evidence.sum() + 30


def test_an_engagement_that_is_stuck_has_a_low_evidence() -> None:
    block, _ = drawn(4)
    empty = block.counted.copy()
    empty[0] = False  # it says nothing, and belongs at the mean
    block = replace(block, counted=empty)
    fit = fit_curved(block)
    assert fit.points[0, 0] == pytest.approx(fit.mean[0], abs=1e-3)
    assert fit.evidence[0] == pytest.approx(prior(fit) / 40, abs=1e-3)
    for i in (0, 7):
        points = fit.points.copy()
        points[i] += 0.8
        stuck = fit_curved(block, start=replace(fit, points=points), iterations=0)
        assert stuck.evidence[i] < fit.evidence[i] - 3
        np.testing.assert_array_less(np.abs(np.delete(stuck.evidence - fit.evidence, i)), 1.5)
        freed = fit_curved(block, start=replace(fit, points=points))
        assert freed.evidence.sum() == pytest.approx(fit.evidence.sum(), abs=0.3)


def test_a_step_never_raises_the_cost_and_is_damped_where_a_whole_one_would() -> None:
    block, _ = drawn(5, law=0.7)
    variance, noise, rng = np.array([0.04]), block.noise(np.zeros((40, 1))), np.random.default_rng(5)

    def cost(some: Values, gram: Gram) -> float:
        left = (block.measured - block.at(some.shared).base(some.points, some.laws))[:, None]
        squares = (whitened(left, block.counted, noise) ** 2).sum() + ((some.points - some.mean) ** 2 / variance).sum()
        return float(squares + (some.common**2 * gram.precision).sum())

    for _ in range(10):
        values = Values(rng.uniform(-0.5, 0.5, (40, 1)), rng.uniform(-0.5, 0.5, 1), np.zeros(1),
                        {SPEED: rng.uniform(-2, 2, 1)})
        _, own, gram = _linearised(block, values, noise)
        before = cost(values, gram)
        _, after, damping = stepped(block, values, gram, own, variance, noise, before, 1e-3)
        assert cost(after, gram) < before
        assert damping < 1e-3
    fit = fit_curved(block, [SPEED], iterations=20)
    values = Values(fit.points, fit.mean, fit.shared, fit.coefficients)
    _, own, gram = _linearised(fit.block, values, noise)
    far = replace(gram, products=gram.products * np.where(np.arange(len(gram.products[0])) == 3, 5.0, 1.0))
    _, after, damping = stepped(fit.block, values, far, own, variance, noise, cost(values, gram), 1e-3)
    assert cost(after, gram) <= cost(values, gram)
    assert damping > 1e-3


def test_chords_follow_the_curve_of_what_engagements_share_to_its_most_probable_points() -> None:
    """The law moves by 0.3, which the rates make good by up to 40 %: a step with the slopes of before falls short."""
    block, own = drawn(5, std=0.1 * STD)
    variance, noise = np.array([SCATTER**2]), block.noise(own)
    values = Values(own, np.full(1, MEAN), np.zeros(1), {SPEED: np.zeros(1)})
    _, slopes, gram = _linearised(block, values, noise)
    common = np.append(values.common[:2], 0.3)
    slope, curvature = _own_terms(values, gram, variance, common)
    moved = replace(values, coefficients={SPEED: common[2:]})
    tried, short = _try_dampings(block, moved, slope, curvature, variance, noise)
    _, followed = _follow_by_chords(block, tried, curvature, slopes, variance, noise)

    def terms(rate: float, engagement: int) -> float:
        points = np.where(np.arange(40) == engagement, rate, tried.points[:, 0])[:, None]
        left = whitened((block.measured - block.base(points, tried.laws))[:, None], block.counted, noise)[engagement]
        return float((left**2).sum() + (rate - MEAN) ** 2 / variance[0])

    least = np.array([minimize_scalar(terms, args=(one,), bounds=(-0.6, 1.0), method="bounded",
                                      options={"xatol": 1e-9}).fun for one in range(40)])
    assert (short - least).sum() > 1000
    assert (followed - least).sum() < 1


def test_the_spread_is_that_of_the_most_likely_normal_distribution() -> None:
    rng, information = np.random.default_rng(6), np.full((500, 1, 1), 100.0)
    measured = 0.2 + rng.normal(size=500) * np.sqrt(0.15**2 + 1 / 100)
    variance = np.array([0.05**2])
    for _ in range(30):  # points are the most probable ones, at the mean and the variance before
        weight = variance / (variance + 1 / 100)
        mean, variance = _spread((measured.mean() + weight * (measured - measured.mean()))[:, None], information,
                                 np.zeros(1), np.ones(1), variance)
    assert mean[0] == pytest.approx(measured.mean())
    assert variance[0] == pytest.approx(measured.var() - 1 / 100, rel=0.03)
    assert _spread(np.zeros((9, 1)), np.full((9, 1, 1), 1e12), np.zeros(1), np.ones(1), variance)[1][0] == 1e-8
    assert _spread(np.array([[-3.0], [3.0]]), information[:2], np.zeros(1), np.full(1, 0.5), variance)[1][0] == 0.25
    assert abs(_spread(np.ones((9, 1)), information[:9], np.full(1, 1e9), np.ones(1), variance)[0][0]) < 1e-3


def test_a_fit_begins_where_it_is_told_to() -> None:
    block, own = drawn(7, law=LAW)
    known = {SPEED: np.array([LAW])}
    begun = fit_curved(block, [SPEED], points=own, coefficients=known, iterations=0)
    np.testing.assert_array_equal(begun.points, own)
    assert begun.coefficients == known
    again = fit_curved(block, [SPEED, WAVE], start=begun, iterations=0)
    np.testing.assert_array_equal(again.points, own)
    assert again.coefficients[SPEED] == LAW
    assert again.coefficients[WAVE] == 0
    assert not fit_curved(block, iterations=0).points.any()


def test_a_step_ends_at_the_least_squares_within_the_bounds() -> None:
    rng, ended = np.random.default_rng(8), 0
    for _ in range(30):
        jacobian = rng.normal(size=(6, 3)) @ np.array([[1.0, 0.95, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 1.0]])  # a valley
        points, residual = np.array([[LOWEST + 0.01, 0.0, 0.0]]), rng.normal(size=6) * 0.03
        change = within_bounds(points, (jacobian.T @ jacobian)[None], (jacobian.T @ residual)[None])[0]
        best = lsq_linear(jacobian, residual, (LOWEST - points[0], HIGHEST - points[0])).x
        size = np.abs(best).max()
        np.testing.assert_allclose(change, best * min(1, 0.25 / size), atol=1e-4)
        ended += abs(best[0] + 0.01) < 1e-6
    assert 5 < ended < 25  # at the bound, and not


def test_a_shared_value_stops_at_its_bound_and_the_fit_converges_there() -> None:
    block, _ = drawn(2, law=LAW)
    free, bound = fit_curved(block, [SPEED], iterations=20), np.array([[-np.inf], [CLOCK / 2]])
    held = fit_curved(replace(block, bounds=bound), [SPEED], iterations=20)
    assert free.shared[0] > 0.8 * CLOCK
    assert held.shared[0] == CLOCK / 2
    assert held.converged
    assert held.evidence.sum() < free.evidence.sum() - 1
