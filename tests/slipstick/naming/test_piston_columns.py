"""Columns of what laws add to the closing piston are derivatives of the torque, beside laws of every other kind."""

import numpy as np
import pytest

from slipstick.bench import parameters
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming.block import Laws, Pair
from slipstick.naming.piston import ClutchBlock
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED, STEP = 24, 5, 1e-4
PAIRS: list[Pair] = [("chamber pressure", "input speed"), ("piston rate", "pressure"), ("piston gain", "run order"),
                     ("clearance", "pressure"), ("friction lag", "time"), ("friction coefficient", "slip")]
BESIDE: dict[str, list[Pair]] = {
    "nothing": [], "tables": [("piston rate", "piston rate"), ("piston rate", "piston position")],
    "drag": [("piston rate", "direction")], "friction": [("friction lag", "output speed"), ("film torque", "slip")]}


@pytest.fixture(scope="module")
def block() -> ClutchBlock:
    return block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED))


@pytest.mark.parametrize("pair", PAIRS, ids=" over ".join)
@pytest.mark.parametrize("beside", BESIDE)
@pytest.mark.parametrize("clock", [0.0, 7e-4])
def test_columns_are_derivatives_of_the_torque(block: ClutchBlock, pair: Pair, beside: str, clock: float) -> None:
    rng = np.random.default_rng(SEED)
    points = 0.02 * rng.standard_normal((COUNT, len(block.random)))
    laws: Laws = [(one, 0.1 * np.abs(rng.standard_normal(block.size(one)))) for one in BESIDE[beside]]
    if pair[0] == "friction lag":  # which is a law that is held, so that it delays the torque
        laws = [*laws, (pair, 0.1 * np.ones(block.size(pair)))]
    block.at(np.array([clock]))
    torque = block.base(points, laws)
    held = dict(laws).get(pair, np.zeros(block.size(pair)))
    others = [one for one in laws if one[0] != pair]
    moved = [block.base(points, [*others, (pair, held + step)]) for step in STEP * np.eye(block.size(pair))]
    change = np.stack([(one - torque) / STEP for one in moved], axis=1)
    columns = block.basis(pair, points, laws, torque)
    assert np.abs(change).max() > 0
    off = np.abs(columns - change) / np.abs(change).max()
    assert np.quantile(off, 0.9999) < 0.02  # a sample at which the difference steps over full contact is off
    assert np.sqrt(np.mean((columns - change) ** 2) / np.mean(change**2)) < 0.02


def test_plates_are_as_far_apart_as_in_the_simulator_where_they_wear_by_more_than_the_piston_begins_with() -> None:
    pair, nominal = ("clearance", "run order"), dict(zip(parameters.NAMES, HEAVY.physics.nominal, strict=True))
    wear = 2 * nominal["initial_position"] * nominal["temperature_gain"]
    law = MeasuredLaw(*pair, (0.0, COUNT - 1.0), (-wear, wear), relative=False)
    block = block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics).with_law(law), COUNT))
    its, points = block.law(pair), np.zeros((COUNT, len(block.random)))
    assert its.x is not None
    coefficients = np.linalg.lstsq(its.onto, np.interp(its.x, law.at, law.change))[0]
    before = block.scene.time < 0.05  # the plates close
    left, lacking = ((block.measured - block.base(points, laws))[:, before] for laws in ([(pair, coefficients)], []))
    assert np.abs(left).max() < 0.01 * np.abs(lacking).max()
