"""Measured laws as values: their choice, points, prior and bands, and the way to the simulator and to JSON."""

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.laws import MOST_POINTS
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.naming import answer
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.law_map import over_runs
from slipstick.naming.measured import LawPoints, law_points, measure_laws, thin_points
from slipstick.naming.selection import Finding
from slipstick.naming.smoothness import between_points, smoothed, widened
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

X = np.linspace(0, 60, 17)
DRAG = LawPoints(("load torque", "output speed"), X, "rad/s", 0.02 * X**2, "N m", False, np.diag(0.1 + X))
LAG = LawPoints(("input speed sensor", "lag"), None, "", np.array([0.012]), "s", False, np.array([[1e-6]]))
OFFSET = ("output torque sensor", "offset")


@pytest.fixture(scope="module")
def fits() -> dict[str, BlockFit]:
    """Two blocks with the same two laws of the torque sensor."""
    scene = scene_of(HEAVY, Model(HEAVY.physics).with_effect("output_torque_sensor_offset", {"offset": 10.0}), 12, 1)
    pairs = (OFFSET, ("output torque sensor", "lag"))
    return {name: fit(block_of(name, scene), pairs) for name in ("load", "contact")}


def test_json_has_everything() -> None:
    for law in (DRAG, replace(DRAG, up_to="constant", linearised=True), LAG):
        again = LawPoints.from_dict(json.loads(json.dumps(law.to_dict())))
        assert again.to_dict() == law.to_dict()
        assert (again.x is None) == (law.x is None)
        np.testing.assert_array_equal(again.std, law.std)


def test_the_simulator_takes_laws_of_its_quantities_over_one_number() -> None:
    given = DRAG.simulated()
    assert given is not None
    assert (given.quantity, given.depends_on, given.relative) == ("load torque", "output speed", False)
    assert len(given.at) == MOST_POINTS
    drive = replace(DRAG, pair=("input torque", "output speed")).simulated()
    assert drive is not None
    assert drive.quantity == "converter torque"
    gain = replace(DRAG, pair=("output torque sensor", "gain"), unit="1", relative=True).simulated()
    assert gain is not None
    assert (gain.quantity, gain.depends_on, gain.relative) == ("output torque sensor", "output torque", True)
    drift = replace(DRAG, pair=("pressure sensor", "time")).simulated()
    assert drift is not None
    assert drift.depends_on == "time"
    assert LAG.simulated() is None
    assert replace(DRAG, pair=("load torque", "output position")).simulated() is None
    assert replace(DRAG, pair=("valve delay", "motor speed")).simulated() is None
    assert replace(DRAG, pair=("stick torque", "output speed")).simulated() is None


def test_thinning_leaves_out_what_changes_the_law_least() -> None:
    change = np.where(X < 30, X, 60 - X)
    assert thin_points(X, change, 3).tolist() == [0, 8, 16]
    assert thin_points(X, change, 17).tolist() == list(range(17))
    assert thin_points(X, 0.02 * X**2, 9).tolist() == list(range(0, 17, 2))


def test_arrays_that_do_not_belong_together_are_refused() -> None:
    with pytest.raises(InvalidValue, match="load torque over the output speed"):
        replace(DRAG, covariance=np.eye(3))
    with pytest.raises(InvalidValue):
        replace(DRAG, x=None)


def test_a_pair_of_several_blocks_has_the_law_of_the_one_that_determines_it_best(fits: dict[str, BlockFit]) -> None:
    found, each = measure_laws(fits), [law_points(one, OFFSET) for one in fits.values()]
    best = min(each, key=lambda law: law.std[0])
    assert found[OFFSET].to_dict() == best.to_dict()
    assert abs(best.change[0] - 10) < 4 * best.std[0] < 4
    lag = found["output torque sensor", "lag"]
    assert lag.std[0] > 0.1 * abs(lag.change[0])


@pytest.mark.parametrize(("seen", "chosen"), [(20, "clutch"), (55, "contact")])
def test_a_block_that_sees_a_part_of_a_law_goes_before_another_where_the_part_is_large(
        monkeypatch: pytest.MonkeyPatch, seen: float, chosen: str) -> None:
    """Errors of the linearised law are counted five times as large, and the law itself where a block sees nothing."""
    laws = {name: LawPoints(DRAG.pair, x, "rad/s", np.sin(x / 10), "N m", False, 0.05**2 * np.eye(17),
                            linearised=name == "clutch")
            for name, x in (("contact", X * seen / 60), ("clutch", X))}
    block = SimpleNamespace(signal="output_torque", fixed=())
    fits: dict[str, Any] = {name: SimpleNamespace(laws=(DRAG.pair,), block=block, law=law)
                            for name, law in laws.items()}
    monkeypatch.setattr("slipstick.naming.measured.law_points", lambda one, _: one.law)
    assert measure_laws(fits)[DRAG.pair] is laws[chosen]


