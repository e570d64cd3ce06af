"""Naming on recordings of the independent generator: nothing where there is nothing, and what drifts.

What depends on a further recorded channel is named by it, and an offset of a sensor that drifts with the run order is
told from what else drifts.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.naming import NamingSettings, answer, name, sensor_errors
from slipstick.naming.law_map import of_sensor
from slipstick.naming.scene import Scene
from slipstick.naming.study import Naming
from slipstick.recordings import FurtherChannel, Recordings
from tests.benches import BENCHES, HEAVY
from tests.hidden_laws import PISTON_WARMS, draw_world, record, shipped

COUNT = 36
STRENGTH = 0.2  # of `PISTON_WARMS`
ON = {bench.name: bench for bench in BENCHES}


@pytest.mark.slow
def test_nothing_is_named_on_another_bench_where_everything_scatters(tmp_path: Path) -> None:
    world = draw_world([711], shipped("compact"))
    found = name(ON["compact"], record(tmp_path, seed=711, count=COUNT, bench="compact", world=world))
    assert not found.findings
    assert all(0.9 < chi_square < 1.12 for chi_square in found.chi_square.values())


def test_recordings_that_cannot_tell_are_refused(tmp_path: Path) -> None:
    few = record(tmp_path, seed=713, count=12)
    with pytest.raises(InvalidValue, match="12 engagements"):
        name(HEAVY, few)
    with pytest.raises(InvalidValue, match="12 engagements"):
        name(HEAVY, Recordings(few.conditions, few.measured_time))


def record_temperature(folder: Path, seed: int, of: str) -> tuple[Recordings, np.ndarray]:
    """Recordings whose piston gain warms with the run order, and a temperature `of` that order or of chance."""
    found = record(folder, PISTON_WARMS, seed=seed, count=COUNT)
    assert found.signals is not None
    assert found.run_order is not None
    random = np.random.default_rng(seed)
    share = found.run_order / (COUNT - 1)
    warm = {"order": 40 + 50 * share, "chance": 40 + 50 * random.random(COUNT)}[of]
    noise = random.normal(0, 0.5, (COUNT, len(found.signals.time)))
    channel = FurtherChannel("degC", warm[:, None] + noise)
    conditions = replace(found.conditions, run_order=None)  # the test has no record of the order
    return replace(found, conditions=conditions, run_order=None, further={"oil_temperature": channel}), share


def pairs_of(found: Naming) -> list[tuple[str, str]]:
    return [one.pair for one in found.findings]


@pytest.mark.slow
def test_a_gain_that_warms_is_a_law_over_the_oil_temperature(tmp_path: Path) -> None:
    recordings, share = record_temperature(tmp_path, 714, "order")
    found = name(HEAVY, recordings)
    assert pairs_of(found) == [("piston gain", "oil temperature")]
    said = answer(found.findings[0], found.measured["piston gain", "oil temperature"])
    assert (said.kind, said.effect) == ("unlisted", "")
    law = found.measured["piston gain", "oil temperature"]
    assert (law.x_unit, law.relative) == ("degC", True)
    true = STRENGTH * (1.25 * share - 0.25 * share**2)
    measured = np.interp(40 + 50 * share, law.x, law.change)
    assert np.std(measured - true) < 0.2 * np.std(true)


@pytest.mark.slow
def test_a_temperature_that_nothing_depends_on_is_not_named(tmp_path: Path) -> None:
    recordings, _ = record_temperature(tmp_path, 714, "chance")
    assert not [pair for pair in pairs_of(name(HEAVY, recordings)) if pair[1] == "oil temperature"]


def record_warm_sensor(folder: Path) -> Recordings:
    """Recordings whose pressure sensor reads more when warm, while the oil warms more or less with the run order."""
    recordings = record(folder, seed=714, count=COUNT)
    assert recordings.signals is not None
    assert recordings.run_order is not None
    share = recordings.run_order / (COUNT - 1)
    warm = 30 + 30 * share + np.random.default_rng(714).uniform(0, 20, COUNT)
    pressure = recordings.signals["pressure"] + 0.004 * (warm[:, None] - 20)
    channel = FurtherChannel("degC", np.tile(warm[:, None], (1, pressure.shape[1])))
    return replace(recordings, signals=replace(recordings.signals, pressure=pressure),
                   further={"oil_temperature": channel})


def test_an_error_of_a_sensor_over_a_channel_is_tested_as_one_over_the_run_order_is(tmp_path: Path) -> None:
    scene = Scene.of(HEAVY, record_warm_sensor(tmp_path), NamingSettings())
    for pairs in (sensor_errors.pairs_of(scene, rare, "pressure sensor") for rare in (False, True)):
        assert pairs.count(("pressure sensor", "oil temperature")) == 1
    signal = scene.smooth["pressure"]
    coarse, fine = (sensor_errors.reading(scene, "pressure sensor", "oil temperature", signal, finer)
                    for finer in (0, 1))
    assert fine.shape[1] > coarse.shape[1]
    np.testing.assert_allclose(coarse.sum(axis=1), sensor_errors.drift(scene, "pressure sensor"))  # it may be constant


@pytest.mark.parametrize("finer", [0, 1])
def test_a_law_over_a_channel_has_the_columns_of_its_basis_also_where_the_channel_is_the_same_in_all_runs(
        tmp_path: Path, finer: int) -> None:
    recordings = record_warm_sensor(tmp_path)
    channel = recordings.further["oil_temperature"]
    for values in (channel.values, np.full(channel.values.shape, 60.0)):
        changed = replace(recordings, further={"oil_temperature": replace(channel, values=values)})
        scene, pair = Scene.of(HEAVY, changed, NamingSettings()), ("pressure sensor", "oil temperature")
        basis = sensor_errors.reading(scene, *pair, scene.smooth["pressure"], finer)
        assert of_sensor(pair, scene, finer).onto.shape[1] == basis.shape[1]


@pytest.mark.slow
def test_a_sensor_that_warms_is_named_over_the_temperature_and_not_over_the_run_order(tmp_path: Path) -> None:
    found = name(HEAVY, record_warm_sensor(tmp_path))
    assert pairs_of(found) == [("pressure sensor", "oil temperature")]
    law = found.measured["pressure sensor", "oil temperature"]
    assert law.x is not None
    np.testing.assert_allclose(np.ptp(law.change), 0.004 * np.ptp(law.x), rtol=0.3)


def test_gaps_do_not_count_and_a_channel_without_values_is_not_used(tmp_path: Path) -> None:
    recordings, _ = record_temperature(tmp_path, 714, "order")
    channel = recordings.further["oil_temperature"]
    gap, lost = channel.values.copy(), channel.values.copy()
    gap[3, 7:20], lost[3] = np.nan, np.nan
    whole = Scene.of(HEAVY, recordings, NamingSettings())
    assert whole.unused == []
    changed = ({"oil_temperature": replace(channel, values=one)} for one in (gap, lost))
    with_gap, without = (replace(whole, recordings=replace(recordings, further=its)) for its in changed)
    np.testing.assert_allclose(with_gap.channels["oil temperature"][0], whole.channels["oil temperature"][0], atol=0.2)
    assert (without.channels, without.unused) == ({}, ["oil_temperature"])


def record_drift(folder: Path, seed: int, sensor: str, drift: float) -> Recordings:
    """Recordings of the hidden bench, in which the offset of a sensor drifts by `drift` in its unit over the test."""
    found = record(folder, seed=seed, count=COUNT)
    assert found.signals is not None
    assert found.run_order is not None
    share = found.run_order / (COUNT - 1)
    changed = found.signals[sensor] + drift * (share**0.7)[:, None]
    return replace(found, signals=replace(found.signals, **{sensor: changed}))


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "drift"), [("output_torque", 12.0), ("output_speed", 0.8), ("input_speed", 1.5)])
def test_a_drift_is_named_and_measured(tmp_path: Path, sensor: str, drift: float) -> None:
    found = name(HEAVY, record_drift(tmp_path, 716, sensor, drift))
    pair = f"{sensor.replace('_', ' ')} sensor", "run order"
    assert [one.pair for one in found.findings] == [pair]
    law = found.measured[pair]
    assert law.x is not None
    true = drift * (law.x / (COUNT - 1)) ** 0.7
    np.testing.assert_allclose(law.change, true, atol=0.25 * drift)
