"""Lags and memories: filters of the simulator, kernels that change within an engagement, and what they find."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.naming.answer import answer, next_best
from slipstick.naming.block import finest
from slipstick.naming.closing_fits import changing_lags, fits_with_pairs, lags_beside
from slipstick.naming.converter_lag import lag_columns, lagging
from slipstick.naming.curved import CurvedFit
from slipstick.naming.evidence import gains as in_linear_model
from slipstick.naming.evidence import table
from slipstick.naming.filters import valve_response
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.forward import forward
from slipstick.naming.full_fits import tried
from slipstick.naming.input import InputBlock
from slipstick.naming.lags import late_by, mixed
from slipstick.naming.measured import law_points
from slipstick.naming.past_current import remembered
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.search import search
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.settings import NamingSettings
from slipstick.naming.torque_lag import OF_FRICTION, gained_elsewhere
from slipstick.naming.valve import ValveBlock
from slipstick.naming.varying_lag import Trail, trailing
from slipstick.recordings import Signals
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

TIME, SCALE = np.linspace(0, 1, 501), 0.02
LAGS = SCALE * np.array([0.1, 0.3, 1, 3])
SIGNAL = np.stack([np.sin(6 * TIME) * TIME, np.minimum(1, 4 * TIME) - 0.5, np.exp(-TIME)])


def test_lags_are_those_of_the_simulator() -> None:
    expected = [lagged_signal(SIGNAL, TIME, np.array([lag])) - SIGNAL for lag in LAGS]
    np.testing.assert_allclose(late_by(SIGNAL, TIME, SCALE), np.stack(expected, axis=1), rtol=0, atol=1e-14)


@pytest.mark.parametrize("shape", [(1, 4, 1), (3, 4, 1), (1, 4, 501), (3, 4, 501)])
def test_a_mixture_is_the_sum_of_the_weighted_lags(shape: tuple[int, ...]) -> None:
    weights = np.random.default_rng(5).standard_normal(shape)
    expected = (weights * late_by(SIGNAL, TIME, SCALE)).sum(axis=1)
    np.testing.assert_allclose(mixed(SIGNAL, TIME, SCALE, weights), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("finer", [0, 1, 2])
def test_a_lagging_converter_is_the_sum_over_its_columns(finer: int) -> None:
    block = block_of("input", scene_of(HEAVY, Model(HEAVY.physics), 8, 3))
    assert isinstance(block, InputBlock)
    torque = 1e3 * block.scene.smooth["input_speed"]
    columns = lag_columns(block.scene, torque, finer)
    c = np.random.default_rng(6).standard_normal(columns.shape[1])
    expected = c @ columns
    np.testing.assert_allclose(lagging(block.scene, torque, c, finer), expected, rtol=0,
                               atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("lag", [0.003, 0.01, 0.04])
def test_a_lag_between_is_a_combination_of_those_of_the_basis(lag: float) -> None:
    signal = np.clip(4 * TIME - 1, 0, 1)[None] + 0.3 * np.sin(15 * TIME)
    change = (lagged_signal(signal, TIME, np.array([lag])) - signal)[0]
    basis = late_by(signal, TIME, SCALE)[0].T
    left = change - basis @ np.linalg.lstsq(basis, change)[0]
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(change)
    alone = change - basis[:, 2:3] @ np.linalg.lstsq(basis[:, 2:3], change)[0]
    assert np.linalg.norm(alone) > 0.05 * np.linalg.norm(change)


# Lags of friction and converter that change within an engagement: the kernel, and what is found with it.


SETTINGS, COUNT, FEWER, SEED = NamingSettings(), 24, 12, 5
CLOCK = np.linspace(0, 1.0, 201)
READ = np.stack([np.clip(CLOCK - 0.2, 0, 0.3), np.sin(8 * CLOCK)])
OVER_SPEED, OVER_SLIP = ("friction lag", "output speed"), ("converter lag", "slip")
LATEST, FROM = 0.05, 15.0  # s, and rad/s


def test_a_constant_lag_is_a_first_order_one() -> None:
    found = READ + trailing(READ, np.full(READ.shape, 0.07), CLOCK[1])
    np.testing.assert_allclose(found, lagged_signal(READ, CLOCK, np.array([0.07])), atol=1e-12)


def test_a_lag_that_changes_follows_its_equation() -> None:
    """A twin with steps of a thousandth of a sample."""
    fine = np.linspace(0, 1.0, 200001)
    lag, signal = 0.05 + 0.04 * np.sin(5 * fine), np.interp(fine, CLOCK, READ[0])
    late = np.zeros(fine.shape)
    for t in range(1, len(fine)):
        late[t] = late[t - 1] + (signal[t - 1] - late[t - 1]) / lag[t - 1] * fine[1]
    found = READ[:1] + trailing(READ[:1], np.interp(CLOCK, fine, lag)[None], CLOCK[1])
    assert np.abs(found[0] - np.interp(CLOCK, fine, late)).max() < 0.01 * np.ptp(late)


def test_what_trails_is_linear_in_the_lag_about_none_and_its_columns_are_derivatives() -> None:
    short = np.full(READ.shape, 1e-4)
    ahead, behind = (trailing(READ, sign * short, CLOCK[1]) for sign in (-1, 1))
    np.testing.assert_allclose(ahead, -behind, atol=1e-12)
    assert np.abs(trailing(READ, -1e6 * np.ones(READ.shape), CLOCK[1])).max() < 1.01 * np.abs(np.diff(READ)).max()
    basis, h = np.stack([0.05 * np.ones((2, 201)), READ], 1), 1e-4
    for lag in (0.03 + 0.02 * np.sin(CLOCK), np.where(CLOCK < 0.5, -2 * CLOCK[1], 0.03)):
        lags = np.tile(lag, (2, 1))
        for column, one in zip(Trail.of(lags, CLOCK[1]).columns(READ, basis).transpose(1, 0, 2),
                               basis.transpose(1, 0, 2), strict=True):
            change = trailing(READ, lags + h * one, CLOCK[1]) - trailing(READ, lags - h * one, CLOCK[1])
            np.testing.assert_allclose(column, change / (2 * h), atol=1e-5 * np.abs(column).max())


@cache
def clutch(latest: float) -> tuple[ClutchBlock, CurvedFit]:
    """The closing piston whose torque lags by `latest` s from a speed of the output on, fitted without laws."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    block = block_of("clutch", scene)
    assert isinstance(block, ClutchBlock)
    lag = np.where(scene.abscissa("output speed") > FROM, latest, 0.0)
    block.measured = block.measured + trailing(scene.smooth["output_torque"], lag, scene.step)
    return block, settled(block, search(block, np.zeros(1)), np.zeros(1))


