"""The linear mixed model of blocks in small matrices: against a dense covariance, jointly, and scores of laws."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from slipstick.clutch.model import Model
from slipstick.engine.linear_model import (
    Fitted,
    Gram,
    estimate,
    likelihood,
    marginalise,
    restricted_likelihood,
    solve,
)
from slipstick.naming.evidence import FOLDS, Table, gains, table
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.linear_model import Further, Joint, Part, columns_of, joined, part_of
from slipstick.naming.selection import in_agreement, in_errors
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

Q, P, K = 2, 2, 8
VARIANCE = np.array([0.3, 0.05])
PRECISION, TARGET = np.array([0.5, 2.0, 1.0, 4.0]), np.array([0.2, -0.3, 0.5, 1.0])


@dataclass(frozen=True, eq=False)
class Problem:
    """Whitened columns `random` (n, K, Q) and `fixed` (n, K, P), and the residual (n, K)."""

    random: np.ndarray
    fixed: np.ndarray
    residual: np.ndarray

    @property
    def both(self) -> np.ndarray:
        return np.concatenate([self.random, self.fixed], axis=2)

    def gram(self, precision: np.ndarray = PRECISION, target: np.ndarray = TARGET, widest: float = 10.0) -> Gram:
        rows = np.concatenate([self.both, self.residual[..., None]], axis=2)
        return Gram(rows.transpose(0, 2, 1) @ rows, Q, precision, target, np.full(Q, widest))

    def covariances(self, variance: np.ndarray) -> np.ndarray:
        return np.asarray(np.eye(K) + self.random * variance @ self.random.transpose(0, 2, 1))

    def dense(self, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Design, observations and covariance; a prior is an observation of each coefficient."""
        prior = np.diag(PRECISION**0.5)
        return (np.concatenate([*self.both, prior]), np.concatenate([*self.residual, prior @ TARGET]),
                block_diag(*self.covariances(variance), np.eye(Q + P)))

    def restricted(self, variance: np.ndarray) -> float:
        """Restricted log-likelihood, up to a constant."""
        design, seen, covariance = self.dense(variance)
        inverse = np.linalg.inv(covariance)
        information = design.T @ inverse @ design
        left = seen - design @ np.linalg.solve(information, design.T @ inverse @ seen)
        logdet = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
        return float(-0.5 * (left @ inverse @ left + logdet))


def problem(seed: int, n: int = 12, variance: np.ndarray = VARIANCE) -> Problem:
    rng = np.random.default_rng(seed)
    random, fixed = rng.normal(size=(n, K, Q)), rng.normal(size=(n, K, P)) * [1.0, 0.1]
    own = [1.0, -0.5] + np.sqrt(variance) * rng.normal(size=(n, Q))
    mean = np.einsum("nkq,nq->nk", random, own) + fixed @ [0.5, 2.0]
    return Problem(random, fixed, mean + rng.normal(size=(n, K)))


@pytest.mark.parametrize("variance", [VARIANCE, np.array([0.4, 0.0])])
def test_estimates_at_given_variances_are_those_of_the_dense_regression(variance: np.ndarray) -> None:
    some = problem(1)
    found = estimate(some.gram(), variance, fixed=True)
    design, seen, covariance = some.dense(variance)
    inverse = np.linalg.inv(covariance)
    known = np.linalg.inv(design.T @ inverse @ design)
    np.testing.assert_allclose(found.coefficients, known @ design.T @ inverse @ seen, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, known, rtol=1e-9)
    np.testing.assert_allclose(found.variance, variance)
    left = some.residual - some.both @ found.coefficients
    best = [variance * (random.T @ np.linalg.solve(its, one))
            for random, its, one in zip(some.random, some.covariances(variance), left, strict=True)]
    np.testing.assert_allclose(found.each, best, rtol=1e-9, atol=1e-12)
    after = left - np.einsum("nkq,nq->nk", some.random, best)
    np.testing.assert_allclose(found.squares, (after**2).sum(axis=1), rtol=1e-9)
    posterior = np.linalg.inv(np.diag(1 / VARIANCE) + some.random[0].T @ some.random[0])
    np.testing.assert_allclose(marginalise(some.gram(), VARIANCE)[2][0], posterior, rtol=1e-9)


