"""Studies of recordings from an independent bench with hidden effects, a small part of the blind benchmark.

`python -m benchmarks.study_blind` runs all of it.
"""

from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hidden import EFFECTS, Case, write

from slipstick.recordings import Recordings
from slipstick.study import study
from slipstick.study.comparison import compare
from slipstick.study.conclusion import conclude
from slipstick.study.settings import StudySettings
from tests.benches import HEAVY

COUNT = 30


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The result of a study with default settings, of recordings with the given hidden effects."""
    @cache
    def result(seed: int, *hidden: str) -> dict[str, Any]:
        path = Path(tmp_path_factory.mktemp("sealed")) / "recordings.h5"
        write(path, Case({effect: EFFECTS[effect].typical for effect in hidden}, seed=seed, count=COUNT))
        settings = StudySettings()
        compared = compare(HEAVY, Recordings.open(path), settings.shifting_time_noise)
        state = study.start(settings, compared)
        while not study.finished(state):
            state = study.advance(settings, compared, state)
        return conclude(settings, compared, state)

    return result


def test_friction_that_falls_with_slip_is_found_and_closes_the_gap(studied: Any) -> None:
    result = studied(41, "friction_falls_with_slip")
    assert result["answer"]["effects"] == ["stribeck_friction"]
    assert result["gap"]["closures"]["shifting_time"]["closure"] > 0.8
    coefficients = {entry["coefficient"]: entry for entry in result["answer"]["coefficients"]}
    assert coefficients["strength"]["lower"] > 0, "the interval contains zero"


def test_a_wrong_effect_does_not_close_the_gap(studied: Any) -> None:
    control = studied(41, "friction_falls_with_slip")["gap"]["control"]
    assert control["effect"] != "stribeck_friction"
    closed = control["closures"]["shifting_time"]["closure"]
    assert closed is not None, "no gap was clear, so that the control says nothing"
    assert closed < 0.5


@pytest.mark.parametrize("seed", [11, 12])
def test_no_effect_is_found_in_recordings_without_one(studied: Any, seed: int) -> None:
    assert studied(seed)["answer"]["kind"] == "none"


def test_an_effect_outside_the_catalogue_is_reported_as_unlisted(studied: Any) -> None:
    answer = studied(43, "pump_loads_input")["answer"]
    assert answer["kind"] == "unlisted"
    assert answer["effects"] == ["open_converter_torque"]
    # The hidden effect is linear in the pressure; the recordings exclude other powers.
    assert answer["forms"][0]["form"] == "(pressure / 5 bar)"
    assert answer["forms"][0]["share"] > 0.8


def test_two_effects_are_both_found_without_a_similar_third(studied: Any) -> None:
    result = studied(44, "thermal_fade", "centrifugal_head")
    assert sorted(result["answer"]["effects"]) == ["centrifugal_pressure", "thermal_fade"]
    # In the first round, other effects predict as well as the best one; once both are in the model, none does.
    assert sum(entry["tied"] for entry in result["rounds"][0]["ranking"]) > 1
    assert sorted(result["answer"]["tied"]) == [["centrifugal_pressure"], ["thermal_fade"]]
