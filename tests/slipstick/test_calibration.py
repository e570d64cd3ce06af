"""Calibration on recordings whose parameters are known, and on the shipped ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick import calibration
from slipstick.clutch import ensemble, parameters
from slipstick.clutch.conditions import paper_conditions
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.processing import sensor_noise

TRUE_MULTIPLIERS = {"current_delay": 1.04, "current_bias": 0.94, "current_gain": 1.03, "pressure_bias": 0.93,
                    "temperature_gain": 1.05, "initial_position": 1.08, "friction_coefficient": 0.95}
NOISE = {"pressure": 0.05, "input_speed": 0.25, "output_speed": 0.08, "output_torque": 6.0}


def bench(model: Model, every: int = 5, seed: int = 7) -> Recordings:
    """Recordings of `model` on every fifth condition, with sensor noise and nothing else."""
    conditions = paper_conditions().take(range(0, 216, every))
    time, rng = np.arange(0.0, 2.0, 0.002), np.random.default_rng(seed)
    response = ensemble.signals(model, conditions, time, accuracy=ensemble.TIGHT)
    shape = (len(conditions), len(time))
    noisy = [getattr(response, name)[0] + rng.normal(0, std, shape) for name, std in NOISE.items()]
    measured_time = response.shifting_time[0] + rng.normal(0, 3e-3, len(conditions))
    return Recordings(conditions, measured_time, Signals(time, *noisy))


def true_model() -> Model:
    nominal = dict(zip(parameters.NAMES, Model().parameters, strict=True))
    return Model().with_parameters({name: nominal[name] * factor for name, factor in TRUE_MULTIPLIERS.items()})


@pytest.fixture(scope="module")
def found() -> calibration.Calibration:
    return calibration.calibrate(bench(true_model()))


def test_finds_the_parameters_within_their_standard_errors(found: calibration.Calibration) -> None:
    truth = np.array(true_model().parameters)[[parameters.index(name) for name in found.free]]
    values = np.array(found.model.parameters)[[parameters.index(name) for name in found.free]]
    assert np.max(np.abs(values - truth) / found.standard_error) < 4
    assert np.max(found.standard_error / truth) < 0.02
    assert found.at_bound == ()


def test_chi_square_is_one_where_only_noise_is_left_and_not_where_physics_is_missing(
    found: calibration.Calibration,
) -> None:
    assert all(0.9 < value < 1.1 for name, value in found.chi_square.items() if name != "shifting_time")
    assert 0.5 < found.chi_square["shifting_time"] < 1.7  # 44 values only
    hidden = true_model().with_effect("stribeck_friction", {"strength": 0.22, "decay_speed": 25.0})
    assert calibration.calibrate(bench(hidden)).chi_square["output_torque"] > 1.3


def test_effects_of_the_start_model_are_simulated() -> None:
    effect = {"strength": 0.22, "decay_speed": 25.0}
    hidden = true_model().with_effect("stribeck_friction", effect)
    found = calibration.calibrate(bench(hidden), Model().with_effect("stribeck_friction", effect))
    assert found.chi_square["output_torque"] < 1.1
    assert found.model.effects == hidden.effects


def test_too_few_engagements_and_signals_without_noise_are_refused() -> None:
    with pytest.raises(InvalidValue, match="too few to calibrate on"):
        calibration.calibrate(bench(Model(), every=24))
    recordings = bench(Model(), every=12)
    assert recordings.signals is not None
    coarse = replace(recordings.signals, input_speed=np.round(recordings.signals.input_speed / 5) * 5)
    with pytest.raises(InvalidValue, match="input_speed shows no noise"):
        calibration.calibrate(replace(recordings, signals=coarse))


def test_noise_is_estimated_from_the_signals_alone() -> None:
    signals = bench(Model()).signals
    assert signals is not None
    estimated = sensor_noise(signals)
    for name, std in NOISE.items():
        assert estimated[name] == pytest.approx(std, rel=0.05)


def test_a_parameter_at_its_bound_is_named() -> None:
    beyond = Model().with_parameters({"friction_coefficient": 3.2e-4 * 1.7})
    found = calibration.calibrate(bench(beyond, every=12))
    assert "friction_coefficient" in found.at_bound


def test_shipped_recordings_bring_the_shifting_time_residual_down() -> None:
    # An independent reviewer measured 48.7 ms before and 27.1 ms after on these recordings.
    found = calibration.calibrate(Recordings.open(Path(__file__).parents[2] / "tables" / "measured.h5"))
    assert found.rms_before == pytest.approx(48.7e-3, rel=0.01)
    assert found.rms_after == pytest.approx(27.1e-3, rel=0.05)
    assert found.at_bound == ()


def test_recordings_without_signals_are_refused() -> None:
    with pytest.raises(InvalidValue, match="Record pressure, speeds and torque"):
        calibration.calibrate(replace(bench(Model(), every=24), signals=None))