def test_errors_are_those_of_the_coefficients(fits: dict[str, BlockFit]) -> None:
    one = fits["contact"]
    law = one.block.law(("output torque sensor", "lag"))
    first = len(one.block.random) + len(one.block.fixed) + 1  # after the offset
    clock = len(one.block.random) + one.block.fixed.index("clock")  # its delay is part of a lag
    places, onto = np.array([clock, *range(first, first + 4)]), np.insert(law.onto, 0, 1.0, axis=1)
    expected = onto @ one.fitted.covariance[np.ix_(places, places)] @ onto.T
    np.testing.assert_allclose(law_points(one, ("output torque sensor", "lag")).covariance, expected)


def test_a_law_known_up_to_a_line_has_any_slope_but_not_any_curvature() -> None:
    x = np.linspace(0, 1, 11)
    finding = Finding((), ("valve current", "current"), np.ones(9))
    band = 0.01 * (np.clip((0.5 - x) / 0.05, -1, 1) + (x - 0.5) * 2)  # a deadband less a line rises, falls and rises
    law = LawPoints(finding.pair, x, "A", band, "A", False, 1e-8 * np.eye(11), "line")
    assert answer(finding, law).effect == "valve_deadband"
    assert answer(finding, replace(law, up_to="constant")).effect == ""
    drag = LawPoints(DRAG.pair, x, "rad/s", np.sin(9 * x), "N m", False, 1e-4 * np.eye(11), "line")
    assert answer(replace(finding, pair=drag.pair), drag).effect == ""


def test_the_shape_of_a_linearised_law_is_tested_with_wider_errors() -> None:
    finding = Finding((), ("clearance", "run order"), np.ones(9))
    law = LawPoints(finding.pair, np.array([0.0, 10, 20, 30]), "1", np.array([-3.5e-5, -7.5e-5, 4e-5, 9e-5]), "m",
                    False, 7e-6**2 * np.eye(4), "constant")
    assert answer(finding, law).effect == ""
    assert answer(finding, replace(law, linearised=True)).effect == "clearance_drift"
    assert answer(finding, replace(law, linearised=True, change=-10 * law.change)).effect == ""


def test_a_law_over_levels_has_no_error_between_them(fits: dict[str, BlockFit]) -> None:
    scene = fits["load"].block.scene
    assert over_runs(("load torque", "motor speed"), scene, 0).at_levels
    assert not over_runs(("load torque", "run order"), scene, 0).at_levels


def test_a_law_over_the_motor_speed_has_the_error_of_the_stated_speeds(fits: dict[str, BlockFit]) -> None:
    pair = ("load torque", "motor speed")
    one = fit(fits["load"].block, (pair,))
    law, onto = law_points(one, pair), one.block.law(pair).onto
    own = np.diag(onto @ one.fitted.covariance[np.ix_(one.places(pair), one.places(pair))] @ onto.T)
    assert law.x is not None
    first = abs((law.change[1] - law.change[0]) / (law.x[1] - law.x[0]))
    assert law.std[0] ** 2 - own[0] == pytest.approx((0.02 * law.x[0] * first) ** 2)
    assert (law.std**2 > own).all()


# The prior of measured laws: what it leaves as it is, what it removes, and the coverage of the bands.


PRECISION = 1 / 9
M = 17


