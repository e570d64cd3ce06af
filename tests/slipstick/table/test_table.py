import pickle
from dataclasses import replace

import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.table import Axis, Grid
from tests.benches import HEAVY, NOMINAL


def test_conditions_are_matched_by_value(table):
    points = np.random.default_rng(2).uniform(0.6, 1.4, (20, 2))
    times = table.interpolate(points)
    paper = HEAVY.conditions
    assert np.array_equal(table(points, table.conditions), times)
    assert np.array_equal(table(points, paper.take([215, 3])), times[:, [2, 0]])
    rounded = replace(paper.take([100]), motor_speed=paper.motor_speed[[100]] * (1 + 1e-13))
    assert np.array_equal(table(points, rounded), times[:, [1]])


def test_unknown_conditions_are_rejected(table):
    paper = HEAVY.conditions
    for other in (paper.take([3, 4]), replace(paper.take([100, 3]), profile_current=paper.profile_current * 1.001)):
        with pytest.raises(InvalidValue, match="is not in the table"):
            table(np.ones((1, 2)), other)


def test_points_outside_are_clipped_when_the_table_is_called(table):
    assert np.array_equal(table(np.array([[0.1, 1.0]]), table.conditions), table.interpolate(np.array([[0.5, 1.0]])))
    assert (table.lower.tolist(), table.upper.tolist()) == ([0.5, 0.5], [1.5, 1.5])


def test_the_digest_depends_on_the_content_only(table):
    axes, times, status = table.axes, table.times, table.status
    faster = replace(table.conditions, motor_speed=table.conditions.motor_speed * 1.01)
    later = times.copy()
    later[3, 3, 1] = np.nextafter(later[3, 3, 1], 2)
    failed = np.where(status == 1, 2, status).astype(np.uint8)
    others = [
        Grid(axes, later, status, table.conditions, table.model),
        Grid(axes, times, failed, table.conditions, table.model),
        Grid(axes, times, status, faster, table.model),
        Grid(axes, times, status, table.conditions, NOMINAL.with_parameters({"gear_ratio": 3.0})),
        *(Grid((replace(axes[0], **change), axes[1]), times, status, table.conditions, table.model)
          for change in ({"name": "gear_ratio"}, {"nominal": 1.7}, {"unit": "Pa"},
                         {"values": axes[0].values + 0.01})),
    ]
    assert len({table.digest, *(other.digest for other in others)}) == len(others) + 1
    assert Grid(axes, times.copy(), status, table.conditions, NOMINAL, "another origin").digest == table.digest


def test_the_run_order_matters_only_if_an_effect_depends_on_it(table, tmp_path):
    drifting = NOMINAL.with_effect("temperature_drift", {"drift": 0.02})
    ordered, other = (replace(table.conditions, run_order=np.array(order)) for order in ([2, 0, 1], [0, 2, 1]))
    constant, drift = replace(table, conditions=ordered), replace(table, conditions=ordered, model=drifting)
    assert constant.digest == table.digest
    assert drift.digest != replace(drift, conditions=other).digest
    points = np.ones((1, 2))
    for name, written in (("constant", constant), ("drift", drift)):
        written.write(tmp_path / name)
        read = Grid.open(tmp_path / name)
        assert read.digest == written.digest
        assert np.array_equal(read(points, ordered.take([1, 2])), written.interpolate(points)[:, 1:], equal_nan=True)
    assert Grid.open(tmp_path / "constant").conditions.run_order is None
    assert np.array_equal(constant(points, other), constant.interpolate(points), equal_nan=True)
    for unknown in (other, table.conditions):
        with pytest.raises(InvalidValue, match="not in the table at its position in the run order"):
            drift(points, unknown)


def test_inconsistent_fields_are_rejected(table):
    locked = np.zeros_like(table.status)
    for change, message in [({"status": locked}, "contradict"), ({"status": table.status + 3}, "contradict"),
                            ({"times": table.times[:-1]}, "not float64"), ({"axes": table.axes[:1] * 2}, "axes"),
                            ({"times": table.times.astype("f4")}, "float32")]:
        with pytest.raises(InvalidValue, match=message):
            replace(table, **change)
    for values in ([1.0], [1.0, 1.0], [1.0, np.nan], [2.0, 1.0]):
        with pytest.raises(InvalidValue, match="pressure_bias"):
            Axis("pressure_bias", np.array(values), 1.6, "bar")


def test_can_be_pickled(table):
    table(np.ones((1, 2)), table.conditions.take([1]))
    assert pickle.loads(pickle.dumps(table)).digest == table.digest
