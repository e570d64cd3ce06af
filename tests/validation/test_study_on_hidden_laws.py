"""Whole studies of recordings of the independent bench: the gap closes by the right effect, and by no other.

test_naming_on_hidden_laws.py has more of naming alone, and `python -m evidence` as many drawn cases as wanted.
"""

from pathlib import Path

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.studies import StudyResult, StudySettings, conclude, examine
from tests.benches import HEAVY
from tests.hidden_laws import FRICTION_FALLS, Hidden, law, record

COUNT = 30


PUMP = 1.5
"""N m/bar that a pump takes from the input shaft."""


def studied(folder: Path, seed: int, *hidden: Hidden) -> StudyResult:
    """The result of a study with default settings, of recordings with the given hidden laws."""
    settings, recordings = StudySettings(), record(folder, *hidden, seed=seed, count=COUNT)
    return conclude(settings, HEAVY, recordings, examine(settings, HEAVY, recordings))[0]


@pytest.mark.slow
def test_friction_that_falls_with_slip_is_found_and_closes_the_gap_and_another_effect_does_not(tmp_path: Path) -> None:
    result = studied(tmp_path, 41, FRICTION_FALLS)
    assert (result.kind, result.effects) == ("effect", ["stribeck_friction"])
    confirmation = result.findings[0].confirmation
    assert confirmation.agrees
    assert confirmation.coefficients[0].lower > 0, "the interval contains zero"
    assert result.gap is not None
    assert result.gap.control is not None
    closed, control = (its["shifting_time"] for its in (result.gap.closures, result.gap.control.closures))
    assert closed.lower is not None
    assert control.upper is not None
    assert closed.lower > 0.8 > control.upper  # a lag of the pressure sensor closes about half in 30 engagements


@pytest.mark.slow
def test_nothing_is_found_in_recordings_without_an_effect(tmp_path: Path) -> None:
    result = studied(tmp_path, 11)
    assert (result.kind, result.findings, result.gap) == ("none", [], None)
    assert result.before.model == result.after.model


@pytest.mark.slow
def test_what_no_effect_explains_is_in_the_extended_model_as_its_measured_law(tmp_path: Path) -> None:
    result = studied(tmp_path, 43, law(
        "input_drag", "pressure", lambda p: PUMP * np.maximum(p, 0), "difference", "input speed"))
    finding, = result.findings
    assert (result.kind, finding.quantity, finding.depends_on) == ("unlisted", "input torque", "pressure")
    assert finding.confirmation.simulated == "measured law"
    simulated, = Model.from_spec(result.after.model).laws
    assert (simulated.quantity, simulated.depends_on) == ("converter torque", "pressure")
    measured, truth = finding.law, PUMP * np.array(simulated.at)
    assert measured is not None
    lower, upper = np.array(measured.lower), np.array(measured.upper)
    # The input torque is lower by what the pump takes. Errors of the points are correlated, so that bands of 90 % may
    # miss several of them; none is off by three standard errors, and some would be by ten with the wrong sign.
    errors = (upper - lower) / (2 * 1.645)
    assert np.all(np.abs(-(upper + lower) / 2 - truth) < 3 * errors)
    assert np.any(np.abs((upper + lower) / 2 - truth) > 10 * errors)
    # At low pressures few samples determine the law.
    known = upper - lower < 0.4 * truth
    assert known.sum() > 3
    np.testing.assert_allclose(np.array(simulated.change)[known], -truth[known], rtol=0.2)
