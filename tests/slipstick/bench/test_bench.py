"""A bench as a value: its digests, its scales, and which of a folder belongs to a model and to recordings."""

import shutil
from dataclasses import astuple, fields, replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import Bench, Physics, Scales, parameters
from slipstick.bench.reader import read
from slipstick.bench.scales import SCALES
from slipstick.clutch.model import Model
from slipstick.errors import BadBench, InvalidValue, UnknownName
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from tests.benches import BENCHES, COMPACT, HEAVY, TABLES

TEXT = (TABLES / "heavy.toml").read_text()


def edited(old: str, new: str) -> Bench:
    assert old in TEXT
    return read(TEXT.replace(old, new, 1).encode(), "heavy.toml")


@pytest.mark.parametrize(("old", "new"), [
    ("gear_ratio = 3.2", "gear_ratio = 3.200001"), ('"0.25 kg m^2"', '"0.26 kg m^2"'),
    ("torque_ratio = [2.2,", "torque_ratio = [2.21,"), ("[12, 12, 12.1,", "[12, 12.01, 12.1,"),
    ("speed_ratio = [0, 0.1,", "speed_ratio = [0, 0.11,"),
])
def test_the_physics_digest_is_that_of_parameters_and_curves(old: str, new: str) -> None:
    other = edited(old, new)
    assert other.digest != HEAVY.digest
    assert other.sensing_digest == HEAVY.sensing_digest
    with pytest.raises(InvalidValue, match="another bench than 'heavy'"):
        HEAVY.require(other.physics)


@pytest.mark.parametrize(("old", "new"), [
    ('noise = "0.25 rad/s"', 'noise = "0.26 rad/s"'), ('sample_time = "2 ms"', 'sample_time = "1 ms"'),
    ('noise = "0.05 bar"', 'noise = "0.05 bar", lag = "1 ms"'), ("lower = 0.1", "lower = 0.2"),
    ('noise = "0.05 bar"', 'noise = "0.05 bar", resolution = "1 mbar"'), ("upper = 3 ", "upper = 3, scatter = 0.08 "),
    ("gear_ratio = 3.2", "gear_ratio = { value = 3.2, uncertain = true }"), ('shifting_time = { noise = "3 ms" }', ""),
])
def test_the_sensing_digest_is_that_of_sensors_and_priors(old: str, new: str) -> None:
    other = edited(old, new)
    assert other.sensing_digest != HEAVY.sensing_digest
    assert other.digest == HEAVY.digest
    HEAVY.require(other.physics)


@pytest.mark.parametrize(("old", "new"), [
    ('title = "Heavy-vehicle test bench"', 'title = "Another"'), ("The paper publishes", "The paper does publish"),
    ('name = "heavy"', 'name = "weighty"'), ('"0.05 s"', '"5e1 ms"'),
])
def test_names_words_and_units_enter_no_digest(old: str, new: str) -> None:
    other = edited(old, new)
    assert (other.digest, other.sensing_digest) == (HEAVY.digest, HEAVY.sensing_digest)


def test_conditions_have_their_own_digest() -> None:
    other = edited("[20, 50, 80]", "[20, 50, 81]")
    assert other.conditions.digest != HEAVY.conditions.digest
    assert (other.digest, other.sensing_digest) == (HEAVY.digest, HEAVY.sensing_digest)


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_the_shipped_benches_are_whole(bench: Bench) -> None:
    assert bench.source
    assert len(bench.uncertain) == 7
    assert bench.sensors["shifting_time"].noise
    assert bench.conditions.profile_time is bench.profiles[0]
    assert all(bench.prior(name).lower < 1 < bench.prior(name).upper for name in bench.uncertain)
    with pytest.raises(UnknownName, match="Did you mean 'gear_ratio'"):
        bench.prior("gear_rate")
    assert (len(HEAVY.conditions), len(COMPACT.conditions)) == (216, 90)
    assert HEAVY.digest != COMPACT.digest


def test_physics_of_other_numbers_are_refused() -> None:
    for nominal in (HEAVY.physics.nominal[:-1], (*HEAVY.physics.nominal[:-1], float("nan"))):
        with pytest.raises(InvalidValue, match="not 20 finite numbers"):
            replace(HEAVY.physics, nominal=nominal)


# The scales of a bench, from their definitions and the numbers of the bench files.


def changed(bench: Bench, name: str, value: float) -> Bench:
    nominal = list(bench.physics.nominal)
    nominal[parameters.index(name)] = value
    return replace(bench, physics=Physics(tuple(nominal), bench.physics.converter))


