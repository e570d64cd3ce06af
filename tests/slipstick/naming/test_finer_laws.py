"""What a law with few knots leaves is not called another one; levels of torques and gain errors of their sensor."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming import forward as forward_module
from slipstick.naming import full_fits, mechanics, sensor_errors
from slipstick.naming.asked import Asked
from slipstick.naming.block import Pair, finest
from slipstick.naming.choice import find_uneven
from slipstick.naming.fit import fit
from slipstick.naming.forward import forward
from slipstick.naming.law_map import refined
from slipstick.naming.measured import law_points
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.scene import Scene
from slipstick.naming.selection import Finding
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Recordings
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED = 24, 5
SETTINGS = NamingSettings()
OVER_SPEED, GAIN = ("load torque", "output speed"), ("output torque sensor", "gain")
AT = np.linspace(0, 52, 16)  # most points of a law of the simulator
WAVE = MeasuredLaw(*OVER_SPEED, tuple(AT), tuple(30.0 * np.sin(AT * 2 * np.pi / 16)), relative=False)

WEAK = 3.0
"""Half the range of a drift in N m that gains far less than a further law must."""


@cache
def plain() -> Scene:
    return scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)


def findings(model: Model, settings: NamingSettings = SETTINGS) -> list[Pair]:
    """The pairs that the load block asks for."""
    block = block_of("load", scene_of(HEAVY, model, COUNT, SEED))
    return [one.pair for one in forward({"load": fit(block)}, settings)[1]]


@pytest.mark.slow
def test_what_few_knots_leave_of_a_law_is_not_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Model(HEAVY.physics).with_law(WAVE)
    assert findings(model) == [OVER_SPEED]
    monkeypatch.setattr(full_fits, "twice_as_fine", lambda block, laws: {})
    assert len(findings(model, replace(SETTINGS, most=2))) > 1


@pytest.mark.slow
@pytest.mark.parametrize("is_known", [False, True])
def test_no_further_pair_is_fitted_where_too_little_is_left_for_one(
        monkeypatch: pytest.MonkeyPatch, is_known: bool) -> None:
    drift = MeasuredLaw("load torque", "run order", (0.0, 23.0), (-WEAK, WEAK), relative=False)
    block = block_of("load", scene_of(HEAVY, Model(HEAVY.physics).with_law(WAVE).with_law(drift), COUNT, SEED))
    if not is_known:
        monkeypatch.setattr(forward_module, "_left", lambda _: np.inf)
    asked = list[Asked]()
    assert [one.pair for one in forward({"load": fit(block)}, SETTINGS, asked.append)[1]] == [OVER_SPEED]
    assert any(one.tries == ("load torque", "run order") for one in asked) != is_known


@pytest.mark.slow
def test_two_laws_are_still_two() -> None:
    drag = MeasuredLaw(*OVER_SPEED, (0.0, 25.0, 50.0), (0.0, 20.0, -20.0), relative=False)
    drift = MeasuredLaw("load torque", "run order", (0.0, 23.0), (-20.0, 20.0), relative=False)
    block = block_of("load", scene_of(HEAVY, Model(HEAVY.physics).with_law(drag).with_law(drift), COUNT, SEED))
    first, second = forward({"load": fit(block)}, SETTINGS)[1]
    assert first.pair == OVER_SPEED
    # This block alone does not tell a torque that drifts from an error of the torque sensor that does.
    alike = {second.pair, *(rival.pair for rival in second.rivals)}
    assert alike == {("load torque", "run order"), ("output torque sensor", "run order")}


@pytest.mark.parametrize(("pair", "times"), [
    (OVER_SPEED, 3), (("load torque", "run order"), 2), (("load torque", "motor speed"), 0), (GAIN, 5),
    (("output speed sensor", "lag"), 2),
    (("output speed sensor", "offset"), 0), (("output speed sensor", "time"), 4),
    (("output speed sensor", "run order"), 2), (("output torque sensor", "pressure"), 4)])
def test_laws_over_signals_and_some_errors_of_sensors_can_be_finer(pair: Pair, times: int) -> None:
    block = block_of("load", plain())
    assert finest(block, pair) == times
    points = np.zeros((COUNT, len(block.random)))
    base, sizes = block.base(points), []
    for finer in range(times + 1):
        block.finer = {pair: finer}
        sizes.append(block.basis(pair, points, (), base).shape[1])
        assert block.law(pair).onto.shape[1] == sizes[-1]
    assert np.all(np.diff(sizes) > 0)


@pytest.mark.parametrize("response", [
    lambda x, t: np.interp(t - 0.03, t, x),  # a dead time between two lags of the basis
    lambda x, t: x - 0.02 * np.gradient(x, t) * np.abs(x) / np.abs(x).max()])  # a lag that grows with the signal
def test_a_finer_lag_is_closer_to_other_responses_than_first_order_ones(
        response: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> None:
    scene = plain()
    signal, left = scene.smooth["output_speed"], []
    change = np.array([response(row, scene.time) for row in signal]) - signal
    for finer in (0, 1):
        basis = sensor_errors.reading(scene, "output speed sensor", "lag", signal, finer).transpose(0, 2, 1)
        basis = basis.reshape(-1, basis.shape[-1])
        left.append(np.linalg.norm(change.ravel() - basis @ np.linalg.lstsq(basis, change.ravel())[0]))
    assert left[1] < 0.5 * left[0]


@pytest.mark.parametrize("lag", [
    lambda run, t: 0.01 + 0.04 * (run > run.mean())[:, None] * np.ones(len(t)),  # another sensor from the middle on
    lambda run, t: 0.05 * np.ones(len(run))[:, None] * np.maximum(0, 1 - t / t[-1])])  # a filter that opens
def test_a_finer_lag_follows_one_that_changes_over_the_runs_or_the_time(
        lag: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> None:
    scene = plain()
    signal, left = scene.smooth["output_speed"], []
    change = -lag(scene.run, scene.time) * np.gradient(signal, scene.time, axis=1)
    for finer in (0, 1):
        basis = sensor_errors.reading(scene, "output speed sensor", "lag", signal, finer).transpose(0, 2, 1)
        basis = basis.reshape(-1, basis.shape[-1])
        coefficients = np.linalg.lstsq(basis, change.ravel())[0]
        left.append(np.linalg.norm(change.ravel() - basis @ coefficients))
    assert left[1] < 0.5 * left[0]
    block = block_of("load", scene)
    block.finer = {("output speed sensor", "lag"): 1}
    # Its number is the lag in the middle of the time, of all runs on average.
    value = float((block.law(("output speed sensor", "lag")).onto @ coefficients)[0])
    assert value == pytest.approx(lag(scene.run, scene.time)[:, len(scene.time) // 2].mean(), abs=0.006)


@pytest.mark.parametrize("right", [True, False])
def test_a_strong_gain_error_of_the_torque_sensor_is_a_function_of_the_true_torque(
        monkeypatch: pytest.MonkeyPatch, right: bool) -> None:
    if not right:
        monkeypatch.setattr(mechanics, "_without_gain", lambda scene, read, laws, finer: read)
    scene = plain()
    torque, signals = scene.smooth["output_torque"], scene.signals
    error = 0.3 * torque / torque.max()
    read = replace(signals, output_torque=scene.measured("output_torque") * (1 + error))
    smooth = {**scene.smooth, "output_torque": torque * (1 + error)}
    recordings = Recordings(scene.recordings.conditions, scene.recordings.measured_time, read)
    block = block_of("load", replace(scene, recordings=recordings, smooth=smooth))
    found = fit(block, (GAIN,))
    law = law_points(found, GAIN)
    assert law.x is not None
    seen = law.x > 0.3 * law.x[-1]
    size = smooth["output_torque"].max() / torque.max()
    close = np.abs(law.change - 0.3 * size * law.x / law.x[-1])[seen].max() < 0.02
    assert close == right


@pytest.mark.parametrize("pair", [("piston rate", "piston rate"), ("piston rate", "pressure"),
                                  ("piston rate", "piston position"), ("clearance", "pressure"),
                                  ("film torque", "slip"), ("chamber pressure", "input speed")])
def test_a_law_of_the_piston_is_the_same_at_twice_the_resolution(pair: Pair) -> None:
    block, laws, predicted = block_of("clutch", plain()), [], []
    assert isinstance(block, ClutchBlock)
    points = np.zeros((COUNT, len(block.random)))
    c = 0.3 * np.random.default_rng(1).standard_normal(block.size(pair))
    for finer in (0, 1):
        block.finer = {pair: finer}
        laws.append(block.law(pair))
        predicted.append(block.base(points, [(pair, c if not finer else refined(laws[0], c, laws[1]))]))
    assert laws[1].onto.shape[1] > 1.5 * laws[0].onto.shape[1]
    changed = np.abs(predicted[0] - block.base(points)).max()
    assert np.abs(predicted[1] - predicted[0]).max() < 0.02 * changed


def test_what_all_engagements_have_in_common_is_part_of_a_law_of_the_torque_over_the_runs() -> None:
    constant = 25.0
    law = MeasuredLaw("load torque", "run order", (0.0, 1.0), (constant, constant), relative=False)
    scene = scene_of(HEAVY, Model(HEAVY.physics).with_law(law), COUNT, SEED)
    block, pair = block_of("load", scene), ("load torque", "run order")
    found = law_points(fit(block, (pair,)), pair)
    assert found.up_to == "nothing"
    np.testing.assert_allclose(found.change, constant, atol=4 * found.std.max())
    assert found.std.max() < 0.2 * constant


def test_a_pair_that_gains_more_but_unevenly_is_a_rival() -> None:
    steady, rough = np.full(COUNT, 10.0), np.where(np.arange(COUNT) < 4, 500.0, -1.0)

    def gain(pair: Pair, nats: np.ndarray, blocks: tuple[str, ...]) -> Any:
        return SimpleNamespace(pair=pair, nats=nats, blocks=blocks)

    finding = Finding(("load", "lock"), ("a", "x"), steady)
    compared = [gain(("b", "x"), rough, ("load",)), gain(("c", "x"), rough / 10, ("load",)),
                gain(("d", "x"), rough, ("load", "input")), gain(("e", "x"), 2 * steady, ("load",))]
    assert [one.pair for one in find_uneven(finding, compared, SETTINGS)] == [("b", "x")]
