"""Naming blocks on signals without noise: predictions, columns against differences, and effects of the simulator."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.naming import bases
from slipstick.naming.block import Block
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.piston import ClutchBlock
from tests.benches import BENCHES, HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

both = pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
COUNT, NAMES = 7, ("valve", "load", "input", "lock", "clutch", "contact")
each = pytest.mark.parametrize("name", NAMES)

WITHIN = {"valve": 0.05, "load": 0.8, "input": 0.9, "lock": 0.2, "clutch": 0.5, "contact": 0.1}
"""Largest error of a prediction in noise levels of the sensor; load and input have that of the jump at lock-up."""


@cache
def blocks(bench: Bench) -> dict[str, Block]:
    scene = scene_of(bench, Model(bench.physics), COUNT)
    return {name: block_of(name, scene) for name in NAMES}


def nominal(block: Block) -> np.ndarray:
    return np.zeros((len(block.measured), len(block.random)))


@both
@each
def test_nominal_parameters_explain_the_signal_and_others_do_not(bench: Bench, name: str) -> None:
    block = blocks(bench)[name]
    points = nominal(block)
    noise = block.noise(points).std
    predicted = block.base(points)
    error = np.abs((block.measured - predicted) * block.counted).max()
    assert error < WITHIN[name] * noise
    moved = block.base(points + 0.05 * np.eye(len(block.random))[0])
    assert np.abs((block.measured - moved) * block.counted).max() > noise


@both
@each
def test_columns_are_derivatives_of_the_prediction(bench: Bench, name: str) -> None:
    block, h = blocks(bench)[name], 2e-4
    points = nominal(block)
    own, fixed = block.columns(points, (), block.base(points))
    assert own.shape[1] == len(block.random)
    assert fixed.shape[1] == len(block.fixed) == len(block.fixed_std)
    for parameter, column, step in zip(block.random, own.transpose(1, 0, 2), h * np.eye(len(own[0])), strict=True):
        change = (block.base(points + step) - block.base(points - step)) / (2 * h)
        close(column, change, block.counted, f"{name}: {parameter}")


@both
@each
def test_a_block_at_other_shared_values_is_another_one(bench: Bench, name: str) -> None:
    block = blocks(bench)[name]
    points, shared = nominal(block), np.full(len(block.fixed), 0.5 * block.scene.step)
    before = block.base(points)
    late = block.at(shared)
    assert np.abs(late.base(points) - before)[block.counted].max() > 0
    np.testing.assert_array_equal(block.base(points), before)
    np.testing.assert_array_equal(late.at(np.zeros(len(block.fixed))).base(points), before)


@both
def test_what_engagements_share_is_integrated_with_the_input_speed(bench: Bench) -> None:
    block = blocks(bench)["input"]
    assert isinstance(block, InputBlock)
    points, about, h = nominal(block), 0.02 * np.random.default_rng(1).standard_normal(len(block.fixed)), 1e-4
    about[0] *= block.scene.step
    block = block.at(about)
    fixed = block.columns(points, (), block.base(points))[1]
    for name, column, step in zip(block.fixed, fixed.transpose(1, 0, 2), h * np.eye(len(about)), strict=True):
        after, before = (block.at(about + sign * step).base(points) for sign in (1, -1))
        close(column, (after - before) / (2 * h), block.counted, name)


@both
@each
def test_bases_are_derivatives_of_the_prediction(bench: Bench, name: str) -> None:
    block, h = blocks(bench)[name], 1e-3
    points = nominal(block)
    base = block.base(points)
    for pair in block.pairs(rare=True):
        columns = block.basis(pair, points, (), base)
        for j in {0, columns.shape[1] - 1} if columns.shape[1] else ():
            step = h * np.eye(columns.shape[1])[j]
            change = (block.base(points, [(pair, step)]) - base) / h
            close(columns[:, j], change, block.counted, f"{name}: {pair} {j}")


@both
def test_a_torque_that_is_read_late_is_the_one_between_two_samples(bench: Bench) -> None:
    scene = scene_of(bench, Model(bench.physics), COUNT)
    signals = scene.recordings.signals
    assert signals is not None
    late, model = 0.5 * scene.step, Model(bench.physics)
    then = np.maximum(signals.time - late, 0.0)
    fine = np.unique(np.concatenate([signals.time, then]))
    true = ensemble.simulate(bench.physics.curves, np.array([bench.physics.nominal]), model.coefficients()[None],
                             scene.recordings.conditions, fine, ensemble.TIGHT)
    read = true.output_torque[0][:, np.searchsorted(fine, then)]
    block = blocks(bench)["clutch"]
    assert isinstance(block, ClutchBlock)
    points = nominal(block)
    counted = block.counted & (scene.time > 0.01)
    left = {delay: np.abs((read - block.at(np.array([delay])).base(points)) * counted).max() for delay in (late, 0.0)}
    between = bases.delayed(block.base(points), late / scene.step)  # on straight lines
    assert left[late] < WITHIN["clutch"] * block.noise(points).std
    assert left[0.0] > 10 * left[late]
    assert np.abs((read - between) * counted).max() > 3 * left[late]


def close(column: np.ndarray, change: np.ndarray, counted: np.ndarray, what: str) -> None:
    """Both agree to 5 % of the largest value, in the root mean square over the samples."""
    size = np.abs(change * counted).max()
    error = np.sqrt((((column - change) * counted) ** 2).mean())
    assert error <= 0.05 * size + 1e-9, f"{what}: {error / max(size, 1e-12):.3f}"


def test_laws_over_what_is_the_same_in_all_engagements_have_no_columns() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT)
    speeds = scene.recordings.conditions.motor_speed
    scene = scene.take(np.flatnonzero(speeds == speeds[0]))
    scene = replace(scene, order=np.zeros(len(scene)))
    load, clutch = LoadBlock(scene), ClutchBlock(scene, scene.smooth["pressure"])
    for block in (load, clutch):
        points = nominal(block)
        base = block.base(points)
        empty = [pair for pair in block.pairs(rare=True) if block.basis(pair, points, (), base).shape[1] == 0]
        assert {on for _, on in empty} == {"motor speed", "run order"}
