"""A lag of the friction and one of the torque sensor, told apart by what the torque drives."""

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming.curved import CurvedFit
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.restarts import settled
from slipstick.naming.search import search
from slipstick.naming.torque_lag import OF_FRICTION, gained_elsewhere
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED, LATE = 24, 5, 0.02


def late(effect: str) -> tuple[CurvedFit, dict[str, BlockFit]]:
    """The clutch with a lag, and what the torque drives, of engagements with an effect of `LATE` s."""
    scene = scene_of(HEAVY, Model(HEAVY.physics).with_effect(effect, {"lag": LATE}), COUNT, SEED)
    block, contact = block_of("clutch", scene), fit(block_of("contact", scene))
    assert isinstance(block, ClutchBlock)
    clutch = settled(block, search(block, np.zeros(1), ()), np.zeros(1), (OF_FRICTION,),
                     {OF_FRICTION: np.zeros(block.size(OF_FRICTION))})
    return clutch, {"contact": contact, **{name: fit(block_of(name, scene)) for name in ("load", "input")}}


@pytest.mark.parametrize(("effect", "is_of_sensor"), [
    ("friction_buildup_lag", False), ("output_torque_sensor_lag", True)])
def test_load_and_input_tell_whose_lag_it_is(effect: str, is_of_sensor: bool) -> None:
    clutch, others = late(effect)
    gain = gained_elsewhere(clutch, others)
    assert (gain.sum() > 12) == is_of_sensor
    assert (gain.sum() < -12) == (not is_of_sensor)
    assert not gained_elsewhere(clutch, {"contact": others["contact"]}).any()
