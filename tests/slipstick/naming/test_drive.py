"""The converter with errors of its curve: smooth ones are followed by few numbers."""

import numpy as np
import pytest

from slipstick.naming.drive import KNOTS, Drive
from tests.benches import HEAVY


@pytest.fixture(scope="module")
def drive() -> Drive:
    ratio = np.linspace(0, 0.99, 500)
    return Drive.of(HEAVY.physics.curves, np.array([150.0]), 150 * ratio[None])


def test_a_smooth_error_of_the_curve_is_followed_between_its_knots(drive: Drive) -> None:
    ratio = np.linspace(drive.knots[0], drive.knots[-1], 777)[None]
    error = 0.02 * np.cos(3 * np.pi * ratio)
    left = error - 0.02 * np.cos(3 * np.pi * drive.knots) @ drive.basis(ratio)[0]
    straight = error - np.interp(ratio, drive.knots, 0.02 * np.cos(3 * np.pi * drive.knots))
    assert np.sqrt((left**2).mean()) < 0.1 * np.sqrt((straight**2).mean())


def test_the_basis_is_one_at_its_knot_and_constant_beyond_the_outermost(drive: Drive) -> None:
    np.testing.assert_allclose(drive.basis(drive.knots[None])[0], np.eye(KNOTS), atol=2e-3)
    last, beyond = drive.basis(np.array([[drive.knots[-1], 1.0]]))[0].T
    np.testing.assert_allclose(beyond, last, atol=2e-3)


def test_a_corrected_converter_drives_as_the_one_with_errors(drive: Drive) -> None:
    errors = 0.03 * np.cos(3 * np.pi * drive.knots)
    motor, speed = np.full((1, 300), 150.0), 150 * np.linspace(0.05, 0.95, 300)[None]
    corrected = drive.corrected(150.0, 0.0, errors)
    torque = np.interp(speed / motor, corrected.speed_ratio, corrected.torque_ratio) * (
        motor / np.interp(speed / motor, corrected.speed_ratio, corrected.capacity_factor)) ** 2
    np.testing.assert_allclose(torque, drive.torque_at(speed, motor, 0.0, errors), rtol=2e-3)
