"""Bench files: what is wrong is refused by key and line, and what is written in any unit is converted."""

import re
from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import TEMPLATE, Bench, Prior, Sensor
from slipstick.bench.reader import read
from slipstick.errors import BadBench, UnknownName
from tests.benches import HEAVY, TABLES

TEXT = (TABLES / "heavy.toml").read_text()
INERTIA, SPEED_RATIO = 'input_inertia = "0.25 kg m^2"', "speed_ratio = [0, 0.1, 0.2,"
PROFILE = "time = { values = [0, 0.002, 0.105, 0.115, 0.255, 1.605, 3.5]"
DELAY = 'current_delay = { value = "0.05 s", uncertain = true, lower = 0.5, upper = 1.5 }'
MANY = "[" + ", ".join(str(k / 1000) for k in range(201)) + "]"


def edited(old: str, new: str) -> bytes:
    assert old in TEXT
    return TEXT.replace(old, new, 1).encode()


@pytest.mark.parametrize(("old", "new", "key", "says"), [
    (INERTIA, 'input_inerta = "0.25 kg m^2"', "parameters.input_inerta", "unknown. Did you mean 'input_inertia'"),
    ("[converter]", "[convertor]", "convertor", "unknown. Did you mean 'converter'"),
    ("lower = 0.5", "lowest = 0.5", "parameters.current_delay.lowest", "unknown. Did you mean 'lower'"),
    ('noise = "0.25 rad/s"', 'nois = "0.25 rad/s"', "sensors.input_speed.nois", "unknown. Did you mean 'noise'"),
    ('sample_time = "2 ms"\n', "", "sensors.sample_time", "the key is missing"),
    (INERTIA + "\n", "", "parameters.input_inertia", "the key is missing"),
    (INERTIA, 'input_inertia = "0.25 bar"', "parameters.input_inertia", "'bar' cannot be converted to kg m^2"),
    (INERTIA, "input_inertia = 0.25", "parameters.input_inertia", "the unit is missing; the model uses kg m^2"),
    (INERTIA, 'input_inertia = ["0.25 kg m^2"]', "parameters.input_inertia", "is not a quantity"),
    ("piston_inertia = 1.0", "piston_inertia = nan", "parameters.piston_inertia", "not finite"),
    (INERTIA, 'input_inertia = "-0.25 kg m^2"', "parameters.input_inertia", "-0.25 kg m^2 is not positive"),
    (DELAY, DELAY.replace("lower = 0.5", "lower = 1.1"), "parameters.current_delay.lower",
     "the bounds 1.1 to 1.5 do not enclose the nominal value"),
    (DELAY, DELAY.replace("lower = 0.5", "lower = -1"), "parameters.current_delay.lower", "that must be positive"),
    (DELAY, DELAY.replace("true", '"yes"'), "parameters.current_delay.uncertain", "'yes' is neither true nor false"),
    (DELAY, DELAY.replace("lower = 0.5", "scatter = 1.2"), "parameters.current_delay.scatter", "not between 0 and 1"),
    ('value = "0.1 A"', 'value = "0 A"', "parameters.current_bias.uncertain", "those of 0 are all 0"),
    ('noise = "0.25 rad/s"', 'noise = "-0.25 rad/s"', "sensors.input_speed.noise", "-0.25 is negative"),
    ('sample_time = "2 ms"', 'sample_time = "0 ms"', "sensors.sample_time", "0 s is not positive"),
    (SPEED_RATIO, SPEED_RATIO.replace("0.2", "0.05"), "converter.speed_ratio", "do not rise"),
    (SPEED_RATIO, SPEED_RATIO.replace("0.2,", ""), "converter.speed_ratio", "12, 13 and 13 points"),
    (SPEED_RATIO, "speed_ratio = " + MANY + "\nother = [", "converter.other", "the key is unknown"),
    (SPEED_RATIO, SPEED_RATIO.replace("0.2", "true"), "converter.speed_ratio", "a list of numbers is needed"),
    (SPEED_RATIO, SPEED_RATIO.replace("0.2", "1" + 400 * "0"), "converter.speed_ratio", "not finite"),
    ("torque_ratio = [2.2,", "torque_ratio = [-2.2,", "converter.speed_ratio", "a torque ratio is negative"),
    ('unit = "rad/s/(N m)^0.5"', 'unit = "rad/s"', "converter.capacity_factor", "'rad/s' cannot be converted"),
    ('unit = "rpm"', 'unit = "1/min"', "conditions.motor_speed", "does not say which angle"),
    (', unit = "rpm"', "", "conditions.motor_speed.unit", "the key is missing"),
    ("[1000, 1300, 1600, 1900]", "[1000, 0]", "conditions", "motor_speed has values that are not finite and positive"),
    ("[1000, 1300, 1600, 1900]", f"{list(range(1, 5000))}", "conditions", "more than 100,000 conditions"),
    ("brake_torque = {", "input_torque = {", "conditions.input_torque", "the key is unknown"),
    (PROFILE, PROFILE.replace("0.115", "0.1"), "profiles.0.time", "times that rise from 0"),
    (PROFILE, PROFILE.replace("0.115, ", ""), "profiles.0.time", "6 times and 7 currents"),
    ("time = { values = [0, 0.002, 0.125", "tim = { values = [0, 0.002, 0.125", "profiles.1.tim", "you mean 'time'"),
    ('name = "heavy"', "name = 3", "name", "3 is not a text"),
    ('name = "heavy"', 'name = "../heavy"', "name", "is not a valid name"),
    ('title = "Heavy-vehicle test bench"', 'titel = "A bench"', "titel", "Did you mean 'title'"),
])
def test_what_is_wrong_is_named_by_key_and_line(old: str, new: str, key: str, says: str) -> None:
    content = edited(old, new)
    with pytest.raises(BadBench) as refused:
        read(content, "my.toml")
    message = str(refused.value)
    assert says.lower() in message.lower()
    assert refused.value.remedy
    place = re.match(r"my\.toml, line (\d+), ([\w.]+): ", message)
    assert place, message
    assert place[2] == key
    # The line is the one that was edited; that of the table where the key is missing or several lines do not agree; and
    # that of the first curve where the curves do not agree.
    line = TEXT[:TEXT.index(old)].count("\n") + 1
    if (not new and old.endswith("\n")) or key == "conditions":
        line = TEXT.splitlines().index(f"[{key.split('.')[0]}]") + 1
    elif key == "converter.speed_ratio":
        line = next(n for n, text in enumerate(TEXT.splitlines(), 1) if text.startswith("speed_ratio"))
    elif key == "converter.other":
        line += 1
    assert int(place[1]) == line


