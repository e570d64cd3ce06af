"""Columns are derivatives beside other laws too, and steps of a fit that columns promise wrongly are taken back."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming import mechanics, sensor_errors
from slipstick.naming.block import Block, Pair
from slipstick.naming.fit import fit
from slipstick.naming.input import InputBlock
from slipstick.naming.scene import Scene
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of
from tests.slipstick.naming.test_together import FIRST, TIME, Line, two

COUNT, STEP = 13, 1e-3
GAIN: Pair = ("output torque sensor", "gain")
BESIDE: list[tuple[str, Pair, Pair]] = [
    ("valve", ("pressure sensor", "lag"), ("valve current", "current")),
    ("valve", ("pressure sensor", "gain"), ("valve current", "past current")),
    ("valve", ("pressure sensor", "gain"), ("line pressure", "motor speed")),
    ("valve", ("line pressure", "motor speed"), ("valve current", "current")),
    ("valve", ("valve current", "current"), ("pressure sensor", "gain")),
    ("load", ("output speed sensor", "gain"), ("load torque", "output speed")),
    ("load", ("output speed sensor", "lag"), ("load torque", "time")),
    ("load", GAIN, GAIN),
    ("input", ("input speed sensor", "gain"), ("input torque", "input speed")),
    ("input", ("converter torque", "pressure"), ("input torque", "input speed")),
    ("input", ("converter torque", "pressure"), ("converter torque", "run order")),
    ("input", ("converter torque", "pressure"), ("converter torque", "lag")),
    ("clutch", ("output torque sensor", "lag"), ("friction coefficient", "slip")),
    ("clutch", ("contact pressure", "lag"), ("friction coefficient", "pressure")),
    ("clutch", GAIN, ("friction coefficient", "slip")),
    ("clutch", ("output torque sensor", "lag"), ("chamber pressure", "input speed"))]
CLOSE = 0.04


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_of(HEAVY, Model(HEAVY.physics), COUNT)


def held(block: Block, pair: Pair) -> np.ndarray:
    """Coefficients of a strong law: an error of a tenth, or a lag of half of that of the basis."""
    size = block.basis(pair, nominal(block), (), block.base(nominal(block))).shape[1]
    return np.full(size, 0.15 if pair == GAIN else 0.1)


def nominal(block: Block) -> np.ndarray:
    return np.zeros((COUNT, len(block.random)))


def off(column: np.ndarray, change: np.ndarray, counted: np.ndarray) -> float:
    """Root mean square by which a column is off, over that of the change."""
    return float(np.linalg.norm((column - change)[counted]) / np.linalg.norm(change[counted]))


@pytest.mark.parametrize(("name", "law", "pair"), BESIDE)
def test_columns_of_laws_are_derivatives_beside_another_law(scene: Scene, name: str, law: Pair, pair: Pair) -> None:
    block = block_of(name, scene)
    points, c = nominal(block), held(block, law)
    base = block.base(points, [(law, c)])
    columns = block.basis(pair, points, [(law, c)], base).copy()
    for j in {0, columns.shape[1] - 1}:
        step = STEP * np.eye(columns.shape[1])[j]
        laws = {law: c, pair: (c if pair == law else np.zeros(len(step))) + step}
        change = (block.base(points, list(laws.items())) - base) / STEP
        if change[block.counted].any():  # the least current has a column of 0, and so may the largest slip
            assert off(columns[:, j], change, block.counted) < CLOSE


@pytest.mark.parametrize(("on", "finer"), [("gain", 0), ("lag", 0), ("lag", 1)])
def test_a_law_without_columns_has_none_beside_an_error_of_the_sensor(scene: Scene, on: str, finer: int) -> None:
    """It is one over what is the same in all engagements."""
    law, signal = ("output speed sensor", on), scene.smooth["output_speed"]
    c = np.full(sensor_errors.reading(scene, *law, signal, finer).shape[1], 0.1)
    nothing = np.zeros((COUNT, 0, signal.shape[1]))
    assert sensor_errors.as_read(scene, nothing, signal, [(law, c)], law[0], {law: finer}).shape == nothing.shape


@pytest.mark.parametrize(("name", "law"), [(name, law) for name, law, _ in BESIDE if law != GAIN])
def test_columns_of_parameters_are_derivatives_beside_a_law(scene: Scene, name: str, law: Pair) -> None:
    block = block_of(name, scene)
    points, c = nominal(block), held(block, law)
    base = block.base(points, [(law, c)])
    own = block.columns(points, [(law, c)], base)[0].copy()
    for j in range(3):
        step = STEP * np.eye(len(block.random))[j]
        change = (block.base(points + step, [(law, c)]) - block.base(points - step, [(law, c)])) / (2 * STEP)
        assert off(own[:, j], change, block.counted) < CLOSE


def test_a_column_of_the_torque_sensor_without_the_steepness_of_its_error_is_off(
        scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.naming.load.steepness", lambda *_: np.ones(scene.smooth["output_torque"].shape))
    with pytest.raises(AssertionError):
        test_columns_of_laws_are_derivatives_beside_another_law(scene, "load", GAIN, GAIN)
    assert mechanics.steepness(scene, scene.smooth["output_torque"], [], {}) == pytest.approx(1.0)


class Misled(Line):
    """Columns are a quarter of what they should be, so that every step is four times too long."""

    def basis(self, pair: Pair, points: np.ndarray, laws: Any, predicted: np.ndarray) -> np.ndarray:
        return 0.25 * super().basis(pair, points, laws, predicted)


def test_a_fit_whose_columns_are_wrong_does_not_end_below_its_start() -> None:
    line = two({FIRST: 0.3}, {})["a"]
    wrong = Misled(**{name: getattr(line, name) for name in ("name", "measured", "offered")})
    plain, right, found = fit(line), fit(line, (FIRST,)), fit(wrong, (FIRST,), fit(wrong))
    rise = right.fitted.likelihood.sum() - plain.fitted.likelihood.sum()
    assert found.fitted.likelihood.sum() - plain.fitted.likelihood.sum() > 0.5 * rise > 50
    # What is stated is what the block leaves at the stated values.
    left = line.measured - line.base(found.points, found.held)
    assert found.chi2.mean() == pytest.approx((left**2).sum(axis=1).mean() / 0.05**2 / (left.shape[1] - 1), rel=0.01)


class Empty(Line):
    """The column of a law promises the slopes of the engagements, and the prediction does not contain it."""

    def base(self, points: np.ndarray, laws: Any = ()) -> np.ndarray:
        return super().base(points)

    def basis(self, pair: Pair, points: np.ndarray, laws: Any, predicted: np.ndarray) -> np.ndarray:
        slopes = np.linalg.lstsq(TIME[:, None], self.measured.T)[0][0] - 1
        return np.asarray(slopes[:, None, None] * TIME)


def test_a_fit_of_which_no_step_leads_anywhere_is_as_likely_as_its_start() -> None:
    """Its variances are not those that a step promised, with which slopes that it did not explain would be noise."""
    line = two({}, {})["a"]
    empty = Empty(**{name: getattr(line, name) for name in ("name", "measured", "offered")})
    plain = fit(empty)
    found = fit(empty, (FIRST,), plain)
    assert found.fitted.posterior == pytest.approx(plain.fitted.posterior, abs=1.0)
    assert found.fitted.variance == pytest.approx(plain.fitted.variance, rel=0.1)


def test_engagements_without_samples_have_no_chi_square() -> None:
    line = two({FIRST: 0.3}, {})["a"]
    counted = np.ones(line.measured.shape, bool)
    counted[:15, 5:] = False
    some = type("Some", (Line,), {"counted": counted})(line.name, line.measured, line.offered)
    chi_square = fit(some).chi2
    assert np.all(chi_square[:15] == 1)
    assert chi_square[15:].mean() > 1.5


@pytest.mark.parametrize("found", [True, False])
def test_the_torque_after_lock_up_is_that_of_the_parameters_that_shafts_have_found(found: bool) -> None:
    off_by = {"load_inertia": 0.02, "brake_torque": 0.03, "motor_speed": 0.02}
    true = scene_of(HEAVY, Model(HEAVY.physics), COUNT)
    conditions = true.recordings.conditions
    stated = replace(conditions, **{name: getattr(conditions, name) / (1 + by) for name, by in off_by.items()})
    scene = replace(true, recordings=replace(true.recordings, conditions=stated))
    relative = {name: np.full(COUNT, by) for name, by in off_by.items()} if found else {}
    torque = scene.model_torque(scene.smooth["output_torque"], relative)
    error = np.abs(torque - true.smooth["output_torque"])[scene.locked].mean()
    assert (error < 0.002 * true.smooth["output_torque"].max()) == found


def test_a_lag_of_the_converter_that_comes_and_goes_is_closer_to_a_finer_one(scene: Scene) -> None:
    block, lag, left = InputBlock(scene), ("converter torque", "lag"), []
    wave = (block._torque(lag, ())[:, 1] * np.sin(np.pi * scene.time / 0.4) ** 2)[block.counted]
    for finer in (0, 1, 2):
        block.finer = {lag: finer}
        basis = block._torque(lag, ()).transpose(0, 2, 1)[block.counted]
        left.append(np.linalg.norm(wave - basis @ np.linalg.lstsq(basis, wave, rcond=None)[0]))
        assert block.law(lag).onto.shape[1] == basis.shape[1]
    assert left[2] < left[1] < 0.7 * left[0]


def test_a_law_of_the_converter_is_a_share_of_its_torque_on_this_bench(scene: Scene) -> None:
    """The motor sags and runs at other speeds than stated, and the curve is another one."""
    block, law = InputBlock(scene), ("converter torque", "pressure")
    share, points, count = 0.3, nominal(block), sum(name.startswith("converter") for name in block.fixed)
    off_by = np.array([0.0, 0.02, *np.full(len(block.fixed) - 2 - count, -0.02)])
    block.at(np.concatenate([off_by, np.full(count, 1.05 * (1 + share) - 1)]))
    expected = block.base(points)
    block.at(np.concatenate([off_by, np.full(count, 0.05)]))
    size = block.law(law).onto.shape[1]
    np.testing.assert_allclose(block.base(points, [(law, np.full(size, share))]), expected, rtol=1e-9)
    assert np.abs(block.base(points) - expected).max() > 1
