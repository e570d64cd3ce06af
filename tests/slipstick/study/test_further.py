"""Further experiments: what tells two models apart is found, and what scatter can hide is not."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from slipstick.clutch import effects, ensemble
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.study import mixed
from slipstick.study.apart import apart, beside, ideal, repetitions
from slipstick.study.comparison import CHANNELS, WIDTH, Comparison
from slipstick.study.design import Design
from slipstick.study.further import further, tried
from slipstick.study.marginal import State
from slipstick.study.mixed import MixedFit
from tests.benches import HEAVY, NOMINAL

PARAMETERS = ("pressure_bias", "initial_position", "friction_coefficient")
NOISE = dict(zip(CHANNELS, (0.02, 0.1, 0.03, 2.0, 0.003), strict=True))
SCATTER = 0.05
SEED = 1
STILL = np.zeros((12, 2))  # modes of 12 runs without scatter


@pytest.fixture(scope="module")
def compared() -> Comparison:
    """The plain model under 12 conditions: two profiles, three motor speeds, two brake torques, one inertia."""
    paper, time = HEAVY.conditions, np.arange(0.0, 2.0, 0.002)
    speeds = np.unique(paper.motor_speed)[:3]
    rows = [np.flatnonzero((paper.current_profile == profile) & (paper.motor_speed == speed)
                           & (paper.load_inertia == 10) & (paper.brake_torque == brake))[0]
            for profile, speed, brake in product((0, 3), speeds, (20.0, 80.0))]
    conditions = replace(paper.take(rows), run_order=np.arange(12))
    response = ensemble.signals(NOMINAL, conditions, time)
    locked = response.shifting_time[0]
    k = len(time) // WIDTH
    channels = {name: slice(place * k, min((place + 1) * k, 4 * k + 1)) for place, name in enumerate(CHANNELS)}
    recordings = Recordings(conditions, locked, Signals(time, *(getattr(response, name)[0] for name in SIGNAL_UNITS)))
    blank = Comparison(HEAVY, recordings, channels, np.empty((12, 4 * k + 1)), np.ones((12, 4 * k + 1)), NOISE)
    return replace(blank, measured=blank.predicted(response)[0])


def fitted(compared: Comparison, effect: str, size: float, **multiples: float) -> MixedFit:
    """A fit with `size` typical values of an effect, and parameters at the multiples."""
    design = Design(HEAVY, PARAMETERS, (0, 1), (effect,))
    shapes = [one.neutral / one.typical for one in effects.find(effect).on(HEAVY.scales).coefficients[1:]]
    theta = np.array([*(multiples.get(name, 1.0) for name in PARAMETERS), size, *shapes])
    n, channels = len(compared.measured), len(compared.channels)
    return mixed.at(compared, design, State(theta, np.zeros((n, 2)), SCATTER**2 * np.eye(2), np.ones(channels)))


@pytest.mark.parametrize(("effect", "size", "best"), [
    ("quadratic_load_drag", 1.0, 1.2 * 1600), ("supply_droop", 0.5, 0.8 * 1000)])
def test_the_experiments_that_differ_most_come_first(
        compared: Comparison, effect: str, size: float, best: float) -> None:
    one, none = fitted(compared, effect, size), fitted(compared, "thermal_fade", 0.0)
    found = further(compared, [one, none], SEED)
    assert found[0]["motor_speed"] == pytest.approx(best * np.pi / 30)
    distance = [each["apart"] for each in found]
    assert distance == sorted(distance, reverse=True)
    assert distance[0] > 1
    assert any(each["recorded"] for each in found)
    assert not found[0]["recorded"]
    assert found[0]["repetitions"] <= 3
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize("signal", SIGNAL_UNITS)
def test_the_signal_that_differs_is_told(compared: Comparison, signal: str) -> None:
    conditions = compared.recordings.conditions
    one, none = fitted(compared, f"{signal}_sensor_offset", 1.0), fitted(compared, "thermal_fade", 0.0)
    squares = apart(beside(*(ideal(compared, each, conditions, STILL) for each in (one, none))), none, STILL).squares
    assert {CHANNELS[place] for place in squares[:-1].argmax(axis=0)} == {signal}


def test_models_that_predict_the_same_are_told_apart_by_nothing(compared: Comparison) -> None:
    same = [fitted(compared, effect, 0.0) for effect in ("quadratic_load_drag", "supply_droop")]
    found = further(compared, same, SEED)
    assert {each["apart"] for each in found} == {0.0}
    assert {each["repetitions"] for each in found} == {None}


@pytest.mark.parametrize(("moved", "hidden"), [
    ({"pressure_bias": 1.04}, True), ({"initial_position": 0.95}, True), ({"friction_coefficient": 1.04}, False)])
def test_what_scatters_from_run_to_run_counts_nothing(
        compared: Comparison, moved: dict[str, float], hidden: bool) -> None:
    one, other = (fitted(compared, "supply_droop", 0.0, **multiples) for multiples in ({}, moved))
    conditions = compared.recordings.conditions
    right, wrong = (ideal(compared, each, conditions, STILL) for each in (one, other))
    judged = beside(right, wrong)
    before = ((right.measured - wrong.measured) / compared.scale * judged.weights) ** 2
    after = apart(judged, other, STILL)
    assert np.all(before.sum(axis=1) > 10)
    assert np.all(after.squares.sum(axis=0) < 2) == hidden


def test_shifting_times_alone_tell_by_how_they_differ_beside_noise_and_scatter(compared: Comparison) -> None:
    values, conditions = compared.measured[:, -1:], compared.recordings.conditions
    alone = Comparison(HEAVY, replace(compared.recordings, signals=None), {"shifting_time": slice(0, 1)}, values,
                       np.ones_like(values), NOISE)
    found = further(alone, [fitted(alone, "supply_droop", 0.0, friction_coefficient=one) for one in (1.1, 1.0)], SEED)
    assert {each["signal"] for each in found} == {"shifting_time"}
    best = next(each for each in found if each["recorded"])
    place = np.flatnonzero(np.all([getattr(conditions, name) == best[name] for name in (
        "current_profile", "motor_speed", "brake_torque")], axis=0))
    points = np.array([[1, 1, 1.1], [1.01, 1, 1], [0.99, 1, 1], [1, 1.01, 1], [1, 0.99, 1], [1, 1, 1]])
    times = ensemble.shifting_times(NOMINAL, conditions.take(place), PARAMETERS, points)[0][:, 0]
    slopes = (times[1:5:2] - times[2:5:2]) / 0.02
    expected = abs(times[0] - times[-1]) / np.sqrt(NOISE["shifting_time"] ** 2 + SCATTER**2 * (slopes @ slopes))
    assert best["apart"] == pytest.approx(expected, rel=0.05)


def test_of_several_the_nearest_counts(compared: Comparison) -> None:
    one, near, far = (fitted(compared, "quadratic_load_drag", size) for size in (1.0, 0.8, 0.0))
    assert further(compared, [one, far, near], SEED) == further(compared, [one, near], SEED)


def test_the_less_two_differ_the_more_runs_it_takes(compared: Comparison) -> None:
    condition = compared.recordings.conditions.take([0])
    one, *others = (fitted(compared, "quadratic_load_drag", size) for size in (0.0, 0.005, 0.02, 0.1))
    found = [repetitions(compared, one, other, condition, STILL[:1], SEED) for other in others]
    assert found[0] is None
    assert found[1] > 3 * found[2]


def test_what_locks_in_one_of_them_alone_is_no_experiment(compared: Comparison) -> None:
    slipping = fitted(compared, "supply_droop", 0.0, friction_coefficient=0.01)
    assert further(compared, [slipping, fitted(compared, "thermal_fade", 0.0)], SEED) == []


def test_recorded_levels_and_a_step_beyond_are_tried(compared: Comparison) -> None:
    conditions = compared.recordings.conditions
    grid = tried(conditions, SEED)
    assert len(grid) == 2 * 5 * 3 * 4
    assert np.unique(grid.load_inertia) == pytest.approx([8, 10, 12])
    assert np.all(grid.run_order == 12)
    many = replace(HEAVY.conditions, motor_speed=np.linspace(100, 200, 216), load_inertia=np.linspace(5, 15, 216))
    assert len(tried(many, SEED)) == 1000
    assert set(tried(many, SEED).motor_speed) <= {*many.motor_speed, 80.0, 240.0}
