"""Settings of a study: what may be named, and when."""

import pytest

from slipstick.errors import InvalidValue, UnknownName
from slipstick.study.settings import StudySettings


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