def test_the_scales_of_the_heavy_bench() -> None:
    pressure, speed = 20 * (0.8 - 0.1), 1900 * pi / 30
    torque = 0.00032e5 * pressure
    expected = Scales(pressure, 0.8, speed, speed / 3.2, torque, 3.2 * torque, 0.002, 0.0016 * pressure, 0.05,
                      0.5 * 14 * (speed / 3.2) ** 2 / 1000)
    np.testing.assert_allclose(astuple(HEAVY.scales), astuple(expected))


def test_the_scales_of_the_compact_bench() -> None:
    pressure, speed = 12 * (0.95 - 0.15), 3000 * pi / 30
    torque = 0.00017e5 * pressure
    expected = Scales(pressure, 0.95, speed, speed / 1.8, torque, 1.8 * torque, 0.0015, 0.0025 * pressure, 0.03,
                      0.5 * 0.9 * (speed / 1.8) ** 2 / 1000)
    np.testing.assert_allclose(astuple(COMPACT.scales), astuple(expected))


def test_every_scale_has_a_unit_and_words_and_is_positive() -> None:
    assert [*SCALES] == [field.name for field in fields(Scales)]
    assert all(unit and words for unit, words in SCALES.values())
    assert all(value > 0 for bench in BENCHES for value in astuple(bench.scales))


def test_the_piston_rate_is_that_of_the_piston_equation() -> None:
    assert changed(HEAVY, "piston_inertia", 2.0).scales.piston_rate == pytest.approx(HEAVY.scales.piston_rate / 2)


def test_an_input_shaft_without_converter_may_start_faster_than_the_motor() -> None:
    n = len(HEAVY.conditions)
    given = replace(HEAVY.conditions, input_torque=np.full(n, 100.0), initial_input_speed=np.full(n, 300.0))
    assert Scales.of(HEAVY.physics, given).speed == 300.0
    assert Scales.of(HEAVY.physics, replace(given, initial_input_speed=np.zeros(n))).speed == HEAVY.scales.speed


def test_profiles_below_the_bias_have_no_scales() -> None:
    with pytest.raises(InvalidValue, match=r"0\.8 A, gives no oil pressure: the current bias is 0\.9 A"):
        _ = changed(HEAVY, "current_bias", 0.9).scales


# Which bench of a folder belongs to a model and to recordings.


@pytest.fixture
def library(tmp_path: Path) -> Library:
    for name in ("heavy.toml", "compact.toml"):
        shutil.copy(TABLES / name, tmp_path)
    return Library(tmp_path)


def test_a_bench_is_found_by_its_physics_and_by_its_profiles(library: Library) -> None:
    assert library.benches() == ["compact", "heavy"]
    for bench, recorded in ((HEAVY, "measured.h5"), (COMPACT, "measured-compact.h5")):
        shipped = Recordings.open(TABLES / recorded)
        assert library.bench_of_recordings(shipped) == bench.name
        assert shipped.conditions.digest == bench.conditions.digest
        assert library.bench_of_model(Model(bench.physics).with_parameters({"gear_ratio": 2.5}).physics) == bench.name


def test_none_and_more_than_one_bench_are_refused(library: Library) -> None:
    text = (TABLES / "heavy.toml").read_text()
    (library.folder / "copy.toml").write_text(text.replace('noise = "6 N m"', 'noise = "7 N m"'))
    with pytest.raises(UnknownName, match=r"More than one bench has .*\. Name the bench\. Known: compact, copy, heavy"):
        library.bench_of_model(HEAVY.physics)
    for name in ("copy", "heavy"):
        (library.folder / f"{name}.toml").unlink()
    with pytest.raises(UnknownName, match="No bench has the physics"):
        library.bench_of_model(HEAVY.physics)
    with pytest.raises(UnknownName, match="No bench has the current profiles"):
        library.bench_of_recordings(Recordings.open(TABLES / "measured.h5"))


def test_a_broken_bench_does_not_hide_the_others(library: Library) -> None:
    (library.folder / "broken.toml").write_text("[parameters")
    assert library.bench_of_model(HEAVY.physics) == "heavy"
    with pytest.raises(BadBench, match=r"broken\.toml is not TOML"):
        library.bench("broken")


def test_a_changed_file_is_read_again(library: Library) -> None:
    before = library.bench("heavy")
    path = library.folder / "heavy.toml"
    path.write_text(path.read_text().replace("gear_ratio = 3.2", "gear_ratio = 3.25"))
    assert library.bench("heavy").digest != before.digest


def test_other_profiles_have_no_bench() -> None:
    recordings = Library(TABLES).recording("measured-compact")
    for factor, profiles in ((1.01, slice(None)), (1.0, slice(0, 1))):
        conditions = recordings.conditions
        other = replace(conditions.take([0]), profile_time=conditions.profile_time[profiles],
                        profile_current=factor * conditions.profile_current[profiles])
        with pytest.raises(UnknownName, match="No bench"):
            Library(TABLES).bench_of_recordings(Recordings(other, recordings.measured_time[:1]))