def gains(latest: float) -> dict[tuple[str, str], tuple[float, CurvedFit]]:
    """Rises of the evidence with each lag of the friction, and with air in the oil."""
    block, plain = clutch(latest)
    pairs = [*changing_lags(block), OF_FRICTION, ("clearance", "pressure")]
    return {linear.pair: (evidence_of(one) - evidence_of(plain), one)
            for linear, one in fits_with_pairs(plain, SETTINGS, pairs)}


@pytest.mark.slow
def test_a_lag_of_the_friction_is_found_over_what_it_depends_on_and_measured() -> None:
    found = gains(LATEST)
    best, one = found[OVER_SPEED]
    assert best > 100 * SETTINGS.nats
    assert all(gain < best - 100 * SETTINGS.nats for pair, (gain, _) in found.items() if pair != OVER_SPEED)
    law = law_points(one, OVER_SPEED)
    assert (law.unit, law.x_unit, law.up_to) == ("s", "rad/s", "nothing")
    assert law.x is not None
    assert law.change[law.x > 1.5 * FROM].mean() == pytest.approx(LATEST, rel=0.2)
    assert np.abs(law.change[law.x < 0.5 * FROM]).max() < 0.3 * LATEST


def test_lags_that_change_are_not_asked_for_beside_another_law() -> None:
    _, plain = clutch(LATEST)
    assert OVER_SPEED in lags_beside(plain)
    assert lags_beside(replace(plain, laws=(("clearance", "pressure"),))) == []


def test_no_lag_gains_where_nothing_is_missing() -> None:
    assert all(gain < SETTINGS.nats for gain, _ in gains(0.0).values())


@pytest.mark.slow
def test_a_lag_of_the_converter_over_the_slip_is_followed_and_measured() -> None:
    block = block_of("input", scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED))
    points, law = np.zeros((COUNT, len(block.random))), block.law(OVER_SLIP)
    assert law.x is not None
    true = np.where((law.x > 0.3 * law.x.max()) & (law.x < 0.7 * law.x.max()), LATEST, 0.0)
    lags = [(OVER_SLIP, np.linalg.lstsq(law.onto, true)[0])]
    block.measured = block.measured + block.base(points, lags) - block.base(points)
    fits = {"input": fit(block)}
    about = table(fits["input"], [OVER_SLIP, ("converter torque", "lag"), ("input torque", "time")])
    right, *others = (tried(fits, one, 0) for one in sorted(in_linear_model([about], [], list(about.further)),
                                                            key=lambda one: one.pair != OVER_SLIP))
    assert all(right.nats > one.nats + 100 * SETTINGS.nats for one in others)
    assert right.fits["input"].chi2.mean() < 1.1 < others[0].fits["input"].chi2.mean()
    found = law_points(right.fits["input"], OVER_SLIP)
    assert found.x is not None
    assert len(found.x) >= len(law.x) - 1  # one next to a slip of 0 is hardly passed
    assert np.abs(found.change - np.interp(found.x, law.x, true)).max() < 0.3 * LATEST


