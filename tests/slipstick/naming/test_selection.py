"""What counts as enough, as a tie, and as an answer: pure functions of gains."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from slipstick.naming.answer import answer
from slipstick.naming.measured import LawPoints
from slipstick.naming.selection import (
    Finding,
    Rival,
    explains,
    in_agreement,
    in_errors,
    in_proportion,
    is_enough,
    is_further,
    is_shown,
    is_unexplained,
    priced,
    rivals,
)
from slipstick.naming.set_aside import outlying
from slipstick.naming.settings import NamingSettings

SETTINGS = NamingSettings()


def gain(mean: float, scatter: float = 1.0, n: int = 54) -> np.ndarray:
    """Gains with this mean and this scatter, exactly."""
    values = np.random.default_rng(1).standard_normal(n)
    values = (values - values.mean()) / values.std(ddof=1)
    return np.asarray(mean + scatter * values)


@pytest.mark.parametrize(("mean", "scatter", "enough"), [
    (1.0, 1.0, True),
    (0.2, 0.1, False),  # 10.8 nats
    (1.0, 4.0, False),  # 54 nats, 2.2 standard errors
    (0.23, 0.01, True),  # 12.4 nats in every engagement alike
    (-1.0, 0.1, False),
])
def test_enough_are_nats_and_standard_errors(mean: float, scatter: float, enough: bool) -> None:
    assert is_enough(gain(mean, scatter), SETTINGS) == enough


def test_one_odd_engagement_is_not_enough() -> None:
    odd = np.zeros(54)
    odd[7] = 500.0
    assert not is_enough(odd, SETTINGS)
    assert in_errors(odd) == pytest.approx(1.0)


def test_a_strong_law_is_not_harder_to_name_than_a_weak_one() -> None:
    shown = np.random.default_rng(3).lognormal(0.0, 1.0, 54)  # of a law, by the engagements, in standard errors
    noise = np.random.default_rng(4).standard_normal(54)
    errors = [in_errors(strength * shown * noise + 0.5 * (strength * shown) ** 2) for strength in (0.5, 2.0, 8.0, 80.0)]
    assert np.all(np.diff(errors) > 0)
    assert errors[-1] > SETTINGS.errors


def test_engagements_on_which_a_law_does_not_act_say_nothing_about_it() -> None:
    acting = np.arange(54) < 9
    gain, expected = np.where(acting, 8.0, -0.4), np.where(acting, 4.0, 0.1)  # it costs the others some scatter
    assert in_errors(gain) < SETTINGS.errors < in_proportion(gain, expected)
    assert is_shown(gain, expected, 0.0, SETTINGS)
    # If all of them should show it, it is not there; nor do two odd ones show what would act on nothing else.
    assert in_proportion(gain, np.full(54, 4.0)) < SETTINGS.errors
    odd = np.arange(54) < 2
    assert in_proportion(np.where(odd, 300.0, -0.4), np.where(odd, 30.0, 0.1)) < SETTINGS.errors
    assert in_proportion(np.where(odd, 300.0, 0.0), np.where(np.arange(54) < 1, 30.0, 0.0)) == 0


def test_scores_that_agree_show_a_law_if_its_gains_are_no_noise() -> None:
    shown = 3.0 * np.ones(54)
    for against, errors in ((9, 5.5), (16, 3.1), (22, 1.4)):  # engagements in which the form of the law loses
        gain = np.where(np.arange(54) < against, -8.0, 8.0)
        assert in_proportion(gain, shown) == pytest.approx(errors, abs=0.2)
        assert is_shown(gain, shown, 0.0, SETTINGS) == (errors > SETTINGS.errors)
        assert is_shown(gain, shown, 5.0, SETTINGS) == (errors > SETTINGS.apart)
    assert not is_shown(np.full(54, 0.1), shown, 50.0, SETTINGS)  # 5 nats


def test_noise_is_not_in_proportion_to_anything() -> None:
    """A twentieth of the deviates exceeds 1.64, where a law acts on all engagements or on few."""
    rng = np.random.default_rng(7)
    for expected in (np.full(54, 2.0), np.geomspace(0.02, 6.0, 54)):
        roots = rng.standard_normal((2000, 54))
        found = np.array([in_proportion(np.sign(one) * one**2 / 2, expected) for one in roots])
        assert np.mean(found > 1.64) == pytest.approx(0.05, abs=0.02)
        assert np.mean(found > 3.0) < 0.005


def test_the_deviate_is_that_of_the_probability_of_students_t() -> None:
    gain = np.random.default_rng(8).normal(0.3, 1.0, 30)
    roots = np.clip(np.sign(gain) * np.sqrt(2 * np.abs(gain)), -3, 3)
    # All alike, HC3 is the standard error of the mean times n / (n - 1); small residuals count as 0.3.
    t = roots.mean() / (roots.std() / np.sqrt(30)) * (29 / 30)
    assert in_proportion(gain, np.ones(30)) == pytest.approx(norm.isf(student.sf(t, 29)), rel=5e-3)


def test_a_law_that_few_engagements_show_must_explain_what_its_blocks_lack() -> None:
    few, quiet = np.where(np.arange(54) < 8, 4.0, 1.0), np.ones(54)
    shown = 300 * (few - quiet) - 2.0  # in the others the law is a burden
    assert not is_enough(shown, SETTINGS)
    assert explains(shown, few[None], quiet[None], SETTINGS)
    assert not explains(shown, few[None], 0.5 * (few + quiet)[None], SETTINGS)  # explains half of it
    assert explains(shown, np.array([few, quiet]), np.array([quiet, quiet]), SETTINGS)  # nothing to explain in a second
    assert not explains(shown, np.array([few, few]), np.array([quiet, few]), SETTINGS)
    assert not explains(-shown, few[None], quiet[None], SETTINGS)
    odd = np.where(np.arange(54) < 2, 400.0, 1.0)  # one or two explain nothing
    assert not explains(300 * (odd - 1), odd[None], quiet[None], SETTINGS)


def test_scores_agree_where_the_size_of_a_law_differs_between_engagements() -> None:
    """The gain of a law of the mean size is negative where the size is less than half of that."""
    size = np.where(np.arange(54) % 3 == 0, 6.0, 0.5)  # in standard errors
    gain, mean = size * size.mean() - 0.5 * size.mean() ** 2, size.mean()
    assert mean > 0
    assert in_errors(gain) < SETTINGS.errors < in_agreement(size)
    assert in_agreement(np.random.default_rng(2).standard_normal(54)) < SETTINGS.errors


def test_a_finding_is_a_further_one_beside_a_larger_one_in_its_part_of_the_bench() -> None:
    first, second = Finding(("contact",), ("a", "x"), gain(3.0)), Finding(("clutch",), ("b", "x"), gain(1.0))
    other = Finding(("load", "input"), ("c", "x"), gain(5.0))
    every = first, second, other
    assert [is_further(one, every) for one in every] == [False, True, False]


def test_a_tie_trails_by_little_in_nats_or_in_errors() -> None:
    best, steady = gain(3.0), gain(3.0, 0.01)
    others = [(best - 0.1, ("a", "x")), (best - 1.0, ("b", "x")), (best - gain(0.5, 2.0), ("c", "x")),
              (np.zeros(54), ("d", "x"))]
    assert [one.pair for one in rivals(best, others, SETTINGS)] == [("a", "x"), ("c", "x")]
    assert not rivals(steady, [(steady - 1.0, ("a", "x"))], SETTINGS)


def test_the_price_is_that_of_bic_and_paid_by_those_that_determine_the_law() -> None:
    leverage = np.where(np.arange(54) < 8, 0.5, 0.0)
    paid = gain(1.0) - priced(gain(1.0), leverage)
    assert paid.sum() == pytest.approx(2 * np.log(54))
    assert not paid[8:].any()


@pytest.mark.parametrize(("pair", "kind", "effect"), [
    (("friction coefficient", "heat"), "effect", "thermal_fade"),
    (("piston rate", "pressure"), "effect", "entrained_air"),
    (("load torque", "time"), "unlisted", ""), (("load torque", "output speed"), "tie", "falling_load_friction"),
])
def test_a_finding_has_the_name_of_the_catalogue(pair: tuple[str, str], kind: str, effect: str) -> None:
    found = answer(Finding(("load",), pair, gain(1.0)))
    assert (found.kind, found.effect) == (kind, effect)


def test_a_tie_names_what_is_tied_and_a_pair_without_a_name_by_the_pair() -> None:
    tied = (Rival(("friction coefficient", "slip"), 50.0, 1.0),
            Rival(("friction coefficient", "motor speed"), 40.0, 2.0))
    found = answer(Finding(("contact",), ("friction coefficient", "heat"), gain(1.0), tied))
    assert (found.kind, found.others) == ("tie", ("stribeck_friction", "friction coefficient ~ motor speed"))


@pytest.mark.parametrize(("change", "effect"), [
    (lambda x: x**2, "quadratic_load_drag"), (lambda x: 10 * np.exp(-x / 5), "falling_load_friction"),
    (lambda x: 10 * np.sin(x / 4), ""),
])
def test_a_measured_law_must_have_the_shape_of_an_effect(change: Callable[[np.ndarray], np.ndarray],
                                                         effect: str) -> None:
    x = np.linspace(0, 50, 9)
    pair = ("load torque", "output speed")
    law = LawPoints(pair, x, "rad/s", change(x), "N m", False, np.eye(9))
    found = answer(Finding(("load",), pair, gain(1.0)), law)
    assert (found.kind, found.effect) == ("effect" if effect else "unlisted", effect)


def test_few_far_engagements_are_outlying_and_a_wide_spread_is_not() -> None:
    rng = np.random.default_rng(2)
    chi_square = 1 + 0.06 * rng.standard_normal(54)
    chi_square[[3, 9]] = 40.0, 7.0
    assert outlying([np.ones(54), chi_square], SETTINGS).tolist() == [3, 9]  # the worst first
    assert not len(outlying([np.geomspace(1, 100, 54)], SETTINGS))


def test_a_block_is_unexplained_if_its_chi_square_is_beyond_spread_and_noise() -> None:
    spread = np.exp(0.1 * np.random.default_rng(5).standard_normal(54))
    assert not is_unexplained(spread, spread, SETTINGS)
    assert not is_unexplained(1.15 * spread, 1.15 * spread, SETTINGS)  # as from a wrong estimate of the noise
    assert is_unexplained(1.5 * spread, 1.5 * spread, SETTINGS)
    assert not is_unexplained(1.5 * spread, 50 * spread, SETTINGS)  # what few knots leave
    single = spread.copy()
    single[0] = 100.0
    assert not is_unexplained(single, single, SETTINGS)


def test_the_lead_is_that_over_the_next_best_explanation() -> None:
    gain = np.full(30, 8.0)
    alone = Finding(("load",), ("load torque", "output speed"), gain)
    assert alone.lead == alone.errors  # no law at all is the next best one
    near, far = (replace(alone, next_best=Rival(("load torque", "time"), 200.0, behind)) for behind in (1.5, 99.0))
    assert near.lead == 1.5
    assert far.lead == alone.errors
