"""Calibration on simulated recordings with known parameters, and on the shipped recordings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick import calibration
from slipstick.bench import Sensor, parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.processing import sensor_noise
from tests.benches import COMPACT, HEAVY, NOMINAL

TRUE_MULTIPLIERS = {"current_delay": 1.04, "current_bias": 0.94, "current_gain": 1.03, "pressure_bias": 0.93,
                    "temperature_gain": 1.05, "initial_position": 1.08, "friction_coefficient": 0.95}
NOISE = {"pressure": 0.05, "input_speed": 0.25, "output_speed": 0.08, "output_torque": 6.0}


def simulated_recordings(model: Model, step: int = 5, seed: int = 7) -> Recordings:
    """Recordings of `model` under every `step`-th condition of the paper, with sensor noise only."""
    conditions = HEAVY.conditions.take(range(0, 216, step))
    time, rng = np.arange(0.0, 2.0, 0.002), np.random.default_rng(seed)
    response = ensemble.signals(model, conditions, time, accuracy=ensemble.TIGHT)
    shape = (len(conditions), len(time))
    noisy = [getattr(response, name)[0] + rng.normal(0, std, shape) for name, std in NOISE.items()]
    measured_time = response.shifting_time[0] + rng.normal(0, 3e-3, len(conditions))
    return Recordings(conditions, measured_time, Signals(time, *noisy))


def true_model() -> Model:
    nominal = dict(zip(parameters.NAMES, NOMINAL.parameters, strict=True))
    return NOMINAL.with_parameters({name: nominal[name] * factor for name, factor in TRUE_MULTIPLIERS.items()})


@pytest.fixture(scope="module")
def calibrated() -> calibration.Calibration:
    return calibration.calibrate(simulated_recordings(true_model()), HEAVY)


def test_estimates_are_within_their_standard_errors_of_the_truth(calibrated: calibration.Calibration) -> None:
    truth = np.array(true_model().parameters)[[parameters.index(name) for name in calibrated.free]]
    values = np.array(calibrated.model.parameters)[[parameters.index(name) for name in calibrated.free]]
    assert np.max(np.abs(values - truth) / calibrated.standard_error) < 4
    assert np.max(calibrated.standard_error / truth) < 0.02
    assert calibrated.at_bound == ()


def test_chi_square_is_one_for_pure_noise_and_larger_for_missing_physics(calibrated: calibration.Calibration) -> None:
    assert all(0.9 < value < 1.1 for name, value in calibrated.chi_square.items() if name != "shifting_time")
    assert 0.5 < calibrated.chi_square["shifting_time"] < 1.7  # only 44 values
    hidden = true_model().with_effect("stribeck_friction", {"strength": 0.22, "decay_speed": 25.0})
    assert calibration.calibrate(simulated_recordings(hidden), HEAVY).chi_square["output_torque"] > 1.3


def test_effects_of_the_start_model_are_simulated() -> None:
    effect = {"strength": 0.22, "decay_speed": 25.0}
    hidden = true_model().with_effect("stribeck_friction", effect)
    start = NOMINAL.with_effect("stribeck_friction", effect)
    calibrated = calibration.calibrate(simulated_recordings(hidden), HEAVY, start)
    assert calibrated.chi_square["output_torque"] < 1.1
    assert calibrated.model.effects == hidden.effects


def test_too_few_engagements_and_signals_without_noise_are_rejected() -> None:
    with pytest.raises(InvalidValue, match="too few for a calibration"):
        calibration.calibrate(simulated_recordings(NOMINAL, step=24), HEAVY)
    recordings = simulated_recordings(NOMINAL, step=12)
    assert recordings.signals is not None
    coarse = replace(recordings.signals, input_speed=np.round(recordings.signals.input_speed / 5) * 5)
    with pytest.raises(InvalidValue, match="input_speed shows no noise"):
        calibration.calibrate(replace(recordings, signals=coarse), HEAVY)


def test_noise_is_estimated_from_the_signals_alone() -> None:
    signals = simulated_recordings(NOMINAL).signals
    assert signals is not None
    estimated = sensor_noise(signals)
    for name, std in NOISE.items():
        assert estimated[name] == pytest.approx(std, rel=0.05)


def test_a_parameter_at_its_bound_is_named() -> None:
    out_of_bounds = NOMINAL.with_parameters({"friction_coefficient": 3.2e-4 * 1.7})
    calibrated = calibration.calibrate(simulated_recordings(out_of_bounds, step=12), HEAVY)
    assert "friction_coefficient" in calibrated.at_bound


def test_calibration_on_the_shipped_recordings_reduces_the_shifting_time_residual() -> None:
    # An independent calibration gave 48.7 ms before and 27.1 ms after on these recordings.
    calibrated = calibration.calibrate(Recordings.open(Path(__file__).parents[2] / "tables" / "measured.h5"), HEAVY)
    assert calibrated.rms_before == pytest.approx(48.7e-3, rel=0.01)
    assert calibrated.rms_after == pytest.approx(27.1e-3, rel=0.05)
    assert calibrated.at_bound == ()


def test_recordings_without_signals_are_rejected() -> None:
    with pytest.raises(InvalidValue, match="Record pressure, speeds and torque"):
        calibration.calibrate(replace(simulated_recordings(NOMINAL, step=24), signals=None), HEAVY)


def test_a_bench_that_does_not_fit_is_rejected() -> None:
    recordings = simulated_recordings(NOMINAL, step=12)
    with pytest.raises(InvalidValue, match="made for another bench than 'compact'"):
        calibration.calibrate(recordings, COMPACT, NOMINAL)
    silent = replace(HEAVY, sensors={**HEAVY.sensors, "shifting_time": Sensor()})
    with pytest.raises(InvalidValue, match="does not state the noise of the shifting time"):
        calibration.calibrate(recordings, silent)