def test_a_lag_that_changes_is_the_effect_of_a_constant_one_and_not_in_the_catalogue() -> None:
    others = [Rival(OF_FRICTION, 90.0, 1.0), Rival(("friction lag", "time"), 80.0, 1.0),
              Rival(("output torque sensor", "lag"), 70.0, 1.0)]
    assert next_best(OVER_SPEED, others) is others[2]
    assert next_best(OF_FRICTION, others) is others[2]
    assert answer(Finding(("clutch",), OVER_SPEED, np.ones(COUNT))).kind == "unlisted"


# A lag of the friction and one of the torque sensor, told apart by what the torque drives.


LATE = 0.02


def late(effect: str) -> tuple[CurvedFit, dict[str, BlockFit]]:
    """The clutch with a lag, and what the torque drives, of engagements with an effect of `LATE` s."""
    scene = scene_of(HEAVY, Model(HEAVY.physics).with_effect(effect, {"lag": LATE}), FEWER, SEED)
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


# A current that depends on its past: by play, and by relaxation towards its average over a time.


PAST = ("valve current", "past current")
DURATION = 2.2
"""Of the average, in delays of the valve: between those of the columns."""


def relaxing(size: float) -> ValveBlock:
    """A valve block in whose recordings the current is larger while it rises, by a share `size` of its excess."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), FEWER, SEED)
    block = ValveBlock(scene)
    delay = scene.value("current_delay")
    excess = block.current - lagged_signal(block.current, block.times, np.array([DURATION * delay]))
    demand = scene.value("current_gain") * size * np.maximum(excess, 0.0)
    change = valve_response(scene.step / 2, demand[:, None], np.full(FEWER, delay))[:, 0, ::2]
    signals = {name: scene.measured(name) for name in scene.signals.names}
    signals["pressure"] = signals["pressure"] + change
    return ValveBlock(replace(scene, recordings=replace(scene.recordings, signals=Signals(scene.time, **signals))))


def test_a_current_that_is_larger_while_it_rises_depends_on_its_past() -> None:
    block = relaxing(0.3)
    plain = fit(block)
    fits, findings = forward({"valve": plain}, NamingSettings())
    assert [one.pair for one in findings] == [PAST]
    assert fits["valve"].chi2.mean() - 1 < 0.05 * (plain.chi2.mean() - 1)
    assert fits["valve"].block.finer[PAST] > 0
    second = findings[0].next_best  # another pair of the block, which trails
    assert second is not None
    assert second.pair != PAST
    assert 0 < findings[0].lead <= second.behind
    assert second.nats < findings[0].nats


def test_without_relaxation_nothing_depends_on_the_past() -> None:
    assert forward({"valve": fit(relaxing(0.0))}, NamingSettings())[1] == []


def test_the_width_of_play_does_not_depend_on_the_columns_of_relaxation() -> None:
    model = Model(HEAVY.physics).with_effect("valve_hysteresis", {"width": 0.012})
    block = ValveBlock(scene_of(HEAVY, model, FEWER, SEED))
    widths = []
    for finer in range(finest(block, PAST) + 1):
        block.finer = {PAST: finer}
        widths.append(law_points(fit(block, (PAST,)), PAST))
    for one in widths:
        assert abs(one.change[0] - 0.012) < 4 * one.std[0]


def test_more_pieces_follow_a_law_that_is_steep_where_the_current_turns_round() -> None:
    block = ValveBlock(scene_of(HEAVY, Model(HEAVY.physics), FEWER))
    delay = block.scene.value("current_delay")
    excess = block.current - lagged_signal(block.current, block.times, np.array([DURATION * delay]))
    law = np.tanh(excess / (0.03 * np.abs(excess).max())).ravel()
    left = []
    for finer in (0, 2, finest(block, PAST)):
        columns = remembered(block.current, block.times, delay, finer).transpose(0, 2, 1).reshape(law.size, -1)
        left.append(float(np.linalg.norm(law - columns @ np.linalg.lstsq(columns, law)[0]) / np.linalg.norm(law)))
    assert left[1] > 0.05
    assert left[2] < 0.02
