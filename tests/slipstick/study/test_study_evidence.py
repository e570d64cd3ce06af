"""What a study shows of itself: the law, what is left and where, over what, and how well it predicts."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipstick.study import study
from slipstick.study.evidence import evidence
from slipstick.study.settings import StudySettings

Studied = Callable[[str], tuple[Any, Any, dict[str, Any]]]


def shown(studied: Studied, name: str) -> dict[str, Any]:
    found: dict[str, Any] = studied(name)[2]["figure_data"]
    return found


def test_the_friction_that_torque_shows_is_the_bench_s(studied: Studied) -> None:
    # The law of the bench that the shipped recordings come from.
    law = shown(studied, "friction")["law"]
    slip, friction = (np.array(law["bins"][name]) for name in ("at", "median"))
    shape = 1 + 0.22 * np.exp(-slip / 25)
    assert len(slip) > 10
    assert slip[0] < 25
    assert np.ptp(friction / shape) < 0.015 * friction.mean()
    before, after = (law["model"][who] for who in ("before", "after"))
    assert np.ptp(before["median"]) < 1e-3 * before["median"][0]
    assert np.interp(slip, after["at"], after["median"]) == pytest.approx(friction, rel=0.01)


def test_what_is_left_is_noise_once_the_effect_is_added(studied: Studied) -> None:
    where = shown(studied, "friction")["where"]
    assert where["worst"]["block"] == "output_torque"
    assert where["before"]["chi_square"]["output_torque"]["slip"] > 10
    # The film phase lasts a moment: 24 experiments hardly fill its cells.
    assert all(0.7 < row[phase] < 1.4 for row in where["after"]["chi_square"].values() for phase in ("slip", "stick")
               if row[phase] is not None)
    film = where["before"]["chi_square"]["output_torque"]["film"], where["after"]["chi_square"]["output_torque"]["film"]
    assert film[0] > 5 * film[1]
    assert {name: len(groups) for name, groups in where["before"]["by_condition"].items()} == {
        "current_profile": 6, "motor_speed": 4, "load_inertia": 1, "brake_torque": 1, "run_order": 3}


def test_the_effect_shows_over_what_it_depends_on(studied: Studied) -> None:
    (friction,), (drag,) = (shown(studied, name)["residual"] for name in ("friction", "drag"))
    assert (friction["block"], friction["phase"], friction["driver"]) == ("output_torque", "slip", "plate slip [rad/s]")
    assert (drag["block"], drag["driver"]) == ("output_speed", "output speed [rad/s]")
    for one in (friction, drag):
        before, after = (np.array(one["models"][who]["median"]) for who in ("before", "after"))
        assert np.ptp(before) > 4 * np.ptp(after)
        assert np.all(np.diff(one["models"]["before"]["at"]) > 0)


def test_predictions_are_those_of_the_gap_and_their_std_is_right(studied: Studied) -> None:
    output = studied("friction")[2]
    prediction, gap = output["figure_data"]["prediction"], output["result"]["gap"]
    for who in ("before", "after"):
        assert prediction[who]["mean"] == pytest.approx(gap[who], rel=1e-5)
    score = (np.array(prediction["measured"]) - prediction["after"]["mean"]) / prediction["after"]["std"]
    assert 0.5 < np.sqrt(np.mean(score**2)) < 2
    assert np.mean(prediction["before"]["std"]) > 2 * np.mean(prediction["after"]["std"])


def test_the_worst_experiments_are_of_different_profiles(studied: Studied) -> None:
    compared, _, output = studied("friction")
    worst = output["figure_data"]["signals"]
    profiles = [output["figure_data"]["conditions"]["current_profile"][one["condition"]] for one in worst]
    assert len(set(profiles)) == len(worst) == 3
    one = worst[0]
    torque = compared.recordings.signals.output_torque[one["condition"], :8].mean()
    assert one["measured"]["output_torque"][0] == pytest.approx(torque, rel=1e-5)
    off = {who: np.sqrt(np.mean((np.array(one["measured"]["output_torque"]) - one[who]["output_torque"]) ** 2))
           for who in ("before", "after")}
    assert off["before"] > 3 * off["after"]


def test_where_nothing_is_missing_there_is_no_after(studied: Studied) -> None:
    found = shown(studied, "nothing")
    assert "after" not in found["prediction"]
    assert found["residual"] == []
    assert "after" not in found["where"]
    assert "after" not in found["signals"][0]
    assert np.ptp(found["law"]["bins"]["median"]) < 0.02 * found["law"]["bins"]["median"][0]
    assert all(value < 3 for row in found["where"]["before"]["chi_square"].values() for value in row.values()
               if value is not None)


def test_shifting_times_alone_leave_predictions(studied: Studied) -> None:
    found = shown(studied, "times")
    assert (found["law"], found["where"], found["residual"], found["signals"]) == (None, None, [], [])
    assert len(found["prediction"]["before"]["mean"]) == 24


def test_it_stays_small(studied: Studied) -> None:
    assert len(json.dumps(shown(studied, "friction"))) < 120_000


def test_a_handful_of_experiments_has_some(studied: Studied) -> None:
    compared, _, _ = studied("friction")
    few, settings = compared.take(np.array([0, 9])), StudySettings()
    found = evidence(settings, few, {**study.start(settings, few), "stopped": "nothing more"})
    json.dumps(found, allow_nan=False)
    assert len(found["signals"]) == 2
    assert len(found["prediction"]["measured"]) == 2
