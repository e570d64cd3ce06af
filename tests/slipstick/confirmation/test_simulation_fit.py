"""The fit of the whole simulation: coefficients, nesting, measured laws, worth, gap, control, further experiments."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch import effects
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.confirmation import SimulationFit, Terms, Traces, confirmed, fit
from slipstick.confirmation.control import control
from slipstick.confirmation.fit import fit_simulation
from slipstick.confirmation.further import further
from slipstick.confirmation.gap import WITHIN, closures, predict
from slipstick.confirmation.measured import with_measured_laws
from slipstick.confirmation.worth import worth
from slipstick.naming.curved import fit_curved
from slipstick.naming.selection import is_enough
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY, NOMINAL


def enough(gain: np.ndarray) -> bool:
    return bool(gain.sum() > 12)


Traced = Callable[[Model], tuple[Traces, np.ndarray]]
DRAG = NOMINAL.with_effect("quadratic_load_drag", {"drag": 0.03})
SPEEDS = (0.0, 20.0, 40.0, 60.0, 80.0, 100.0)
LAW = MeasuredLaw("load torque", "output speed", SPEEDS, tuple(0.03 * speed**2 for speed in SPEEDS), False)


@pytest.fixture(scope="module")
def fits(traced: Traced) -> Callable[[str], tuple[SimulationFit, SimulationFit]]:
    """Fits to recordings with a load drag: without it and with the named effect or law."""
    terms = {"drag": Terms(HEAVY, ("quadratic_load_drag",)), "law": Terms(HEAVY, (), (LAW,)),
             "both": Terms(HEAVY, ("stribeck_friction", "quadratic_load_drag"))}

    @cache
    def found(which: str) -> tuple[SimulationFit, SimulationFit]:
        traces, points = traced(DRAG)
        return confirmed(traces, terms[which], points, enough)

    return found


def test_the_coefficient_is_the_true_one_within_its_error(fits: Callable) -> None:  # type: ignore[type-arg]
    before, after = fits("drag")
    error = float(np.sqrt(after.covariance[0, 0]))
    assert after.values[0] == pytest.approx(0.03, abs=4 * error)
    assert error < 0.001
    assert (after.evidence - before.evidence).sum() > 100
    left = after.block.traces.mean_squares(after.block.measured - after.fitted.predicted)
    assert max(left.values()) < 1.3


def test_some_engagements_alone_are_simulated_as_all_are(fits: Callable) -> None:  # type: ignore[type-arg]
    _, after = fits("drag")
    block, points, shared = after.block, after.fitted.points, after.fitted.shared
    rows = np.arange(len(points)) % 3 == 1
    found = block.at(shared).part(points, (), rows)
    np.testing.assert_allclose(found[rows], after.fitted.predicted[rows], rtol=1e-9, atol=1e-9)
    assert not found[~rows].any()


def test_a_term_whose_gain_is_not_enough_does_not_keep_others_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """That which gains most may do so in few engagements only."""
    few, most = ("stribeck_friction",), ("quadratic_load_drag",)
    gains = {(): np.zeros(24), most: np.full(24, 5.0), few: np.where(np.arange(24) < 2, 500.0, 0.0),
             (*few, *most): np.full(24, 5.0)}

    def fitted(traces: Any, terms: Terms, *_: Any) -> Any:
        return SimpleNamespace(evidence=gains[terms.names], block=SimpleNamespace(terms=terms),
                               fitted=SimpleNamespace(points=None, shared=None, predicted=0.0))

    monkeypatch.setattr(fit, "fit_simulation", fitted)
    monkeypatch.setattr(fit, "_fit_roughly", fitted)
    monkeypatch.setattr(fit, "_continued", lambda _, traces, terms: fitted(traces, terms))
    monkeypatch.setattr(fit, "fit_extended", lambda _, terms, points: fitted(None, terms, points))
    monkeypatch.setattr(fit, "refit_above", lambda after, _: after)
    traces: Any = SimpleNamespace(measured=0.0, mean_squares=lambda _: {}, with_noise=lambda _: None)
    terms = Terms(HEAVY, (*few, *most))
    assert set(terms.names) == {*few, *most}
    _, after = confirmed(traces, terms, np.zeros((24, 1)), lambda gain: is_enough(gain, NamingSettings()))
    assert after.block.terms.names == most


@pytest.mark.slow
def test_a_measured_law_does_as_well_as_the_formula(fits: Callable) -> None:  # type: ignore[type-arg]
    before, after = fits("law")
    assert after.values[0] == pytest.approx(1.0, abs=0.05)
    formula = fits("drag")
    gains = [(one[1].evidence - one[0].evidence).sum() for one in (formula, (before, after))]
    assert gains[1] > 0.8 * gains[0]


@pytest.fixture(scope="module")
def saturating(traced: Traced) -> tuple[SimulationFit, SimulationFit, Callable[[SimulationFit], SimulationFit]]:
    """Fits to recordings with a drag that saturates, with a formula that does not and without, and how one goes on."""
    law = replace(LAW, change=tuple(100 * (1 - np.exp(-speed / 15)) for speed in SPEEDS))
    traces, points = traced(replace(NOMINAL, laws=(law,)))
    formulas, refused = (fit_simulation(traces, Terms(HEAVY, names), points)
                         for names in (("quadratic_load_drag",), ()))
    return formulas, refused, lambda fit: with_measured_laws(fit, refused, {"quadratic_load_drag": law}, points, enough)


@pytest.mark.slow
def test_a_measured_law_takes_the_place_of_a_formula_only_where_it_describes_the_recordings_better(
        saturating: Any) -> None:
    formulas, _, measure = saturating
    after = measure(formulas)
    assert after.block.terms.names == ("load torque ~ output speed",)
    assert after.values[0] == pytest.approx(1.0, abs=0.05)
    wide, narrow = (predict(one, 1).square[:, 2].mean() for one in (formulas, after))
    assert narrow < 0.5 * wide


@pytest.mark.slow
def test_a_measured_law_is_added_where_the_formula_was_refused(saturating: Any) -> None:
    formulas, refused, measure = saturating
    assert measure(refused).evidence.sum() == pytest.approx(measure(formulas).evidence.sum(), abs=1)


@pytest.mark.slow
def test_a_formula_whose_fit_ended_elsewhere_begins_again_before_a_law_takes_its_place(
        traced: Traced, fits: Callable) -> None:  # type: ignore[type-arg]
    (before, exact), points = fits("drag"), traced(DRAG)[1]
    assert with_measured_laws(exact, before, {"quadratic_load_drag": LAW}, points, enough) is exact
    elsewhere = fit_curved(exact.block, points=points + 0.3, shared=exact.block.neutral, iterations=0)
    poor = SimulationFit(exact.block, elsewhere)
    assert poor.evidence.sum() < exact.evidence.sum() - 1000
    found = with_measured_laws(poor, before, {"quadratic_load_drag": LAW}, points, enough)
    assert found.block.terms.names == ("quadratic_load_drag",)
    assert found.evidence.sum() > exact.evidence.sum() - 1


@pytest.mark.slow
def test_a_fit_is_never_below_the_one_that_is_nested_in_it(fits: Callable) -> None:  # type: ignore[type-arg]
    for which in ("drag", "law", "both"):
        before, after = fits(which)
        assert after.evidence.sum() >= before.evidence.sum() - 1e-6


def test_the_gap_closes_with_the_true_effect_and_not_with_a_wrong_one(fits: Callable) -> None:  # type: ignore[type-arg]
    before, after = fits("drag")
    wide, narrow = predict(before, 1), predict(after, 1)
    closed = closures(wide, narrow, 1)
    assert closed["output_speed"].lower < 1 < closed["output_speed"].upper + 0.2  # type: ignore[operator]
    assert (closed["output_speed"].closure or 0.0) > 0.6
    assert closed["shifting_time"].rms_after < closed["shifting_time"].rms_before
    name, other = control(before, ["load torque"])  # type: ignore[misc]
    assert name != "quadratic_load_drag"
    judged = closures(wide, predict(other, 1), 1)
    assert (judged["output_speed"].closure or 0.0) < 0.3
    within, wrong = closed[WITHIN], judged[WITHIN]
    assert within.lower > 0.8 > 0.5 > (wrong.closure or 0.0)  # type: ignore[operator]
    assert within.rms_after == pytest.approx(1, abs=0.1)
    assert closures(narrow, narrow, 1)[WITHIN].closure is None  # a right model leaves none


def test_an_effect_that_is_found_under_a_pair_of_the_finding_is_no_control(
        fits: Callable, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[type-arg]
    air = effects.find("entrained_air")
    assert air.quantity != "piston rate"
    assert ("piston rate", "pressure") in air.pairs
    monkeypatch.setattr(effects, "CATALOGUE", (air,))
    assert control(fits("drag")[0], ["piston rate"]) is None


def test_a_right_model_leaves_the_error_that_is_expected_of_it(fits: Callable) -> None:  # type: ignore[type-arg]
    _, after = fits("drag")
    predictions = [predict(after, seed) for seed in range(3)]
    expected = np.array([np.sqrt(one.variance.mean(axis=0)) for one in predictions])
    assert np.all(np.ptp(expected, axis=0) < 0.2 * expected.mean(axis=0)), "too few draws, or too much in common"
    left = np.sqrt(predictions[0].square.mean(axis=0))
    np.testing.assert_allclose(left, expected[0], rtol=0.35)  # 18 engagements: 17 % alone


def test_worth_is_the_change_that_the_effect_makes(fits: Callable) -> None:  # type: ignore[type-arg]
    _, after = fits("drag")
    its = worth(after, "quadratic_load_drag")
    assert its.shifting_time > 1.0
    assert its.largest > 0  # a drag delays lock-up
    assert its.signals["pressure"] < 1e-4
    assert its.signals["output_speed"] > 1.0


@pytest.mark.slow
def test_of_two_names_the_simulation_confirms_the_true_one(fits: Callable) -> None:  # type: ignore[type-arg]
    _, after = fits("both")
    assert after.block.terms.names == ("quadratic_load_drag",)


@pytest.mark.slow
def test_further_experiments_tell_models_apart_that_differ(fits: Callable) -> None:  # type: ignore[type-arg]
    before, after = fits("drag")
    other = fit_simulation(after.block.traces, Terms(HEAVY, ("falling_load_friction",)), before.fitted.points)
    proposed = further(after, other, "falling_load_friction")
    assert proposed
    assert proposed == sorted(proposed, key=lambda one: -one.apart)
    assert proposed[0].repetitions is not None
    assert further(after, after, "itself") == []
