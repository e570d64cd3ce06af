"""Each quantity of a bench file, put wrong by a unit or a power of ten, is found, and nothing else is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import Bench, parameters
from slipstick.bench.reader import read
from slipstick.plausibility import Inspection, inspect
from tests.benches import BENCHES, TABLES

TEMPLATE = Bench.open(Path(__file__).parents[3] / "slipstick" / "bench" / "template.toml")
COMPACT = (TABLES / "compact.toml").read_text()
CAPACITY = "[24, 24.2, 24.6, 25.2, 26.3, 27.6, 30, 33, 40, 58, 160]"



def changed(*replacements: tuple[str, str]) -> Bench:
    text = COMPACT
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    return read(text.encode(), "broken.toml")


def keys(inspection: Inspection) -> list[str]:
    return [finding.key for finding in inspection.findings]


@pytest.mark.parametrize("bench", [*BENCHES, TEMPLATE], ids=lambda bench: bench.name)
def test_sound_benches_have_no_findings(bench: Bench) -> None:
    inspection = inspect(bench)
    assert inspection.findings == ()
    assert inspection.behaviour.locked.all()


@pytest.mark.parametrize(("old", "new", "key"), [
    ('"0.03 s"', '"30 s"', "parameters.current_delay"),
    ('"0.03 s"', '"0.03 ms"', "sensors.sample_time"),
    ('"0.15 A"', '"1.5 A"', "parameters.pressure_bias"),
    ('"12 bar/A"', '"12 bar/kA"', "parameters.pressure_bias"),
    ('"12 bar/A"', '"12 bar/mA"', "parameters.friction_coefficient"),
    ('"3e-06 m/bar"', '"3e-04 m/bar"', "parameters.piston_pressure_rate"),
    ('"0.0025 m/(s bar)"', '"0.0025 mm/(s bar)"', "parameters.piston_pressure"),
    ("piston_inertia = 1.0", "piston_inertia = 1e-4", "parameters.piston_pressure_rate"),
    ("piston_inertia = 1.0", "piston_inertia = 100", "conditions"),
    ('"2 1/s"', '"2 1/ms"', "parameters.piston_pressure"),
    ('"1.1 bar"', '"11 bar"', "parameters.pressure_bias"),
    ("temperature_gain = { value = 1.0", "temperature_gain = { value = 0.01", "parameters.piston_pressure"),
    ('"0.0015 m"', '"15 cm"', "parameters.piston_pressure"),
    ('"0.0002 m"', '"2 mm"', "parameters.initial_position"),
    ('"1.5e-05 m"', '"1.5 mm"', "parameters.contact_length"),
    ('"3e-05 N m^2 s"', '"3e-02 N m^2 s"', "parameters.film_coefficient"),
    ('"3e-05 N m^2 s"', '"-3e-05 N m^2 s"', "parameters.film_coefficient"),
    ('"0.00017 N m/Pa"', '"0.00017 N m/kPa"', "conditions.brake_torque"),
    ('"0.00017 N m/Pa"', '"0.017 N m/Pa"', "parameters.friction_coefficient"),
    ('"2 N m"', '"2 kN m"', "converter.capacity_factor"),
    ('"0.01 N m s"', '"-0.01 N m s"', "parameters.input_viscous"),
    ('"0.1 N m s"', '"100 N m s"', "conditions"),
    ("ramp_share = 0.1", "ramp_share = 10", "parameters.ramp_share"),
    ("torque_ratio = [1.95, 1.77, 1.59,", "torque_ratio = [1.95, 1.77, 15.9,", "converter.torque_ratio"),
    (f'values = {CAPACITY}, unit = "rad/s', f'values = {CAPACITY}, unit = "krad/s', "converter.capacity_factor"),
    ("40, 58, 160]", "40, 40, 40]", "converter.speed_ratio"),
    ('"1 ms"', '"1 min"', "sensors.sample_time"),
    ('noise = "0.03 bar"', 'noise = "30 bar"', "sensors.pressure"),
    ('resolution = "0.2 N m"', 'resolution = "2 kN m"', "sensors.output_torque"),
    ('shifting_time = { noise = "2 ms" }', 'shifting_time = { noise = "2 s" }', "sensors.shifting_time"),
    ("values = [5, 15, 30]", "values = [5, 15, 3000]", "conditions.brake_torque"),
    ("values = [0.4, 0.9]", "values = [0.4, 90]", "conditions"),
    ("0.75, 0.75, 0.3, 0.3, 0.85, 0.85]", "0.1, 0.1, 0.1, 0.1, 0.1, 0.1]", "parameters.pressure_bias"),
])
def test_a_broken_quantity_is_found_and_nothing_else(old: str, new: str, key: str) -> None:
    inspection = inspect(changed((old, new)))
    assert keys(inspection) == [key]
    assert all(finding.what and finding.why and finding.remedy for finding in inspection.findings)


@pytest.mark.parametrize("bench", [*BENCHES, TEMPLATE], ids=lambda bench: bench.name)
@pytest.mark.parametrize(("name", "factor", "key"), [
    ("current_delay", 1e3, "current_delay"), ("current_gain", 0.01, "pressure_bias"),
    ("piston_pressure_rate", 1e3, "piston_pressure_rate"), ("piston_pressure", 0.01, "piston_pressure"),
    ("piston_return", 100, "piston_pressure"), ("pressure_bias", 100, "pressure_bias"),
    ("contact_position", 100, "piston_pressure"), ("initial_position", 10, "initial_position"),
    ("contact_length", 1e3, "contact_length"), ("film_coefficient", 1e3, "film_coefficient"),
    ("friction_coefficient", 100, "friction_coefficient"), ("input_coulomb", 1e3, "capacity_factor"),
    ("ramp_share", 100, "ramp_share"), ("output_viscous", 1e3, "conditions")])
def test_a_slip_by_powers_of_ten_is_found_on_every_bench(bench: Bench, name: str, factor: float, key: str) -> None:
    values = tuple(value * (factor if known == name else 1)
                   for known, value in zip(parameters.NAMES, bench.physics.nominal, strict=True))
    found = keys(inspect(replace(bench, physics=replace(bench.physics, nominal=values))))
    assert [entry.split(".")[-1] for entry in found] == [key]


def test_two_broken_quantities_are_both_found() -> None:
    stopped = ("0.75, 0.75, 0.3, 0.3, 0.85, 0.85]", "0.1, 0.1, 0.1, 0.1, 0.1, 0.1]")
    inspection = inspect(changed(('noise = "0.03 bar"', 'noise = "30 bar"'), stopped))
    assert keys(inspection) == ["parameters.pressure_bias", "sensors.pressure"]
    assert keys(inspect(changed(('"0.03 s"', '"0.03 ms"'), stopped))) == ["parameters.pressure_bias",
                                                                         "sensors.sample_time"]


def test_a_finding_names_its_conditions_and_their_numbers() -> None:
    weak, = inspect(changed(("values = [5, 15, 30]", "values = [5, 15, 3000]"))).findings
    assert weak.conditions == tuple(range(2, 90, 3))
    assert "3000 N m" in weak.what
    never, = inspect(changed(("values = [0.4, 0.9]", "values = [0.4, 90]"))).findings
    assert all(row % 6 > 2 for row in never.conditions)
    assert "90 kg m²" in never.what


def without_converter(*replacements: tuple[str, str]) -> Bench:
    head, rest = COMPACT.split("[converter]")
    text = head + "[sensors]" + rest.split("[sensors]")[1]
    text = text.replace("[conditions]\n", '[conditions]\ninput_torque = { values = [60], unit = "N m" }\n'
                        'initial_input_speed = { values = [100], unit = "rad/s" }\n')
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    return read(text.encode(), "driven.toml")


def test_a_bench_without_a_converter_is_checked() -> None:
    assert keys(inspect(without_converter())) == []
    assert keys(inspect(without_converter(("[5, 15, 30]", "[5, 15, 3000]")))) == ["conditions.brake_torque"]


def test_engagements_that_lock_without_the_plates_are_found() -> None:
    # An input without torque and with large losses is slower than the creeping load before the plates touch.
    early, = inspect(without_converter(("[60]", "[0]"), ('"2 N m"', '"50 N m"'), ("[5, 15, 30]", "[0]"))).findings
    assert early.key == "conditions"
    assert "before the plates are pressed" in early.what


def test_the_median_engagement_is_one_that_locks_in_the_middle() -> None:
    behaviour = inspect(TEMPLATE).behaviour
    times = np.sort(behaviour.shifting_time)
    assert behaviour.shifting_time[behaviour.nearest_to(0.5)] in times[7:9]
    assert behaviour.shifting_time[behaviour.nearest_to(0.0)] == times[0]
    assert behaviour.shifting_time[behaviour.nearest_to(1.0)] == times[-1]
