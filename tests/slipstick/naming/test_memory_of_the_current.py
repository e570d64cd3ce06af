"""A current that depends on its past: by play, and by relaxation towards its average over a time."""

from dataclasses import replace

import numpy as np

from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.naming.block import finest
from slipstick.naming.filters import valve_response
from slipstick.naming.fit import fit
from slipstick.naming.forward import forward
from slipstick.naming.measured import law_points
from slipstick.naming.past_current import remembered
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock
from slipstick.recordings import Signals
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT, SEED = 24, 5
PAST = ("valve current", "past current")
TIME = 2.2
"""Of the average, in delays of the valve: between those of the columns."""


def relaxing(size: float) -> ValveBlock:
    """A valve block in whose recordings the current is larger while it rises, by a share `size` of its excess."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    block = ValveBlock(scene)
    delay = scene.value("current_delay")
    excess = block.current - lagged_signal(block.current, block.times, np.array([TIME * delay]))
    demand = scene.value("current_gain") * size * np.maximum(excess, 0.0)
    change = valve_response(scene.step / 2, demand[:, None], np.full(COUNT, delay))[:, 0, ::2]
    signals = {name: scene.measured(name) for name in scene.signals.names}
    signals["pressure"] = signals["pressure"] + change
    return ValveBlock(replace(scene, recordings=replace(scene.recordings, signals=Signals(scene.time, **signals))))


def test_a_current_that_is_larger_while_it_rises_depends_on_its_past() -> None:
    block = relaxing(0.3)
    plain = fit(block)
    fits, findings = forward({"valve": plain}, NamingSettings())
    assert [one.pair for one in findings] == [PAST]
    assert fits["valve"].chi2.mean() - 1 < 0.05 * (plain.chi2.mean() - 1)
    assert block.finer[PAST] > 0
    second = findings[0].next_best  # another pair of the block, which trails
    assert second is not None
    assert second.pair != PAST
    assert 0 < findings[0].lead <= second.behind
    assert second.nats < findings[0].nats


def test_play_alone_does_not_explain_it() -> None:
    block = relaxing(0.3)
    plain, play = fit(block), fit(block, (PAST,))
    block.finer = {PAST: finest(block, PAST)}
    finer = fit(block, (PAST,))
    assert play.chi2.mean() - 1 > 0.2 * (plain.chi2.mean() - 1)
    assert finer.chi2.mean() - 1 < 0.02 * (plain.chi2.mean() - 1)


def test_without_relaxation_nothing_depends_on_the_past() -> None:
    assert forward({"valve": fit(relaxing(0.0))}, NamingSettings())[1] == []


def test_the_width_of_play_does_not_depend_on_the_columns_of_relaxation() -> None:
    model = Model(HEAVY.physics).with_effect("valve_hysteresis", {"width": 0.012})
    block = ValveBlock(scene_of(HEAVY, model, COUNT, SEED))
    widths = []
    for finer in range(finest(block, PAST) + 1):
        block.finer = {PAST: finer}
        widths.append(law_points(fit(block, (PAST,)), PAST))
    for one in widths:
        assert abs(one.change[0] - 0.012) < 4 * one.std[0]


def test_more_pieces_follow_a_law_that_is_steep_where_the_current_turns_round() -> None:
    block = ValveBlock(scene_of(HEAVY, Model(HEAVY.physics), COUNT))
    delay = block.scene.value("current_delay")
    excess = block.current - lagged_signal(block.current, block.times, np.array([TIME * delay]))
    law = np.tanh(excess / (0.03 * np.abs(excess).max())).ravel()
    left = []
    for finer in (0, 2, finest(block, PAST)):
        columns = remembered(block.current, block.times, delay, finer).transpose(0, 2, 1).reshape(law.size, -1)
        left.append(float(np.linalg.norm(law - columns @ np.linalg.lstsq(columns, law)[0]) / np.linalg.norm(law)))
    assert left[1] > 0.05
    assert left[2] < 0.02
