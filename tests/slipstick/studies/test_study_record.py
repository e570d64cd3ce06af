"""A stored result is the same typed values again; a measured law is a table; settings say what may be named."""

import csv
import io
import json
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from slipstick.clutch.effects import CATALOGUE, Effect
from slipstick.clutch.effects.effect import QUANTITIES
from slipstick.errors import InvalidValue, UnknownName
from slipstick.law_files import write_law
from slipstick.studies import StudyResult
from slipstick.studies.export import file_stem, has_table, law_table
from slipstick.studies.figures import Figures
from slipstick.studies.formula import equation
from slipstick.studies.record import from_dict
from slipstick.studies.result import Coefficient
from slipstick.studies.settings import StudySettings

Studied = Callable[[str], tuple[StudyResult, Figures]]


def stored(value: Any) -> Any:
    return json.loads(json.dumps(asdict(value), allow_nan=False))


@pytest.mark.parametrize("name", ["friction", "nothing"])
def test_a_stored_study_is_read_as_it_was(studied: Studied, name: str) -> None:
    result, figures = studied(name)
    assert from_dict(StudyResult, stored(result)) == result
    assert from_dict(Figures, stored(figures)) == figures


def test_a_result_of_another_version_is_refused(studied: Studied) -> None:
    values = stored(studied("friction")[0])
    del values["findings"][0]["law"]["formula"]
    with pytest.raises(InvalidValue, match="The stored Law has no 'formula'"):
        from_dict(StudyResult, values)


def test_a_measured_law_is_a_table_with_units(studied: Studied) -> None:
    one = studied("friction")[0].findings[0]
    law = one.law
    assert law is not None
    assert has_table(one)
    assert file_stem(one) == law_table(one).name == "friction_coefficient_over_slip"
    head, *rows = csv.reader(io.StringIO(write_law(law_table(one), ".csv").decode()))
    assert head == ["slip [rad/s]", "friction_coefficient_relative_change [1]", "lower [1]", "upper [1]", "formula [1]"]
    columns = np.array(rows, float).T.tolist()
    assert columns == [law.x, law.change, law.lower, law.upper, law.formula]
    mat = loadmat(io.BytesIO(write_law(law_table(one), ".mat")))
    assert mat["slip"].ravel().tolist() == law.x
    assert mat["friction_coefficient_relative_change"].ravel().tolist() == law.change
    assert mat["slip_unit"].item() == "rad/s"
    assert mat["known_up_to"].item() == "constant"


def test_a_single_number_is_no_table(studied: Studied) -> None:
    one = studied("friction")[0].findings[0]
    assert one.law is not None
    lag = replace(one, law=replace(one.law, x=None, change=[0.01], lower=[0.0], upper=[0.02], formula=None))
    assert not has_table(lag)
    assert not has_table(replace(one, law=None))
    with pytest.raises(ValueError, match="no law over a number"):
        law_table(lag)


def test_what_a_law_is_over_has_a_name_that_says_what_its_points_are(studied: Studied) -> None:
    one = studied("friction")[0].findings[0]
    gain = replace(one, quantity="pressure sensor", depends_on="gain")
    assert file_stem(gain) == law_table(gain).name == "pressure_sensor_over_reading"


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_an_equation_has_the_number_of_each_coefficient_and_else_what_the_formula_has(
        studied: Studied, effect: Effect) -> None:
    one = studied("friction")[0].findings[0]
    values = [0.0123456 + place for place in range(len(effect.coefficients))]
    coefficients = [Coefficient(each.name, each.unit, value, value, value, False)
                    for each, value in zip(effect.coefficients, values, strict=True)]
    confirmed = replace(one, effect=effect.name, confirmation=replace(one.confirmation, coefficients=coefficients))
    written = equation(confirmed)
    assert written is not None
    for each, value in zip(effect.coefficients, values, strict=True):
        shown = f"{value:.4g}" if each.unit == "1" else f"({value:.4g} {each.unit})"
        assert shown in written
        written = written.replace(shown, each.name)
    name = effect.quantity if effect.quantity in QUANTITIES else f"reading of the {effect.quantity}"
    assert written == f"{name} = {effect.law}"


def test_there_is_no_equation_without_the_formula_of_an_effect(studied: Studied) -> None:
    one = studied("friction")[0].findings[0]
    assert equation(one) is not None
    assert equation(replace(one, effect=None)) is None
    assert equation(replace(one, effect="gone")) is None
    factor = replace(one.confirmation.coefficients[0], name="factor")
    assert equation(replace(one, confirmation=replace(one.confirmation, coefficients=[factor]))) is None


# Settings of a study: what may be named, and when.


def test_settings_come_back_from_json_with_the_same_digest() -> None:
    settings = StudySettings.from_dict({"catalogue": ["supply_droop"], "naming": {"nats": 20.0}})
    assert settings.catalogue == ("supply_droop",)
    assert settings.naming.nats == 20.0
    again = StudySettings.from_dict({"catalogue": ["supply_droop"], "naming": {"nats": 20.0}})
    assert settings.digest == again.digest != StudySettings().digest


@pytest.mark.parametrize(("given", "message"), [
    ({"naming": {"nat": 3}}, "Did you mean 'nats'"), ({"levle": 0.9}, "Did you mean 'level'"),
    ({"catalogue": ["supply_drop"]}, "Did you mean 'supply_droop'")])
def test_a_misspelt_name_is_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(UnknownName, match=message):
        StudySettings.from_dict(given)


@pytest.mark.parametrize("given", [{"level": 1.0}, {"seed": -1}, {"naming": {"nats": -1.0}}, {"catalogue": "droop"},
                                   {"catalogue": ["supply_droop", "supply_droop"]}])
def test_a_value_that_decides_nothing_is_refused(given: dict[str, object]) -> None:
    with pytest.raises(InvalidValue):
        StudySettings.from_dict(given)
