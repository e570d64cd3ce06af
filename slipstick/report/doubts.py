"""What the predictions of a fit leave unexplained, stated before its result: residuals by group, and their spread."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures.calibration import distance, transformed, verdict
from slipstick.pictures.output import Output
from slipstick.pictures.residuals import groups_off

LARGE_CHI_SQUARE = 2.0
"""Reduced chi-square above which the text speaks of a missing effect: the residuals have twice the variance of the
noise. No fit depends on it."""
_SURE = 0.99
"""Level of a warning: one in a hundred right fits at most has it. The band of the picture is that of 90 %."""


def doubts(figure_data: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (lead-in, text) of each doubt; none is good."""
    entries = []
    off, groups, is_notable = groups_off(figure_data)
    if is_notable:
        entries.append(("The model lacks something:",
                        f"in {off} of {groups} groups of current profile and motor speed the mean of measured minus "
                        "predicted differs from zero, which scatter of the inputs cannot cause. A study names what is "
                        "missing."))
    values = transformed(figure_data["prediction"])
    if len(values) and (limits := distance(values, _SURE))[0] > limits[1]:
        output = Output.of(figure_data)
        entries.append(("The predicted distributions do not match:",
                        f"the measured {output.plural} {verdict(values, output)} (probability integral transform)."))
    return entries
