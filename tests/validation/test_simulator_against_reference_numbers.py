"""Comparison of the simulator with converged results of an independent implementation (tests/validation/README.md)."""

from pathlib import Path

import numpy as np
import pytest

from slipstick.clutch import ensemble
from tests.benches import HEAVY, NOMINAL

DATA = Path(__file__).parent / "data"
AXES = ("pressure_bias", "initial_position")
POINTS = np.array([[1, 1], [0.5, 0.5], [0.5, 1.5], [1.5, 0.5], [1.5, 1.5]])
CONDITIONS = HEAVY.conditions


def reference_times() -> np.ndarray:
    return np.loadtxt(DATA / "shifting_times.csv", delimiter=",", skiprows=1)[:, 1:].T


def test_conditions_agree_with_the_reference() -> None:
    reference = np.genfromtxt(DATA / "conditions.csv", delimiter=",", names=True)
    initial, column = ensemble.initial_input_speed(HEAVY.physics.converter, np.array([NOMINAL.parameters]), CONDITIONS)
    np.testing.assert_array_equal(reference["profile"], CONDITIONS.current_profile)
    np.testing.assert_allclose(reference["motor_speed_rad_s"], CONDITIONS.motor_speed, rtol=1e-10)
    np.testing.assert_array_equal(reference["load_inertia_kg_m2"], CONDITIONS.load_inertia)
    np.testing.assert_array_equal(reference["brake_torque_N_m"], CONDITIONS.brake_torque)
    np.testing.assert_allclose(reference["initial_input_speed_rad_s"], initial[0, column], rtol=1e-9)


def test_tight_shifting_times_agree_on_all_conditions_and_points() -> None:
    times, status = ensemble.shifting_times(NOMINAL, CONDITIONS, AXES, POINTS, ensemble.TIGHT)
    assert np.all(status == ensemble.LOCKED)
    assert np.max(np.abs(times - reference_times())) < 1e-5


def test_a_slightly_wrong_model_does_not_agree() -> None:
    wrong = NOMINAL.with_parameters({"film_coefficient": 8e-5 * 1.02})
    times, _ = ensemble.shifting_times(wrong, CONDITIONS, AXES, POINTS, ensemble.TIGHT)
    assert np.max(np.abs(times - reference_times())) > 1e-5


@pytest.mark.parametrize("condition", [0, 100, 215])
def test_tight_signals_agree_to_1e_4_of_their_range(condition: int) -> None:
    rows = np.loadtxt(DATA / "trajectories.csv", delimiter=",", skiprows=1)
    rows = rows[rows[:, 0] == condition]
    response = ensemble.signals(NOMINAL, CONDITIONS.take([condition]), rows[:, 1], accuracy=ensemble.TIGHT)
    for column, name in enumerate(
        ("pressure", "input_speed", "output_speed", "output_torque", "piston_position"), start=2
    ):
        error = np.abs(getattr(response, name)[0, 0] - rows[:, column])
        assert np.max(error) < 1e-4 * np.ptp(rows[:, column]), name


@pytest.mark.slow
def test_default_accuracy_is_within_1e_4_s_over_the_whole_default_grid() -> None:
    grid = np.linspace(0.5, 1.5, 50)
    points = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    default, status = ensemble.shifting_times(NOMINAL, CONDITIONS, AXES, points)
    tight, _ = ensemble.shifting_times(NOMINAL, CONDITIONS, AXES, points, ensemble.TIGHT)
    assert np.all(status == ensemble.LOCKED)
    assert np.max(np.abs(default - tight)) < 1e-4
