"""A bench as a value, and which of its digests depends on what."""

from dataclasses import replace

import pytest

from slipstick.bench import Bench
from slipstick.bench.reader import read
from slipstick.errors import InvalidValue, UnknownName
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