def given(told: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and covariance of measurements of all values with the precisions `told` and the prior of a law."""
    covariance = np.linalg.inv(np.diag(told) + PRECISION * np.eye(len(told)))
    return covariance @ (told * values), covariance


@pytest.mark.parametrize("size", [1.0, 50.0])
def test_the_prior_of_a_strong_law_is_as_wide_as_the_law(size: float) -> None:
    """Its mean is hardly determined, and that of a narrow prior is 0."""
    values, of_mean = size * (1 + np.sin(np.arange(M))), 0.01
    told = 1e4 * (np.eye(M) - 1 / M) + of_mean / M
    covariance = np.linalg.inv(told + PRECISION * np.eye(M))
    coefficients = covariance @ told @ values
    found, errors, factor = widened(coefficients, covariance, np.full(M, PRECISION))
    own = min(PRECISION, 1 / (values**2).mean())
    assert factor * PRECISION == pytest.approx(own, rel=0.1)
    assert (values - found).mean() / values.mean() == pytest.approx(own / (own + of_mean), rel=0.1)
    assert errors.sum() / M == pytest.approx(1 / (own + of_mean), rel=0.1)
    assert (values - coefficients).mean() > 0.9 * values.mean()


def test_what_a_fit_has_not_settled_does_not_widen_the_prior() -> None:
    """A fit that ended early is off where the recordings tell nothing (0) and next to nothing (1)."""
    told = np.array([0.0, 0.0003, 1.0, *[1e5] * (M - 3)])
    values = np.array([0.0, 0.0, 12.0, *np.linspace(8, 15, M - 3)])
    precision = np.full(M, 1 / 9)
    covariance = np.diag(1 / (told + precision))
    off = covariance @ (told * values) + np.array([2.5, 6.0, *[0.0] * (M - 2)])
    change, spread, factor = widened(off, covariance, precision, unsettled=0.3)
    assert 0.01 < factor < 0.2
    assert np.all(np.abs(change[:2]) < 0.5 * np.sqrt(np.diag(spread)[:2]))
    np.testing.assert_allclose(change[3:], values[3:], rtol=1e-3)
    assert widened(off, covariance, precision)[2] < 1e-4  # far wider than the law


def test_a_coefficient_without_a_prior_follows_those_with_one() -> None:
    random = np.random.default_rng(5)
    rows = random.normal(size=(3 * M, M))
    told, precision = rows.T @ rows, np.array([0.0, *[1 / 9] * (M - 1)])
    covariance = np.linalg.inv(told + np.diag(precision))
    values = 40 * random.normal(size=M)
    change, spread, factor = widened(covariance @ (told @ values), covariance, precision)
    wide = np.linalg.inv(told + factor * np.diag(precision))
    assert factor < 0.1
    np.testing.assert_allclose(spread, wide, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(change, wide @ told @ values, rtol=1e-3)


def test_neighbours_tell_what_the_recordings_do_not() -> None:
    x = np.linspace(0, 1, M)
    told = np.where((x > 0.3) & (x < 0.6), 1e-3, 1e4)
    noise = np.random.default_rng(3).normal(size=M) / np.sqrt(told)
    coefficients, before = given(told, 2 * x + noise)
    change, covariance = smoothed(np.eye(M), coefficients, before)
    unknown = told < 1
    assert np.abs(change - 2 * x)[unknown].max() < 0.3 < np.abs(coefficients - 2 * x)[unknown].max()
    assert np.sqrt(np.diag(covariance))[unknown].max() < 0.3 < np.sqrt(np.diag(before))[unknown].min()


def test_a_law_known_up_to_a_constant_has_differences_only() -> None:
    values = np.cumsum(np.random.default_rng(5).normal(size=M))
    onto = np.eye(M) - 1 / M
    covariance = np.linalg.inv(1e4 * onto.T @ onto + PRECISION * np.eye(M))
    change, spread = smoothed(onto, covariance @ (1e4 * onto @ values), covariance)
    np.testing.assert_allclose(onto @ change, values - values.mean(), atol=0.05)
    np.testing.assert_allclose(np.sqrt(np.diag(onto @ spread @ onto.T)), 0.01, rtol=0.1)


def test_a_random_walk_is_as_far_from_its_chords_as_stated() -> None:
    """That of 200 fine steps between two points; errors of the values are no bends."""
    rng = np.random.default_rng(11)
    fine = np.cumsum(rng.normal(size=200 * 400))
    at = fine[::200]
    chords = np.interp(np.arange(len(fine)), np.arange(len(at)) * 200, at)
    off = np.sqrt(np.mean((fine - chords)[: 200 * (len(at) - 1)] ** 2))
    np.testing.assert_allclose(between_points(at, np.zeros((len(at), len(at)))), off, rtol=0.15)
    noisy = at + 5 * rng.normal(size=len(at))
    np.testing.assert_allclose(between_points(noisy, 25 * np.eye(len(at))), off, rtol=0.15)
    assert between_points(3 - 2 * np.arange(9.0), np.zeros((9, 9))) < 1e-12
    assert between_points(np.array([1.0, 5.0]), np.zeros((2, 2))) == 0.0


def test_bands_contain_curves_of_any_kind_as_often_as_they_state() -> None:
    """Smooth curves, steps and a straight line, measured at each of 401 places with noise: 90 % bands of 17 points.

    Without the error between points, the bands of steps contain far less.
    """
    rng = np.random.default_rng(17)
    x, knots = np.linspace(0, 1, 401), np.linspace(0, 1, M)
    hats = np.stack([np.interp(x, knots, row) for row in np.eye(M)], axis=1)
    curves = {"sine": np.sin(7 * x), "steps": np.floor(4.3 * x), "line": x, "bump": np.exp(-((x - 0.4) / 0.05) ** 2)}
    held, narrow = {}, {}
    for name, curve in curves.items():
        shares = []
        for _ in range(40):
            noisy = curve + 0.3 * rng.normal(size=len(x))
            covariance = np.linalg.inv(hats.T @ hats / 0.09 + PRECISION * np.eye(M))
            change, spread = smoothed(np.eye(M), covariance @ (hats.T @ noisy / 0.09), covariance)
            both = [np.interp(x, knots, np.sqrt(np.diag(spread) + extra**2))
                    for extra in (between_points(change, spread), 0.0)]
            shares.append([np.mean(np.abs(hats @ change - curve) < 1.645 * std) for std in both])
        held[name], narrow[name] = np.mean(shares, axis=0)
    assert all(share > 0.85 for share in held.values())
    assert narrow["steps"] < 0.85
