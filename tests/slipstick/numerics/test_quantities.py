"""Quantities as text and multiples as physical values: converted, or refused with the reason."""

import numpy as np
import pytest

from slipstick.black_box import BlackBoxDescription, Input, Quantity
from slipstick.errors import UnknownName
from slipstick.numerics.quantities import NotAQuantity, convert, describe_quantity, factor_of, in_unit, raised
from slipstick.table.physical_values import PhysicalInput, physical_inputs
from tests.benches import NOMINAL


@pytest.mark.parametrize(("text", "unit", "value"), [
    ("50 ms", "s", 0.05), ("160 kPa", "bar", 1.6), ("2 mm", "m", 0.002), ("1500 rpm", "rad/s", 50 * np.pi),
    ("180 degree/s", "rad/s", np.pi), ("3 mm/(s bar)", "m/(s bar)", 0.003), ("2500 kg cm**2", "kg m^2", 0.25),
    ("12 rpm/(N m)^0.5", "rad/s/(N m)^0.5", 0.4 * np.pi), ("60 1/min", "1/s", 1.0), ("8 %", "1", 0.08),
    (0.08, "1", 0.08), ("3 min^-1", "1/s", 0.05), ("10 mmH2O", "bar", 9.80665e-4), ("3 N m/(rad/s)", "N m s", 3.0),
    ("20 degC", "K", 293.15), ("5 Nm", "N m", 5.0), ("5 mNm", "N m", 0.005), ("5 kNm", "N m", 5000.0),
    ("5 Nms", "N m s", 5.0), ("5 mNm/A", "N m/A", 0.005), ("5 Nm/rad", "N m/rad", 5.0), ("5 N·m", "N m", 5.0),
    ("5 N m^2", "Nm^2", 5.0), ("5 Nms^2", "kg m^2", 5.0), ("5 1/Nm", "1/(N m)", 5.0), ("5 rad/mNm", "rad/Nm", 5000.0),
    ("5 N m", "mNm", 5000.0), ("5 nm", "m", 5e-9),
])
def test_conversion(text: str | float, unit: str, value: float) -> None:
    assert in_unit(text, unit) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(("text", "unit", "says"), [
    ("50", "s", "the unit is missing"), (50, "s", "the unit is missing"), ("ms", "s", "'ms' is not a number, a space"),
    ("50ms", "s", "'50ms' is not a number, a space and its unit"), ("none", "1", "'none' is not a number$"),
    ("50 sekunden", "s", "cannot be converted to s"), ("50 bar", "s", "cannot be"),
    (True, "1", "is not a quantity"), ("nan s", "s", "not finite"), ("1e400 s", "s", "not finite"),
    # To pint these are rad/min and rad/s, wrong by 2 pi for a speed in revolutions.
    ("1500 1/min", "rad/s", "which angle"), ("25 Hz", "rad/s", "which angle"),
    # pint would evaluate these, some of them for ever.
    ("1 9**9**9**9 s", "s", "not a product of units"), ("1 s^9^9^9^9", "s", "not a product of units"),
    ("1 (s^9)^9^9", "s", "not a product of units"), ("1 s**999999999", "s", "not a product of units"),
    ("1 2 s", "s", "not a product of units"), ("1 s 1e9", "s", "not a product of units"),
])
def test_what_is_no_quantity_is_refused(text: str | float, unit: str, says: str) -> None:
    with pytest.raises(NotAQuantity, match=says):
        in_unit(text, unit)


@pytest.mark.parametrize(("text", "unit", "remedy"), [
    ("1500 1/min", "rad/s", "Write rpm (for 1/min) or revolution/s (for 1/s or Hz) in its place if it counts"),
    ("50 sekunden", "s", "State the unit that the numbers have, spelled such as s, or"),
    ("1500 U/min", "rad/s", "State the unit that the numbers have, spelled such as rpm or rad/s, or"),
    ("50 bar", "1", "Give plain numbers"),
])
def test_the_remedy_of_a_refused_unit_keeps_the_meaning_of_the_number(text: str, unit: str, remedy: str) -> None:
    with pytest.raises(NotAQuantity) as refused:
        in_unit(text, unit)
    assert refused.value.remedy.startswith(remedy)


def test_errors_have_no_words_of_the_library_of_units() -> None:
    for written, reason in (("mNm", "they are units of different quantities"), ("N foo", "'foo' is not a known unit"),
                            ("mm/(s", "it is not a unit")):
        with pytest.raises(NotAQuantity) as refused:
            convert(np.ones(1), written, "A")
        assert str(refused.value) == f"the unit '{written}' cannot be converted to A ({reason})"


def test_units_with_different_zeros_have_no_factor() -> None:
    assert factor_of("kPa", "bar") == pytest.approx(0.01)
    with pytest.raises(NotAQuantity, match="zeros of degC and K differ"):
        factor_of("degC", "K")


def test_arrays_keep_their_shape_and_values_in_the_same_unit_their_bits() -> None:
    values = np.random.default_rng(1).standard_normal((3, 4))
    assert np.array_equal(convert(values, "bar", "bar"), values)
    np.testing.assert_allclose(convert(values, "kPa", "bar"), values / 100)


# Multiples as physical values: those of the model or machine, which need not be those of the bench.


MOTOR = BlackBoxDescription("motor", (Input("resistance", "ohm", 1.2, 0.5, 1.5),), (Quantity("voltage", "V"),),
                Quantity("run_up_time", "s"), "")


def test_multiples_are_of_the_model_or_of_the_machine() -> None:
    assert physical_inputs(MOTOR, ("resistance",), (0.5,), (0.25,)) == [
        PhysicalInput("resistance", "ohm", 1.2, 0.6, pytest.approx(0.3))]
    made = NOMINAL.with_parameters({"pressure_bias": 2.0})
    assert physical_inputs(made, ("initial_position", "pressure_bias"), (1.2, 0.5), (0.1, 0.25)) == [
        PhysicalInput("initial_position", "m", 5e-4, pytest.approx(6e-4), pytest.approx(5e-5)),
        PhysicalInput("pressure_bias", "bar", 2.0, 1.0, 0.5)]


def test_an_unknown_input_is_refused() -> None:
    with pytest.raises(UnknownName):
        physical_inputs(NOMINAL, ("pressure",), (1.0,), (0.1,))
    with pytest.raises(UnknownName):
        physical_inputs(MOTOR, ("initial_position",), (1.0,), (0.1,))


@pytest.mark.parametrize(("unit", "read"), [
    ("kg m^2", "kg m²"), ("1/(degC)", "1/°C"), ("N m/(rad/s)", "N m/(rad/s)"), ("bar^0.5", "bar^0.5"),
    ("(0.002 1/(bar)) * pressure^2", "(0.002 1/bar) * pressure²")])
def test_units_are_written_as_people_read_them(unit: str, read: str) -> None:
    assert raised(unit) == read
    assert describe_quantity("load", 6.0, unit) == f"load 6 {read}"
    assert describe_quantity("load", 6.0, "1") == "load 6"