@pytest.mark.parametrize(("content", "says"), [
    (b"name = 1\nx = [,\n", "is not TOML.*line 2"), (b"\xff\xfe", "Byte 0 of my.toml is not UTF-8"),
    (b"x = " + b"9" * 5000, "is not TOML"),
    (b"x = " + b"[" * 100_000, "is not TOML"), (b" " * (5 << 20), "is larger than"),
    (edited("[[profiles]]", "[[other]]"), "other: the key is unknown"),
    (TEXT.split("[[profiles]]")[0].encode(), "profiles: current profiles are needed"),
    (b"profiles = [1]\n" + TEXT.split("[[profiles]]")[0].encode(), "profiles: 1 is not a current profile"),
    (b"parameters = 3", "title: the key is missing|parameters: a table is needed"),
])
def test_what_is_no_bench_is_refused(content: bytes, says: str) -> None:
    with pytest.raises(BadBench, match=says):
        read(content, "my.toml")


def test_lines_are_those_of_keys_and_not_of_a_text_that_mentions_them() -> None:
    text = TEXT.replace("The paper publishes no", "input_inertia = 3\nThe paper publishes no", 1)
    text = text.replace(INERTIA, "input_inertia = 3", 1)
    with pytest.raises(BadBench) as refused:
        read(text.encode(), "my.toml")
    assert f"line {text.splitlines().index('input_inertia = 3', 10) + 1}," in str(refused.value)


