"""Sets of recordings that cannot be of a bench are refused with the reason, before any long computation."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from slipstick.bench import Bench, parameters
from slipstick.calibration import calibrate
from slipstick.clutch import effects, ensemble
from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.plausibility.mismatch import is_near, mismatches, nearest_ratios
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.studies import StudySettings, examine
from tests.benches import BENCHES, COMPACT, HEAVY, TABLES
from worker.__main__ import main

FILES = {"heavy": TABLES / "measured.h5", "compact": TABLES / "measured-compact.h5"}
WHOLE = {name: Recordings.open(path) for name, path in FILES.items()}
RECORDINGS = {name: whole.take(np.arange(0, len(whole), 4)) for name, whole in WHOLE.items()}
"""Every fourth engagement."""


def with_signals(recordings: Recordings, **factors: float) -> Recordings:
    assert recordings.signals is not None
    return replace(recordings, signals=replace(recordings.signals, **{
        name: factor * recordings.signals[name] for name, factor in factors.items()}))


def with_conditions(recordings: Recordings, **factors: float) -> Recordings:
    return replace(recordings, conditions=replace(recordings.conditions, **{
        name: factor * getattr(recordings.conditions, name) for name, factor in factors.items()}))


def only(recordings: Recordings, *names: str) -> Recordings:
    signals = recordings.signals
    assert signals is not None
    return replace(recordings, signals=Signals(signals.time, **{name: signals[name] for name in names}))


def causes(recordings: Recordings, bench: Bench) -> str:
    return "; ".join(mismatch.cause for mismatch in mismatches(recordings, bench))


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_the_shipped_recordings_are_of_their_benches_with_any_signals(bench: Bench) -> None:
    whole = WHOLE[bench.name]
    for recordings in (whole, replace(whole, signals=None), *(only(whole, name) for name in SIGNAL_UNITS)):
        assert mismatches(recordings, bench) == ()


@pytest.mark.parametrize(("bench", "other"), [(HEAVY, COMPACT), (COMPACT, HEAVY)], ids=lambda bench: bench.name)
def test_recordings_of_another_machine_are_told_by_the_gear_ratio(bench: Bench, other: Bench) -> None:
    mismatch, *_ = mismatches(RECORDINGS[bench.name], other)
    recorded, stated = (each.physics.nominal[parameters.index("gear_ratio")] for each in (bench, other))
    shown = re.match(r"After lock-up the input speed is (.*) times the output speed", mismatch.cause)
    assert shown
    assert float(shown[1]) == pytest.approx(recorded, rel=0.01)
    assert mismatch.cause.endswith(f"gear ratio of the bench is {stated:g}")
    assert mismatch.remedy.startswith("Give the bench of these recordings")


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("name", SIGNAL_UNITS)
def test_a_signal_with_the_wrong_sign_is_named_and_nothing_else(bench: Bench, name: str) -> None:
    whole = RECORDINGS[bench.name]
    n = len(whole)
    for recordings in (whole, only(whole, name)):
        mismatch, = mismatches(with_signals(recordings, **{name: -1.0}), bench)
        words = name.replace("_", " ")
        assert mismatch.cause == (f"The {words} of the recordings has the opposite sign of that of the simulation, in "
                                  f"{n} of {n} engagements")
        assert "sign = -1" in mismatch.remedy


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize(("name", "factor"), [
    ("pressure", 1e5), ("pressure", 100), ("pressure", 0.1), ("input_speed", 60 / (2 * np.pi)),
    ("output_speed", 60 / (2 * np.pi)), ("output_torque", 1e-3), ("output_torque", 10)])
def test_a_level_that_is_off_by_a_power_of_ten_is_named_with_the_factor(
        bench: Bench, name: str, factor: float) -> None:
    recordings = with_signals(only(RECORDINGS[bench.name], name), **{name: factor})
    mismatch, = mismatches(recordings, bench)
    stated = re.match(f"The {name.replace('_', ' ')} of the recordings is (.*) times that of the simulation",
                      mismatch.cause)
    assert stated
    assert float(stated[1]) == pytest.approx(factor, rel=0.05)
    assert mismatch.remedy.startswith(f"Check the unit of the {name.replace('_', ' ')}")


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("factor", [1e-8, 1e-4, 0.1, 10, 1e4])
def test_an_inertia_that_the_torque_contradicts_is_named(bench: Bench, factor: float) -> None:
    recordings = with_conditions(RECORDINGS[bench.name], load_inertia=factor)
    mismatch, *_ = mismatches(recordings, bench)
    assert mismatch.cause.startswith("The output speed of the recordings is ")
    assert mismatch.cause.endswith(f"accelerates their load inertia, in the median of {len(recordings)} engagements")
    assert mismatch.remedy.startswith("Check the units of load_inertia")


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("changed", [
    {"load_inertia": 1e-8}, {"motor_speed": 60 / (2 * np.pi)}, {"profile_current": 1e-3}],
    ids=lambda changed: next(iter(changed)))
def test_conditions_under_which_nothing_locks_are_refused_even_without_signals(
        bench: Bench, changed: dict[str, float]) -> None:
    times = replace(RECORDINGS[bench.name], signals=None)
    mismatch, = mismatches(with_conditions(times, **changed), bench)
    assert re.fullmatch(rf"In the simulation \d+ of the {len(times)} recorded engagements never lock", mismatch.cause)
    assert "load_inertia" in mismatch.remedy


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_currents_in_another_unit_are_told_by_the_pressure(bench: Bench) -> None:
    assert "The pressure of the recordings is" in causes(with_conditions(RECORDINGS[bench.name], profile_current=1e3),
                                                         bench)


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_flaws_of_single_engagements_are_no_reason(bench: Bench) -> None:
    recordings = RECORDINGS[bench.name]
    signals = recordings.signals
    assert signals is not None
    few = np.random.default_rng(1).permutation(len(recordings))[:len(recordings) // 3]
    flawed = {name: signals[name].copy() for name in signals.names}
    flawed["output_torque"][few] *= -1
    flawed["pressure"][few] *= 1e5
    flawed["input_speed"][few], flawed["output_speed"][few] = signals["output_speed"][few], 0.0
    inertia = recordings.conditions.load_inertia.copy()
    inertia[few] *= 1e-8
    assert mismatches(replace(recordings, signals=replace(signals, **flawed),
                              conditions=replace(recordings.conditions, load_inertia=inertia)), bench) == ()


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("name", SIGNAL_UNITS)
def test_a_slow_sensor_is_no_reason(bench: Bench, name: str) -> None:
    """Its time constant is the largest that a study considers."""
    signals = RECORDINGS[bench.name].signals
    assert signals is not None
    lag = effects.find(f"{name}_sensor_lag").on(bench.scales).coefficients[0].upper
    slow = replace(signals, **{name: lagged_signal(signals[name], signals.time, lag)})
    assert mismatches(replace(RECORDINGS[bench.name], signals=slow), bench) == ()


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_a_clutch_that_opens_again_is_no_reason(bench: Bench) -> None:
    whole = RECORDINGS[bench.name]
    signals = whole.signals
    assert signals is not None
    ends = whole.measured_time + 0.2 * (signals.time[-1] - whole.measured_time)
    falling = np.where(signals.time > ends[:, None], 0.5, 1.0) * signals["output_speed"]
    assert mismatches(replace(whole, signals=replace(signals, output_speed=falling)), bench) == ()


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("at_bounds", [False, True], ids=["between", "at"])
def test_no_parameters_within_their_bounds_are_a_reason(bench: Bench, at_bounds: bool) -> None:
    """At the bounds, shifting times are up to ten times those of the nominal bench, so that these alone say nothing."""
    random, drawn, furthest = np.random.default_rng(3), 0, 0.0
    conditions = bench.conditions.take(random.permutation(len(bench.conditions))[:24])
    for _ in range(25):
        ends = np.array([(prior.lower, prior.upper) if prior.uncertain else (1.0, 1.0) for prior in bench.priors])
        share = random.integers(0, 2, len(ends)) if at_bounds else random.random(len(ends))
        model = Model(bench.physics, tuple(np.array(bench.physics.nominal) * (ends[:, 0] + share * np.ptp(ends, 1))))
        time = np.arange(0, conditions.profile_time[:, -1].min(), 10 * bench.sample_time)
        response = ensemble.signals(model, conditions, time)
        if np.isnan(response.shifting_time).any():
            continue
        recordings = Recordings(conditions, response.shifting_time[0],
                                Signals(time, *(getattr(response, name)[0] for name in SIGNAL_UNITS)))
        assert mismatches(recordings, bench) == ()
        nominal = ensemble.shifting_times(Model(bench.physics), conditions)[0][0]
        furthest = max(furthest, abs(np.log10(np.median(recordings.measured_time / nominal))))
        drawn += 1
    assert drawn >= 10
    assert furthest > 0.5 or not at_bounds


@pytest.mark.parametrize(("ratio", "near"), [
    (1.0, True), (3.1, True), (3.2, False), (1 / 3.1, True), (1 / 3.2, False), (-1.0, False), (0.0, False),
    (np.inf, False), (np.nan, True)])
def test_a_ratio_is_near_1_up_to_half_a_decade(ratio: float, near: bool) -> None:
    assert is_near(ratio) == near


def test_a_ratio_comes_as_near_to_1_as_the_inputs_allow() -> None:
    def ratios(point: np.ndarray) -> np.ndarray:
        return np.array([1e3 * point[0] / point[1], 1e3 * point[0] * point[1], -1e3, 2.0, np.nan])

    reach = partial(nearest_ratios, ratios, ratios(np.ones(2)), np.ones(2))
    np.testing.assert_allclose(reach(np.full(2, 0.5), np.full(2, 2.0)), [250, 250, -1e3, 2, np.nan])
    np.testing.assert_allclose(reach(np.full(2, 1e-3), np.full(2, 2.0)), [1, 1, -1e3, 2, np.nan])
    np.testing.assert_allclose(nearest_ratios(ratios, np.array([5e3]), np.empty(0), np.empty(0), np.empty(0)), [5e3])


def test_study_and_calibration_refuse_such_recordings_with_cause_and_remedy() -> None:
    wrong = with_signals(WHOLE["compact"], output_torque=-1.0)
    for start in (partial(examine, StudySettings(), COMPACT, wrong), partial(calibrate, wrong, COMPACT)):
        with pytest.raises(InvalidValue, match=r"output torque .* opposite sign .* in 90 of 90 engagements\. If its "
                                               r"sensor counts the other way round, change its sign \(sign = -1"):
            start()


def test_signals_with_times_in_ms_are_told_by_their_times_and_not_by_their_levels() -> None:
    recordings = RECORDINGS["compact"]
    assert recordings.signals is not None
    wrong = replace(recordings, signals=replace(recordings.signals, time=1e3 * recordings.signals.time))
    for start in (partial(examine, StudySettings(), COMPACT, wrong), partial(calibrate, wrong, COMPACT)):
        with pytest.raises(InvalidValue, match=r"The signals are from .* Give the times of the signals in seconds"):
            start()


@pytest.mark.parametrize("command", ["study {}", "calibrate --recordings {}"])
def test_the_commands_refuse_recordings_of_another_bench(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [word.format(FILES["compact"]) for word in command.split()]
    assert main([*arguments, "--bench", str(TABLES / "heavy.toml")]) == 1
    printed = capsys.readouterr()
    assert "the gear ratio of the bench is 3.2. Give the bench of these recordings" in printed.err
    assert "step 1" not in printed.err
    assert "iteration" not in printed.err
    assert printed.out == ""
