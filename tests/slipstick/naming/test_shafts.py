"""Load and input shaft with the converter: breakaway, errors of its curve, and columns that are derivatives."""

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming import load
from slipstick.naming.block import Laws, Pair
from slipstick.naming.drive import KNOTS, Drive
from slipstick.naming.input import InputBlock
from slipstick.naming.linear_model import columns_of
from slipstick.naming.load import LoadBlock
from slipstick.naming.scene import Scene
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT, STEP, CLOSE = 13, 1e-3, 0.1


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_of(HEAVY, Model(HEAVY.physics), COUNT)


@pytest.mark.parametrize(("moving", "begins"), [
    ("0011111", 2), ("1111111", 0), ("0100111", 4), ("0011100", 2), ("1101110", 3), ("0000000", 0)])
def test_a_load_breaks_away_where_its_longest_motion_begins(moving: str, begins: int) -> None:
    assert load._begins(np.array([[one == "1" for one in moving]])).tolist() == [begins]


def test_a_motion_for_a_moment_does_not_take_the_kick_with_it(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    block, points = LoadBlock(scene), np.zeros((COUNT, 5))
    points[:, 4] = 0.3
    still = block.base(points).copy()
    first = int(np.argmax(block._moving[0]))
    block.torque = block.torque.copy()
    block.torque[0, 3] = 2 * block.brake[0] + 10
    flicker = block.base(points)
    assert block._moving[0].argmax() < 5 < first - 1
    assert not block._moving[0, first - 1]  # it came to rest again
    kick = block._kicks(points)[0, 1].max()
    assert np.abs(flicker - still)[0, first + 3:].max() < 0.1 * 0.3 * kick
    monkeypatch.setattr(load, "_begins", lambda moving: np.argmax(moving, axis=1))  # as it was
    assert np.abs(block.base(points) - still)[0, first + 3:].max() > 0.5 * 0.3 * kick


LOADED: dict[Pair, np.ndarray] = {("output speed sensor", "gain"): np.full(2, 0.1),
                                  ("load torque", "output speed"): np.full(9, 0.1)}
DRIVEN: dict[Pair, np.ndarray] = {("input speed sensor", "gain"): np.full(2, 0.1),
                                  ("input torque", "input speed"): np.full(9, 0.1),
                                  ("converter torque", "run order"): np.full(3, 0.2)}


@pytest.mark.parametrize(("kind", "laws", "moved"), [(LoadBlock, LOADED, 3), (InputBlock, DRIVEN, 4)])
def test_columns_are_derivatives_where_parameters_and_conditions_are_off(
        scene: Scene, kind: type[LoadBlock | InputBlock], laws: dict[Pair, np.ndarray], moved: int) -> None:
    """The noise of the torque, which columns do not contain, is none here."""
    block = kind(scene)
    points = np.tile([*[0.05] * moved, *[0.0] * (len(block.random) - moved)], (COUNT, 1))
    shared = np.concatenate([[1.5 * scene.step], np.full(len(block.fixed) - 1, 0.02)])
    held = list(laws.items())
    there = block.at(shared)
    predicted = there.base(points, held)
    columns = columns_of(there, points, shared, held, predicted, list(laws))

    def off(column: np.ndarray, points: np.ndarray, shared: np.ndarray, laws: Laws) -> float:
        change = (block.at(shared).base(points, laws) - predicted)[block.counted] / STEP
        return float(np.linalg.norm(column[block.counted] - change) / np.linalg.norm(change))

    for j, step in enumerate(STEP * np.eye(len(shared))):
        unit = scene.step if j == 0 else 1.0
        assert off(columns.fixed[:, j] * unit, points, shared + step * unit, held) < CLOSE
    for pair, c in held:
        for j in (0, len(c) - 1):
            changed = {**laws, pair: c + STEP * np.eye(len(c))[j]}
            assert off(columns.of_laws[pair][:, j], points, shared, list(changed.items())) < CLOSE
    for j in range(moved):
        step = STEP * np.eye(len(block.random))[j]
        assert off(columns.own[:, j], points + step, shared, held) < CLOSE


# The converter with errors of its curve: smooth ones are followed by few numbers.


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
