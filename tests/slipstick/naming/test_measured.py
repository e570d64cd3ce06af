"""Measured laws as values: their choice among blocks, their points, and the way to the simulator and to JSON."""

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
from slipstick.naming.measured import LawPoints, law_points, measured
from slipstick.naming.selection import Finding
from slipstick.naming.thinning import thinned
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
    assert thinned(X, change, 3).tolist() == [0, 8, 16]
    assert thinned(X, change, 17).tolist() == list(range(17))
    assert thinned(X, 0.02 * X**2, 9).tolist() == list(range(0, 17, 2))


def test_arrays_that_do_not_belong_together_are_refused() -> None:
    with pytest.raises(InvalidValue, match="load torque over the output speed"):
        replace(DRAG, covariance=np.eye(3))
    with pytest.raises(InvalidValue):
        replace(DRAG, x=None)


def test_a_pair_of_several_blocks_has_the_law_of_the_one_that_determines_it_best(fits: dict[str, BlockFit]) -> None:
    found, each = measured(fits), [law_points(one, OFFSET) for one in fits.values()]
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
    assert measured(fits)[DRAG.pair] is laws[chosen]


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
