"""What is computed without a basis, or by a shorter recurrence, is what the longer way gives."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming.block import finest
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.sensor_errors import as_read, pairs_of, read_too_much, reading
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

SENSORS = "pressure sensor", "input speed sensor", "output speed sensor", "output torque sensor"
PISTON = ("piston rate", "piston rate"), ("piston rate", "piston position")
COUNT, SEED = 12, 3


def clutch_of() -> ClutchBlock:
    block = block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED))
    assert isinstance(block, ClutchBlock)
    return block


@pytest.mark.parametrize("sensor", SENSORS)
def test_an_error_of_a_sensor_is_the_sum_over_its_basis(sensor: str) -> None:
    block = clutch_of()
    scene = replace(block.scene, of_plates=of_plates(block.scene, block.in_contact))
    signal = scene.measured(sensor.removesuffix(" sensor").replace(" ", "_"))
    asked = [(on, finer) for pair in pairs_of(scene, True, sensor) for on in pair[1:]
             for finer in range(finest(block, pair) + 1)]
    assert {"offset", "gain", "lag", "time", "run order", "heat", "current"} <= {on for on, _ in asked}
    for on, finer in asked:
        basis = reading(scene, sensor, on, signal, finer)
        c = np.random.default_rng(SEED).standard_normal(basis.shape[1])
        expected = c @ basis
        np.testing.assert_allclose(read_too_much(scene, sensor, on, signal, c, finer), expected, rtol=0,
                                   atol=1e-12 * np.abs(expected).max(), err_msg=f"{sensor} over {on}, finer {finer}")


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize(("on", "finer"), [("gain", 0), ("gain", 2), ("lag", 0), ("lag", 1), ("lag", 2)])
def test_changes_are_read_as_the_error_changes_with_the_signal(sensor: str, on: str, finer: int) -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    signal = 0.97 * scene.smooth[sensor.removesuffix(" sensor").replace(" ", "_")]  # off the last knot, where it bends
    rng = np.random.default_rng(SEED)
    law, c = (sensor, on), rng.standard_normal(reading(scene, sensor, on, signal, finer).shape[1])
    change = np.stack([signal * np.sin(7 * scene.time), np.abs(signal)], axis=1)
    step = 1e-7
    expected = np.stack([one + (read_too_much(scene, sensor, on, signal + step * one, c, finer)
                                - read_too_much(scene, sensor, on, signal - step * one, c, finer)) / (2 * step)
                         for one in change.transpose(1, 0, 2)], axis=1)
    found = as_read(scene, change, signal, [(law, c)], sensor, {law: finer})
    assert np.linalg.norm(found - expected) < 1e-5 * np.linalg.norm(expected - change)
    assert np.linalg.norm(expected - change) > 0.1 * np.linalg.norm(change)


@pytest.mark.parametrize("pair", PISTON)
def test_a_piston_without_a_law_moves_as_one_with_a_law_of_zeros(pair: tuple[str, str]) -> None:
    block = clutch_of()
    points = 0.05 * np.random.default_rng(SEED).standard_normal((COUNT, len(block.random)))
    for clock in (0.0, 0.4 * block.scene.step, -0.7 * block.scene.step):
        block.at(np.array([clock]))
        plain = block.base(points)
        np.testing.assert_allclose(block.base(points, [(pair, np.zeros(block.size(pair)))]), plain, rtol=0,
                                   atol=1e-10 * plain.max())