def test_too_many_converter_points_are_refused() -> None:
    many = {"speed_ratio": MANY, "torque_ratio": str([1.0] * 201),
            "capacity_factor": f'{{ values = {[20.0] * 201}, unit = "rad/s/(N m)^0.5" }}'}
    curves = "".join(f"{name} = {values}\n" for name, values in many.items())
    before, after = TEXT.split("[converter]")[0], TEXT[TEXT.index("# Standard deviation of the noise"):]
    with pytest.raises(BadBench, match=r"converter\.speed_ratio: .*201, 201 and 201 points\. Give 2 to 200"):
        read(f"{before}[converter]\n{curves}\n{after}".encode(), "my.toml")
    fewer = curves.replace("0.2]", "]").replace(", 1.0]", "]").replace(", 20.0]", "]")
    assert len(read(f"{before}[converter]\n{fewer}\n{after}".encode(), "my.toml").physics.curves.speed_ratio) == 200


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(TEXT)
    (tmp_path / "mind_map.toml").write_text("[signals.pressure]\nchannel = 'p'\n")  # no bench
    (tmp_path / "minded.toml").write_text("no TOML")
    with pytest.raises(UnknownName, match=r"Did you mean 'mine\.toml'\? Known: compact, heavy, mine\.toml\.$"):
        Bench.open(tmp_path / "mind.toml")


@pytest.mark.parametrize(("old", "new"), [
    ('"4e-06 m/bar"', '"40 um/MPa"'), ('"0.0016 m/(s bar)"', '"1.6 mm/s/bar"'), ('"20 bar/A"', '"2 kPa/mA"'),
    ('"0.25 kg m^2"', '"2500 kg cm**2"'), ('"1 1/s"', '"60 1/min"'), ("ramp_share = 0.08", 'ramp_share = "8 %"'),
    ('[1000, 1300, 1600, 1900], unit = "rpm"', '[6000, 7800, 9600, 11400], unit = "degree/s"'),
    ('[20, 50, 80], unit = "N m"', '[0.02, 0.05, 0.08], unit = "kN m"'), ('"2 ms"', '"0.002 s"'),
    (PROFILE + ', unit = "s"', "time = { values = [0, 2, 105, 115, 255, 1605, 3500]" + ', unit = "ms"'),
    ("[0.1, 0.7, 0.7, 0.3, 0.3, 0.7, 0.7], unit = \"A\"", "[100, 700, 700, 300, 300, 700, 700], unit = \"mA\""),
])
def test_any_unit_of_the_dimension_gives_the_same_bench(old: str, new: str) -> None:
    other = read(edited(old, new), "my.toml")
    np.testing.assert_allclose(other.physics.nominal, HEAVY.physics.nominal, rtol=1e-14)
    for mine, theirs in zip(other.conditions.columns(), HEAVY.conditions.columns(), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-14)
    assert other.sample_time == HEAVY.sample_time
    assert other.conditions.digest == HEAVY.conditions.digest


def test_sensors_and_priors_are_those_of_the_file() -> None:
    other = read(edited(DELAY, DELAY.replace("upper = 1.5", "upper = 2.5, scatter = 0.03")), "my.toml")
    assert other.prior("current_delay") == Prior(True, 0.5, 2.5, 0.03)
    assert other.prior("gear_ratio") == Prior()
    assert len(other.uncertain) == 7
    other = read(edited('output_speed = { noise = "0.08 rad/s" }', 'output_speed = { noise = "1 rpm", lag = "3 ms" }'),
                 "my.toml")
    assert other.sensors["output_speed"] == Sensor(np.pi / 30, None, 0.003)
    assert read(edited('output_speed = { noise = "0.08 rad/s" }\n', ""), "my.toml").sensors["output_speed"] == Sensor()


def test_the_template_is_a_bench() -> None:
    bench = Bench.open(TEMPLATE)
    assert len(bench.conditions) == 2 * 2 * 2 * 2
    assert len(bench.uncertain) == 7
