"""What the simulation of the whole bench says where blocks cannot be tested: effects that would explain it, times."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch import effects
from slipstick.clutch.model import Model
from slipstick.confirmation import SimulationFit, Terms, Traces
from slipstick.confirmation import explanations as explanations_module
from slipstick.confirmation.explanations import Explanation, explanations
from slipstick.confirmation.fit import fit_simulation
from slipstick.confirmation.promised import estimate_likelihoods
from slipstick.confirmation.simulated import RANDOM, SimulatedBench
from slipstick.confirmation.starts import About
from slipstick.confirmation.times import TimesOver, times_over
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Recordings
from slipstick.studies import StudySettings, conclude, examine
from slipstick.studies.untested import examine_untested
from tests.benches import HEAVY, NOMINAL
from tests.slipstick.confirmation.conftest import recorded

DRAG = NOMINAL.with_effect("quadratic_load_drag", {"drag": 0.03})
N = 36


@pytest.fixture(autouse=True)
def fit_two_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fit only the two effects that promise most, of which the true effect must be the better."""
    monkeypatch.setattr(explanations_module, "_FITTED", 2)


def fitted(recordings: Recordings) -> SimulationFit:
    traces = Traces.of(Scene.of(HEAVY, recordings, NamingSettings()), {}, HEAVY.physics.curves)
    return fit_simulation(traces, Terms(HEAVY), np.zeros((len(recordings), len(RANDOM))))


def only(model: Model, *signals: str) -> Recordings:
    """Recordings of a model of which these signals were recorded."""
    whole = recorded(model, N)[0]
    assert whole.signals is not None
    left = dict.fromkeys(set(whole.signals.names) - set(signals))
    return replace(whole, signals=replace(whole.signals, **left) if signals else None)


@pytest.fixture(scope="module")
def times() -> SimulationFit:
    return fitted(only(NOMINAL))


@pytest.fixture(scope="module")
def speed() -> SimulationFit:
    return fitted(only(DRAG, "output_speed"))


def dense(fit: SimulationFit, column: np.ndarray) -> float:
    """The log-likelihood up to a constant with a further column (n, K): engagement by engagement, with whole matrices.

    As the linear mixed model has it, by generalized least squares with the priors as observations.
    """
    block, about, variance = fit.block, About(fit.block, fit.fitted).columns, np.diag(fit.fitted.variance)
    std = np.append(np.minimum(block.random_std, 0.3), 3.0)
    information, pull, parts = np.diag(1 / std**2), np.zeros(len(std)), []
    for own, new, z, counted in zip(about.own, column, about.z, block.counted, strict=True):
        x = np.vstack([own, new])[:, counted].T
        inverse = np.linalg.inv(np.eye(len(x)) + x[:, :-1] @ variance @ x[:, :-1].T)
        information, pull = information + x.T @ inverse @ x, pull + x.T @ inverse @ z[counted]
        parts.append((x, z[counted], inverse))
    found = np.linalg.solve(information, pull)
    return sum(0.5 * float(np.linalg.slogdet(inverse)[1] - (z - x @ found) @ inverse @ (z - x @ found))
               for x, z, inverse in parts)


def test_what_effects_promise_is_the_likelihood_of_the_mixed_model(times: SimulationFit) -> None:
    some = [effects.find(name) for name in ("quadratic_load_drag", "supply_droop")]
    found = estimate_likelihoods(times, some)
    for one in some:
        other = SimulatedBench(times.block.traces, Terms(HEAVY, (one.name,)))
        small = 1e-3 * np.array([(its.typical - its.neutral) / its.span for its in other.terms.unknowns])
        column = 1000 * (other.rows_at(times.fitted.points[None], small)[0] - times.fitted.predicted)
        assert found[one.name] == pytest.approx(dense(times, column), rel=1e-6)


@pytest.mark.slow
def test_the_effect_of_a_block_without_its_signals_would_explain_it_and_wrong_ones_do_not(speed: SimulationFit) -> None:
    wrong = [one for one in effects.CATALOGUE if one.quantity not in ("load torque", "brake torque")]
    true, *others = explanations(speed, [*wrong, effects.find("quadratic_load_drag")], NamingSettings())
    assert true.effect == "quadratic_load_drag"
    assert true.sufficient
    assert true.worth.shifting_time > 5
    assert not any(one.sufficient or one.nats > true.nats for one in others)


def test_nothing_is_looked_for_where_nothing_is_missing() -> None:
    rest = examine_untested(StudySettings(), fitted(only(NOMINAL, "output_speed")))
    assert {one.name for one in rest.closed} == {"valve", "contact", "clutch", "load", "input", "lock"}
    assert (rest.misfits, rest.explanations, rest.times) == ([], [], [])


def later(recordings: Recordings, rows: np.ndarray, by: float) -> Recordings:
    return replace(recordings, measured_time=recordings.measured_time + by * rows)


def over(fit: SimulationFit) -> dict[str, TimesOver]:
    return {one.condition: one for one in times_over(fit, NamingSettings(), 0)}


def test_shifting_times_alone_show_what_no_parameter_explains() -> None:
    whole = only(NOMINAL)
    slow = whole.conditions.current_profile == 3
    found = over(fitted(later(whole, slow, 0.1)))
    profile = found["current_profile"]
    assert [one.condition for one in found.values() if one.shown] == ["current_profile"]
    jump = profile.change[3] - np.mean(np.delete(profile.change, 3))
    assert jump == pytest.approx(100, abs=4 * profile.error[3])
    assert profile.levels[profile.furthest] == 3
    # The same variance in any engagement is scatter.
    scatter = slow.std() * np.random.default_rng(5).standard_normal(len(slow))
    assert not any(one.shown for one in over(fitted(later(whole, scatter, 0.1))).values())


def test_shifting_times_of_the_model_show_nothing(times: SimulationFit) -> None:
    found = over(times)
    assert set(found) == {"motor_speed", "load_inertia", "brake_torque", "current_profile", "run_order"}
    assert not any(one.shown for one in found.values())
    for one in found.values():
        assert len(one.levels) == len(one.change) == len(one.error)
        assert np.all(np.abs(one.change) < 5 * np.array(one.error))


@pytest.mark.slow
def test_a_study_of_shifting_times_says_what_can_be_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explanations_module, "_FITTED", 1)
    settings, whole = StudySettings(), only(NOMINAL)
    late = later(whole, whole.conditions.current_profile == 3, 0.1)
    result, figures = conclude(settings, HEAVY, late, examine(settings, HEAVY, late))
    assert (result.kind, result.findings, result.blocks, figures.engagements) == ("unlisted", [], [], [])
    assert result.sentence.startswith("Something is missing that shows in the shifting time")
    assert all(isinstance(one, Explanation) for one in result.explanations)
