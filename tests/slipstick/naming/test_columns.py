"""Columns are derivatives, of the piston and beside other laws, and are what a longer computation gives."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.bench import parameters
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming import mechanics, sensor_errors
from slipstick.naming.block import Block, Laws, Pair, finest
from slipstick.naming.fit import fit
from slipstick.naming.input import InputBlock
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.scene import Scene
from slipstick.naming.sensor_errors import as_read, pairs_of, read_too_much, reading
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
    expected = block.at(np.concatenate([off_by, np.full(count, 1.05 * (1 + share) - 1)])).base(points)
    block = block.at(np.concatenate([off_by, np.full(count, 0.05)]))
    size = block.law(law).onto.shape[1]
    np.testing.assert_allclose(block.base(points, [(law, np.full(size, share))]), expected, rtol=1e-9)
    assert np.abs(block.base(points) - expected).max() > 1


# Columns of what laws add to the closing piston are derivatives of the torque, beside laws of every other kind.


SCATTERED, SEED, SHORT = 24, 5, 1e-4
PAIRS: list[Pair] = [("chamber pressure", "input speed"), ("piston rate", "pressure"), ("piston gain", "run order"),
                     ("clearance", "pressure"), ("friction lag", "time"), ("friction coefficient", "slip")]
BESIDE_PISTON: dict[str, list[Pair]] = {
    "nothing": [], "tables": [("piston rate", "piston rate"), ("piston rate", "piston position")],
    "drag": [("piston rate", "direction")], "friction": [("friction lag", "output speed"), ("film torque", "slip")]}


@pytest.fixture(scope="module")
def block() -> ClutchBlock:
    return block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics), SCATTERED, SEED))


@pytest.mark.parametrize("pair", PAIRS, ids=" over ".join)
@pytest.mark.parametrize("beside", BESIDE_PISTON)
def test_columns_are_derivatives_of_the_torque(block: ClutchBlock, pair: Pair, beside: str) -> None:
    rng = np.random.default_rng(SEED)
    points = 0.02 * rng.standard_normal((SCATTERED, len(block.random)))
    laws: Laws = [(one, 0.1 * np.abs(rng.standard_normal(block.size(one)))) for one in BESIDE_PISTON[beside]]
    if pair[0] == "friction lag":  # which is a law that is held, so that it delays the torque
        laws = [*laws, (pair, 0.1 * np.ones(block.size(pair)))]
    block = block.at(np.array([7e-4]))
    torque = block.base(points, laws)
    held = dict(laws).get(pair, np.zeros(block.size(pair)))
    others = [one for one in laws if one[0] != pair]
    moved = [block.base(points, [*others, (pair, held + step)]) for step in SHORT * np.eye(block.size(pair))]
    change = np.stack([(one - torque) / SHORT for one in moved], axis=1)
    columns = block.basis(pair, points, laws, torque)
    assert np.abs(change).max() > 0
    off = np.abs(columns - change) / np.abs(change).max()
    assert np.quantile(off, 0.9999) < 0.02  # a sample at which the difference steps over full contact is off
    assert np.sqrt(np.mean((columns - change) ** 2) / np.mean(change**2)) < 0.02


def test_plates_are_as_far_apart_as_in_the_simulator_where_they_wear_by_more_than_the_piston_begins_with() -> None:
    pair, nominal = ("clearance", "run order"), dict(zip(parameters.NAMES, HEAVY.physics.nominal, strict=True))
    wear = 2 * nominal["initial_position"] * nominal["temperature_gain"]
    law = MeasuredLaw(*pair, (0.0, SCATTERED - 1.0), (-wear, wear), relative=False)
    block = block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics).with_law(law), SCATTERED))
    its, points = block.law(pair), np.zeros((SCATTERED, len(block.random)))
    assert its.x is not None
    coefficients = np.linalg.lstsq(its.onto, np.interp(its.x, law.at, law.change))[0]
    before = block.scene.time < 0.05  # the plates close
    left, lacking = ((block.measured - block.base(points, laws))[:, before] for laws in ([(pair, coefficients)], []))
    assert np.abs(left).max() < 0.01 * np.abs(lacking).max()


# What is computed without a basis, or by a shorter recurrence, is what the longer way gives.


SENSORS = "pressure sensor", "input speed sensor", "output speed sensor", "output torque sensor"
PISTON = ("piston rate", "piston rate"), ("piston rate", "piston position")
DOZEN, DOZEN_SEED = 12, 3


def clutch_of() -> ClutchBlock:
    block = block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics), DOZEN, DOZEN_SEED))
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
        c = np.random.default_rng(DOZEN_SEED).standard_normal(basis.shape[1])
        expected = c @ basis
        np.testing.assert_allclose(read_too_much(scene, sensor, on, signal, c, finer), expected, rtol=0,
                                   atol=1e-12 * np.abs(expected).max(), err_msg=f"{sensor} over {on}, finer {finer}")


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize(("on", "finer"), [("gain", 0), ("gain", 2), ("lag", 0), ("lag", 1), ("lag", 2)])
def test_changes_are_read_as_the_error_changes_with_the_signal(sensor: str, on: str, finer: int) -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), DOZEN, DOZEN_SEED)
    signal = 0.97 * scene.smooth[sensor.removesuffix(" sensor").replace(" ", "_")]  # off the last knot, where it bends
    rng = np.random.default_rng(DOZEN_SEED)
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
    points = 0.05 * np.random.default_rng(DOZEN_SEED).standard_normal((DOZEN, len(block.random)))
    for clock in (0.0, 0.4 * block.scene.step, -0.7 * block.scene.step):
        late = block.at(np.array([clock]))
        plain = late.base(points)
        np.testing.assert_allclose(late.base(points, [(pair, np.zeros(block.size(pair)))]), plain, rtol=0,
                                   atol=1e-10 * plain.max())
