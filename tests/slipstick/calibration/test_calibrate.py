"""Calibration on simulated recordings with known parameters and scatter, and on the shipped recordings."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from evidence.calibration_coverage.sets import record_runs
from slipstick.bench import Bench, parameters
from slipstick.calibration import Calibration, calibrate
from slipstick.calibration.observations import ACCURACY, Observations
from slipstick.clutch import ensemble
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.calibration import calibration_summary, calibration_text
from tests.benches import COMPACT, HEAVY, NOMINAL

MEAN = np.array([1.04, 0.96, 1.03, 0.95, 1.03, 1.04, 0.95])
SCATTER = np.array([0.01, 0.02, 0.006, 0.03, 0.02, 0.05, 0.01])
STRIBECK = {"strength": 0.22, "decay_speed": 25.0}


@cache
def recordings(bench: Bench, every: int = 4, share: float = 1.0, correlation: float = 0.3) -> Recordings:
    """Recordings whose parameters scatter by a `share` of SCATTER."""
    conditions = bench.conditions.take(range(0, len(bench.conditions), every))
    return record_runs(bench, conditions, MEAN, share * SCATTER, correlation, np.random.default_rng(8))[0]


@cache
def calibrated(bench: Bench, every: int = 4, share: float = 1.0) -> Calibration:
    return calibrate(recordings(bench, every, share), bench)


def multiples(calibration: Calibration, values: np.ndarray) -> np.ndarray:
    nominal = np.array(calibration.model.physics.nominal)
    return np.asarray(values / nominal[[parameters.index(name) for name in calibration.free]])


def mean(calibration: Calibration) -> np.ndarray:
    values = dict(zip(parameters.NAMES, calibration.model.parameters, strict=True))
    return multiples(calibration, np.array([values[name] for name in calibration.free]))


@pytest.mark.slow
@pytest.mark.parametrize(("bench", "every"), [(HEAVY, 5), (COMPACT, 3)], ids=["heavy", "compact"])
def test_means_and_scatter_are_recovered_from_the_nominal_start(bench: Bench, every: int) -> None:
    found = calibrated(bench, every)
    assert found.converged
    assert found.at_bound == ()
    error = multiples(found, found.standard_error)
    assert np.max(np.abs(mean(found) - MEAN) / error) < 3.5
    assert np.max(error) < 0.08
    scatter, uncertain = multiples(found, found.scatter), multiples(found, found.scatter_error)
    assert np.all(np.abs(scatter - SCATTER) < 3.5 * uncertain)
    well = np.array([0, 1, 2, 6])  # each engagement determines these four by itself
    np.testing.assert_allclose(scatter[well], SCATTER[well], rtol=0.45)
    np.testing.assert_allclose([found.chi_square[name] for name in SIGNAL_UNITS], 1, atol=0.15)
    for name in SIGNAL_UNITS:
        assert found.noise[name] == pytest.approx(bench.sensors[name].noise, rel=0.06)
        assert found.noise_correlation[name] == pytest.approx(0.3, abs=0.06)


@pytest.mark.slow
def test_no_scatter_is_found_where_there_is_none_and_intervals_are_narrow() -> None:
    none, some = calibrated(COMPACT, 6, 0.0), calibrated(COMPACT, 6)
    assert np.all(multiples(none, none.scatter) < 0.1 * SCATTER)
    assert np.max(np.abs(mean(none) - MEAN)) < 0.01
    assert np.all(np.diff(none.interval)[:, 0] < 0.5 * np.diff(some.interval)[:, 0])


@pytest.mark.slow
def test_intervals_widen_with_fewer_runs() -> None:
    few, many = calibrated(COMPACT, 6), calibrated(COMPACT, 3)
    ratio = np.diff(few.interval)[:, 0] / np.diff(many.interval)[:, 0]
    assert 1.1 < np.exp(np.log(ratio).mean()) < 2.2  # the square root of 2, and fewer degrees of freedom


@pytest.mark.slow
def test_a_missing_effect_raises_chi_square_although_every_run_has_its_own_parameters() -> None:
    hidden = NOMINAL.with_effect("stribeck_friction", STRIBECK)
    conditions = HEAVY.conditions.take(range(0, 216, 12))
    time, rng = np.arange(0.0, 2.0, 0.004), np.random.default_rng(7)
    true = ensemble.signals(hidden, conditions, time)
    noisy = [getattr(true, name)[0] + rng.normal(0, HEAVY.sensors[name].noise or 0, (len(conditions), len(time)))
             for name in SIGNAL_UNITS]
    times = true.shifting_time[0] + rng.normal(0, 3e-3, len(conditions))
    measured = Recordings(conditions, times, Signals(time, *noisy))
    without = calibrate(measured, HEAVY)
    within = calibrate(measured, HEAVY, NOMINAL.with_effect("stribeck_friction", STRIBECK))
    assert without.chi_square["output_torque"] > 1.3
    assert max(within.chi_square[name] for name in SIGNAL_UNITS) < 1.1
    assert within.model.effects == hidden.effects


def test_a_calibration_whose_time_budget_ends_is_partial() -> None:
    whole, iterations = calibrated(COMPACT, 6), list[int]()
    partial = calibrate(recordings(COMPACT, 6), COMPACT, report=lambda _, count, __: iterations.append(count),
                        budget=0.0)
    assert iterations == [1]
    assert partial.spec()["partial"] == {"budget": 0.0, "done": ["iterations: 1"], "missing": ["convergence"]}
    assert not partial.converged
    assert calibration_text(partial).startswith("Partial result: the time budget of 0 s ended before the job.")
    assert whole.spec()["partial"] is None
    assert "Partial" not in calibration_text(whole)


def test_the_result_says_of_which_bench_it_is() -> None:
    spec = calibrated(COMPACT, 6).spec()
    assert (spec["bench"], spec["bench_digest"]) == ("compact", COMPACT.digest)
    assert spec["sensing_digest"] == COMPACT.sensing_digest
    assert Model.from_spec(spec["model"]).physics.digest == COMPACT.digest
    friction = spec["parameters"]["friction_coefficient"]
    assert friction["interval"][0] < friction["value"] < friction["interval"][1]
    assert friction["scatter"] > 0


def test_a_parameter_at_its_bound_is_named() -> None:
    narrow = replace(COMPACT, priors=tuple(
        replace(prior, lower=0.97) if name == "friction_coefficient" else prior
        for name, prior in zip(parameters.NAMES, COMPACT.priors, strict=True)))
    found = calibrate(recordings(COMPACT, 6), narrow)
    assert "friction_coefficient" in found.at_bound
    nominal = 1e5 * COMPACT.physics.nominal[parameters.NAMES.index("friction_coefficient")]  # N m/bar
    upper = COMPACT.prior("friction_coefficient").upper
    bounds = f"within {0.97 * nominal:.4g} to {upper * nominal:.4g} N m/bar"
    assert f"at a bound, no estimate: {bounds}" in calibration_text(found)
    assert f"friction coefficient ({bounds})" in " ".join(calibration_summary(found))


LINKED = {"current_gain", "temperature_gain", "initial_position", "friction_coefficient"}
"""Without pressure, these and the pressure bias undo a change of the gain: the torque depends on products alone."""


@pytest.mark.parametrize(("missing", "undetermined"), [
    (["pressure"], LINKED),
    pytest.param(["output_torque"], {"pressure_bias", "temperature_gain"}, marks=pytest.mark.slow),
    pytest.param(["input_speed"], set(), marks=pytest.mark.slow),
    pytest.param(["pressure", "output_torque"], LINKED, marks=pytest.mark.slow),
    pytest.param(["pressure", "input_speed", "output_speed"], LINKED, marks=pytest.mark.slow),
    pytest.param(["input_speed", "output_speed", "output_torque"],
                 {"pressure_bias", "temperature_gain", "initial_position"}, marks=pytest.mark.slow),
])
def test_what_the_other_signals_determine_is_recovered_and_the_rest_is_listed(
        missing: list[str], undetermined: set[str]) -> None:
    every = recordings(HEAVY, 12)
    assert every.signals is not None
    some = replace(every, signals=replace(every.signals, **dict.fromkeys(missing)))
    found = calibrate(some, HEAVY)
    assert found.converged
    assert f"Not measured: {', '.join(missing).replace('_', ' ')}" in calibration_text(found)
    assert ("Not determined by these recordings" in calibration_text(found)) == bool(undetermined)
    # Without pressure the other signals tell about as little of the pressure bias as its bounds.
    assert set(found.undetermined) - ({"pressure_bias"} if "pressure" in missing else set()) == undetermined
    assert set(found.signals) == set(SIGNAL_UNITS) - set(missing) == found.noise_correlation.keys()
    assert set(found.chi_square) == {*found.signals, "shifting_time"}
    assert np.max(np.abs(mean(found) - MEAN) / multiples(found, found.standard_error)) < 4
    if undetermined == LINKED and "output_torque" in found.signals:
        # Products that the torque shows are determined although their factors are not.
        values, true = (dict(zip(found.free, its, strict=True)) for its in (mean(found), MEAN))
        assert values["current_gain"] * values["friction_coefficient"] == pytest.approx(
            true["current_gain"] * true["friction_coefficient"], rel=0.01)


def test_nothing_is_listed_where_all_signals_are_recorded() -> None:
    found = calibrated(COMPACT, 6)
    assert found.undetermined == ()
    assert found.signals == tuple(SIGNAL_UNITS)
    assert "Not " not in calibration_text(found)


def test_recordings_that_cannot_be_calibrated_are_refused() -> None:
    few = recordings(HEAVY, 24)
    with pytest.raises(InvalidValue, match="too few for a calibration"):
        calibrate(few, HEAVY)
    with pytest.raises(InvalidValue, match="Record pressure, speeds or torque"):
        calibrate(replace(few, signals=None), HEAVY)
    with pytest.raises(InvalidValue, match="another bench"):
        calibrate(few, COMPACT, NOMINAL)
    some = recordings(COMPACT, 6)
    assert some.signals is not None
    silent = replace(some.signals, input_speed=np.zeros_like(some.signals.input_speed))
    with pytest.raises(InvalidValue, match="input_speed shows no noise"):
        calibrate(replace(some, signals=silent), COMPACT)


@pytest.mark.slow
def test_the_shipped_recordings_are_calibrated_from_the_nominal_start_although_an_effect_is_missing() -> None:
    shipped = Recordings.open(Path(__file__).parents[3] / "tables" / "measured.h5")
    some = np.arange(0, len(shipped), 12)
    assert shipped.signals is not None
    signals = Signals(shipped.signals.time, *(shipped.signals[name][some] for name in SIGNAL_UNITS))
    found = calibrate(Recordings(shipped.conditions.take(some), shipped.measured_time[some], signals), HEAVY)
    assert found.converged
    assert found.at_bound == ()
    assert found.rms_after < 0.7 * found.rms_before
    assert found.chi_square["output_torque"] > 2


def test_a_calibration_simulates_with_the_measured_laws_of_its_start() -> None:
    law, taken = MeasuredLaw("load torque", "output speed", (0.0, 60.0), (0.0, 30.0), relative=False), recordings(HEAVY)
    assert taken.signals is not None
    observations = Observations(taken, taken.signals, HEAVY, HEAVY.uncertain, np.array(NOMINAL.parameters),
                                NOMINAL.coefficients(), (law,))
    found = observations.simulate(np.ones((1, 3, len(HEAVY.uncertain))), np.arange(3)).shifting_time
    expected, without = (ensemble.shifting_times(model, taken.conditions.take(range(3)), accuracy=ACCURACY)[0][0]
                         for model in (NOMINAL.with_law(law), NOMINAL))
    np.testing.assert_array_equal(found, expected)
    assert not np.any(found == without)