def test_a_run_at_the_edge_of_a_jump_tells_its_own_parameter_and_leaves_the_digits_of_the_others() -> None:
    some = problem(1)
    some.random[0, 3, 0] = 1e9  # a difference across the jump, over a small step
    marginal = marginalise(some.gram(), VARIANCE)[0][0]
    assert marginal[0, 0] == pytest.approx(1 / VARIANCE[0], rel=1e-6)
    random, both = (np.delete(columns[0], 3, axis=0)[:, 1:] for columns in (some.random, some.both))
    covariance = np.eye(K - 1) + VARIANCE[1] * random @ random.T  # the first one is known, and does not scatter
    np.testing.assert_allclose(marginal[1:-1, 1:-1], both.T @ np.linalg.inv(covariance) @ both, rtol=1e-6)


def test_the_likelihood_is_the_marginal_normal_density() -> None:
    some, elsewhere = problem(2), np.array([0.8, -0.2, 1.0, 0.0])
    marginal, logdet, _ = marginalise(some.gram(), VARIANCE)
    expected = [multivariate_normal.logpdf(one, both @ elsewhere, its) + 0.5 * K * np.log(2 * np.pi)
                for one, both, its in zip(some.residual, some.both, some.covariances(VARIANCE), strict=True)]
    np.testing.assert_allclose(likelihood(marginal, logdet, elsewhere), expected, rtol=1e-9)
    found = estimate(some.gram(), VARIANCE, fixed=True)
    np.testing.assert_allclose(found.likelihood, likelihood(marginal, logdet, found.coefficients), rtol=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_variances_maximise_the_dense_restricted_likelihood(seed: int) -> None:
    some = problem(seed)
    best = minimize(lambda logs: -some.restricted(np.exp(logs)), np.log(VARIANCE), method="L-BFGS-B",
                    bounds=[(-12, 3)] * Q)
    assert some.restricted(np.full(Q, 0.01)) < -best.fun - 1
    for begin in (0.0, 0.01, 5.0):
        found = estimate(some.gram(), np.full(Q, begin))
        assert some.restricted(found.variance) > -best.fun - 1e-3
        np.testing.assert_allclose(found.variance, np.exp(best.x), rtol=0.01, atol=2e-3)


def test_a_step_never_lowers_the_restricted_likelihood(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.engine.linear_model._STEPS", 1)
    for seed, begin in enumerate((0.0, 1e-4, 3.0, 50.0)):
        some, variance = problem(seed), np.full(Q, begin)
        values = [some.restricted(variance)]
        for _ in range(15):
            variance = estimate(some.gram(widest=100.0), variance).variance
            values.append(some.restricted(variance))
        assert np.all(np.diff(values) > -1e-9)
        assert values[-1] > values[0] + 0.5


def test_equal_columns_share_a_variance_and_an_empty_one_keeps_its_own() -> None:
    some, once = problem(4), estimate(problem(4).gram(), VARIANCE)
    twice = replace(some, random=some.random[:, :, [0, 0]])
    assert estimate(twice.gram(), VARIANCE).variance.sum() == pytest.approx(
        estimate(replace(some, random=some.random * [1.0, 0.0]).gram(), VARIANCE).variance[0], rel=0.02)
    empty = estimate(replace(some, random=some.random * [1.0, 0.0]).gram(), VARIANCE)
    assert empty.variance[1] == VARIANCE[1]
    assert empty.variance[0] != once.variance[0]


@pytest.mark.parametrize(("seed", "unlike"), [(12, 0.01), (30, 0.03), (0, 0.01)])
def test_steps_do_not_end_where_nearly_equal_columns_would_leave_their_bounds(seed: int, unlike: float) -> None:
    rng = np.random.default_rng(seed)
    column = 30 * rng.standard_normal((12, K))
    random = np.stack([column, column * (1 + unlike * rng.standard_normal((12, 1)))], axis=2)
    residual = 0.1 * rng.standard_normal((12, 1)) * column + rng.standard_normal((12, K))
    gram = Problem(random, np.empty((12, K, 0)), residual).gram(np.ones(Q), np.zeros(Q), widest=1.0)
    best = minimize(lambda roots: -restricted_likelihood(gram, np.minimum(roots**2, 1.0)), np.full(Q, 0.1),
                    method="Powell", options={"xtol": 1e-6, "ftol": 1e-10})
    for begin in ([1e-4, 1e-4], [1.0, 1.0], [1e-6, 1.0], [0.3, 0.1], [1e-3, 1.0]):
        found = estimate(gram, np.array(begin)).variance
        assert restricted_likelihood(gram, found) > -best.fun - 1e-2
        assert np.all((found >= 0) & (found <= 1))


def test_variances_stay_where_equations_diverge() -> None:
    gram, begin = problem(1).gram(), np.full(Q, 0.1)
    products = gram.products.copy()
    products[3, :, -1] = np.nan
    np.testing.assert_array_equal(estimate(replace(gram, products=products), begin).variance, begin)


def test_no_variance_is_found_where_there_is_none_and_it_is_where_there_is() -> None:
    some = [problem(seed, 40, np.array([0.3, 0.0])).gram() for seed in range(30)]
    found = np.array([estimate(one, np.full(Q, 0.1)).variance for one in some])
    assert np.median(found[:, 0]) == pytest.approx(0.3, rel=0.15)
    # Half of the estimates of a variance of zero are at zero, which is approached in steps.
    assert 0.3 < np.mean(found[:, 1] < 1e-3) < 0.8
    assert np.all(found[:, 1] < 0.15)


def test_a_prior_is_an_observation_and_a_variance_has_a_bound() -> None:
    some = problem(3)
    def fixed(precision: float, target: float) -> Fitted:
        gram = some.gram(np.array([0, 0, 0, precision]), np.array([0, 0, 0, target]))
        return estimate(gram, VARIANCE, fixed=True)
    free, tied = fixed(0.0, 7.0), fixed(1e9, 7.0)
    assert free.coefficients[3] == pytest.approx(fixed(0.0, 0.0).coefficients[3])
    assert tied.coefficients[3] == pytest.approx(7)
    weight = 1 / free.covariance[3, 3]
    assert fixed(weight, 7.0).coefficients[3] == pytest.approx(0.5 * (free.coefficients[3] + 7))
    assert estimate(some.gram(widest=0.1), VARIANCE).variance[0] == pytest.approx(0.01)


def test_engagements_that_are_left_out_do_not_count() -> None:
    some = problem(4)
    gram, kept = some.gram(), np.arange(12) % 3 > 0
    few = replace(gram, products=gram.products[kept])
    expected = estimate(few, VARIANCE, fixed=True)
    marginal = marginalise(gram, VARIANCE)[0]
    found, covariance, *_ = solve(gram, marginal[kept].sum(axis=0))
    assert len(few) == 8
    np.testing.assert_allclose(found, expected.coefficients, rtol=1e-12)
    np.testing.assert_allclose(covariance, expected.covariance, rtol=1e-12)
    assert np.abs(found - solve(gram, marginal.sum(axis=0)).coefficients).max() > 1e-3


def test_units_that_differ_by_many_orders_do_not_lose_the_solution() -> None:
    some, unit = problem(5), np.array([1.0, 1.0, 1e-9, 1e9])
    plain, scaled = some.gram(np.zeros(4)), replace(some, fixed=some.fixed * unit[Q:]).gram(np.zeros(4))
    found = estimate(scaled, VARIANCE, fixed=True)
    np.testing.assert_allclose(found.coefficients * unit, estimate(plain, VARIANCE, fixed=True).coefficients, rtol=1e-9)


# The joint linear model of blocks: with a further pair it is the one in which the pair is a law from the start.


COUNT, SEED = 12, 3
SHARED, ALONE = ("output torque sensor", "gain"), ("load torque", "time")


@pytest.fixture(scope="module")
def fits() -> list[BlockFit]:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    return [fit(block_of("load", scene), (ALONE,)), fit(block_of("input", scene))]


def whole(fits: list[BlockFit], laws: list[tuple[str, str]]) -> Joint:
    parts = [part_of(its.block, columns_of(its.block, its.points, its.shared, its.held, its.predicted,
                                           [law for law in laws if law in its.block.pairs()]), its.noise)
             for its in fits]
    return joined(parts, laws)


def beside(tables: list[Table], pair: tuple[str, str]) -> Joint:
    return joined([one.part for one in tables], [ALONE]).beside(pair, [one.further[pair] for one in tables])


def same(one: Joint, other: Joint) -> None:
    np.testing.assert_allclose(one.gram.products, other.gram.products, rtol=1e-9, atol=1e-6)
    np.testing.assert_array_equal(one.gram.precision, other.gram.precision)
    assert {pair: its.tolist() for pair, its in one.places.items()} \
        == {pair: its.tolist() for pair, its in other.places.items()}


def test_a_further_pair_of_two_blocks_has_the_products_of_a_law(fits: list[BlockFit]) -> None:
    tables = [table(its, [SHARED]) for its in fits]
    assert set(tables[0].further) == {SHARED}
    same(beside(tables, SHARED), whole(fits, [ALONE, SHARED]))


def test_a_table_takes_more_pairs_and_keeps_those_that_it_has(fits: list[BlockFit]) -> None:
    its = fits[0]
    pairs = [pair for pair in its.block.pairs() if pair != ALONE]
    at_once, before = table(its, pairs), table(its, pairs[:3])
    later = table(its, pairs, before)
    assert set(later.further) == set(at_once.further)
    for pair, known in before.further.items():
        assert later.further[pair] is known
    for pair, products in at_once.further.items():
        np.testing.assert_allclose(later.further[pair].onto, products.onto, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(later.further[pair].among, products.among, rtol=1e-9, atol=1e-6)


def test_the_joint_model_of_one_part_is_that_part_in_any_order_of_its_laws(fits: list[BlockFit]) -> None:
    its, laws = fits[0], [ALONE, SHARED]
    part = part_of(its.block, its.columns(laws), its.noise)
    one, swapped = joined([part], laws), joined([part], laws[::-1])
    assert one.gram is part.gram
    assert one.places.keys() == swapped.places.keys()
    first = np.arange(len(one.gram.precision) - sum(len(at) for at in one.places.values()))
    order = np.concatenate([first, *(swapped.places[law] for law in laws), [len(one.gram.precision)]])
    np.testing.assert_array_equal(swapped.gram.products[:, order[:, None], order], one.gram.products)
    np.testing.assert_array_equal(swapped.gram.precision[order[:-1]], one.gram.precision)
    for law in laws:
        np.testing.assert_array_equal(one.rows[0][one.places[law]], one.places[law])


# Scores of engagements in the direction of a law that the others give, against dense matrices.


PAIR = ("quantity", "signal")
N, SAMPLES = 36, 60


def drawn_table(size: np.ndarray, seed: int) -> tuple[Table, np.ndarray, np.ndarray, np.ndarray]:
    """A block with one random parameter and a law of two columns, whose size differs between engagements.

    Returns it and its whitened columns: random (n, k, 1), of the law (n, k, 2), and the residual (n, k).
    """
    random = np.random.default_rng(seed)
    own, law = random.standard_normal((N, SAMPLES, 1)), random.standard_normal((N, SAMPLES, 2))
    left = own[:, :, 0] * (0.5 * random.standard_normal(N))[:, None] + random.standard_normal((N, SAMPLES))
    left = left + size[:, None] * (law @ [0.6, -0.8]) / np.sqrt(SAMPLES)
    columns = np.concatenate([own, left[:, :, None]], axis=2)
    gram = Gram(columns.transpose(0, 2, 1) @ columns, 1, np.zeros(1), np.zeros(1), np.array([2.0]))
    further = Further(law.transpose(0, 2, 1) @ columns, law.transpose(0, 2, 1) @ law)
    fit: Any = SimpleNamespace(block=SimpleNamespace(name="any"), fitted=SimpleNamespace(variance=np.array([0.2])))
    return Table(fit, Part(gram, 0, {}), {PAIR: further}), own, law, left


def test_a_score_is_that_of_the_others_direction_under_the_marginal_covariance() -> None:
    its, own, law, left = drawn_table(np.full(N, 2.0), 1)
    found = gains([its], [], [PAIR])[0]
    for i in (0, 7, 20):
        inverse = np.linalg.inv(np.eye(SAMPLES) + found.fitted.variance[0] * own[i] @ own[i].T)
        residual = left[i] - own[i, :, 0] * found.without[i, 0]
        step = law[i] @ found.held[i, 1:] + own[i, :, 0] * (found.held[i, 0] - found.without[i, 0])
        size = np.sqrt(step @ inverse @ step)
        assert found.scores[i] == pytest.approx(step @ inverse @ residual / max(size, 1.0), rel=1e-9)
    folds = np.random.default_rng(0).permutation(np.arange(N) % FOLDS)
    assert len(np.unique(found.held, axis=0)) == FOLDS
    for fold in range(FOLDS):
        assert len(np.unique(found.held[folds == fold], axis=0)) == 1


def test_engagements_agree_where_a_law_has_many_sizes_and_where_its_gain_does_not_show_it() -> None:
    size = np.where(np.arange(N) % 3 == 0, 40.0, 4.0)
    found = gains([drawn_table(size, 2)[0]], [], [PAIR])[0]
    assert found.nats.sum() > 100
    assert in_errors(found.nats) < 0 < 4 < in_agreement(found.scores)


def test_without_a_law_scores_are_noise() -> None:
    scores = np.concatenate([gains([drawn_table(np.zeros(N), seed)[0]], [], [PAIR])[0].scores for seed in range(40)])
    assert abs(scores.mean()) < 4 * scores.std() / np.sqrt(len(scores))
    assert scores.std() < 1.1
