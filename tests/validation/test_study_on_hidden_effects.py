"""The study on sealed recordings of a bench that shares no integrator and no formula with it: a small honest part.

`python -m benchmarks.study_blind` is the whole.
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

COUNT = 30


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The result of a study, with default settings, of recordings that a case has written."""
    @cache
    def answer(seed: int, *hidden: str) -> dict[str, Any]:
        path = Path(tmp_path_factory.mktemp("sealed")) / "recordings.h5"
        write(path, Case({effect: EFFECTS[effect].typical for effect in hidden}, seed=seed, count=COUNT))
        settings = StudySettings()
        compared = compare(Recordings.open(path), settings.shifting_time_noise)
        state = study.start(settings, compared)
        while not study.finished(state):
            state = study.advance(settings, compared, state)
        return conclude(settings, compared, state)

    return answer


def test_finds_friction_that_falls_with_slip_and_closes_the_gap(studied: Any) -> None:
    result = studied(41, "friction_falls_with_slip")
    assert result["answer"]["effects"] == ["stribeck_friction"]
    assert result["gap"]["closures"]["shifting_time"]["closure"] > 0.8
    strength = next(one for one in result["answer"]["coefficients"] if one["coefficient"] == "strength")
    assert strength["lower"] > 0, "the interval holds zero"


def test_a_wrong_effect_does_not_close_the_gap(studied: Any) -> None:
    control = studied(41, "friction_falls_with_slip")["gap"]["control"]
    assert control["effect"] != "stribeck_friction"
    closed = control["closures"]["shifting_time"]["closure"]
    assert closed is None or closed < 0.5


@pytest.mark.parametrize("seed", [11, 12])
def test_nothing_is_missing_where_nothing_is(studied: Any, seed: int) -> None:
    assert studied(seed)["answer"]["kind"] == "none"


def test_what_no_name_explains_gets_no_name(studied: Any) -> None:
    answer = studied(43, "pump_loads_input")["answer"]
    assert answer["kind"] == "unlisted"
    assert answer["effects"] == ["open_converter_torque"]
    # Power 1 of the pressure is what is hidden; the recordings allow no other.
    assert answer["forms"][0]["form"] == "(pressure / 5 bar)"
    assert answer["forms"][0]["share"] > 0.8


def test_of_two_effects_both_are_named_and_no_third_that_looks_like_them(studied: Any) -> None:
    result = studied(44, "thermal_fade", "centrifugal_head")
    assert sorted(result["answer"]["effects"]) == ["centrifugal_pressure", "thermal_fade"]
    # While one is missing, others predict as well as the first that is named; beside both they do not.
    assert sum(one["tied"] for one in result["rounds"][0]["ranking"]) > 1
    assert all(len(group) == 1 for group in result["answer"]["tied"])
