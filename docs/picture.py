"""Draw the pictures of the README: the finding of a study, an engagement before and after calibration, and a fit.

    python docs/picture.py var docs

Needs a finished `make demo`: the calibration in var, and the table `calibrated`.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from benchmarks.benches import HEAVY
from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.inference.figures import figure_data
from slipstick.inference.problems import table_problem
from slipstick.pictures import Spec, engagement, pictures, theme
from slipstick.pictures.rendering import render
from slipstick.pictures.study import study_pictures
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.studies import StudySettings, conclude, examine
from slipstick.table import Table
from slipstick.table.physical_values import physical_inputs
from slipstick.uncertainty import fit

CONDITION = 100
SIGNALS = (*SIGNAL_UNITS, "piston_position")
FITTED = ("initial_position",)
"""The uncertain input of the README's first fit."""


def main(var: Path, out: Path) -> None:
    recordings = Recordings.open("tables/measured.h5")
    (out / "finding.png").write_bytes(render(finding(recordings), "png"))  # its points would fill a large SVG
    engaged = one_engagement(recordings, var / "calibration.json")
    (out / "engagement.svg").write_bytes(render(engaged, "svg"))
    (out / "fit.svg").write_bytes(render(profiles(recordings, Table.open("tables/calibrated.h5")), "svg"))


def finding(recordings: Recordings) -> Spec:
    """The friction law that a study measures, and the formula of the effect that it names."""
    settings = StudySettings()
    return study_pictures(*conclude(settings, HEAVY, recordings, examine(settings, HEAVY, recordings)))["law"]


def one_engagement(recordings: Recordings, calibration: Path) -> Spec:
    """One recorded engagement, and its simulation before and after calibration."""
    assert recordings.signals is not None
    time, conditions = recordings.signals.time, recordings.conditions.take([CONDITION])
    models = {"nominal": Model(HEAVY.physics),
              "calibrated": Model.from_spec(json.loads(calibration.read_text())["model"])}
    lines = {"measured": {name: getattr(recordings.signals, name)[CONDITION].tolist() for name in SIGNAL_UNITS}}
    locks = {"measured": float(recordings.measured_time[CONDITION])}
    for name, model in models.items():
        response = ensemble.signals(model, conditions, time, accuracy=ensemble.TIGHT)
        lines[name] = {signal: getattr(response, signal)[0, 0].tolist() for signal in SIGNALS}
        locks[name] = float(response.shifting_time[0, 0])
    values = dict(zip(parameters.NAMES, models["calibrated"].parameters, strict=True))
    position = np.array(lines["calibrated"]["piston_position"])
    contact = time[np.argmax(position > (1 - values["ramp_share"]) * values["contact_position"])]
    return theme.picture(
        f"Condition {CONDITION} locks at {theme.milliseconds(locks['measured'])} on the bench, at "
        f"{theme.milliseconds(locks['calibrated'])} in the calibrated model",
        "Shaded: the phases of the calibrated simulation. Dashed: the shifting times.",
        engagement.panels(time.tolist(), lines, locks, float(contact), values["gear_ratio"]))


def profiles(recordings: Recordings, table: Table) -> Spec:
    """The profile likelihoods of the README's first fit."""
    settings, problem = fit.FitSettings(), table_problem(table, recordings, "clip", FITTED)
    state = fit.final_state(settings, problem)
    estimate = fit.refined_estimate(settings, problem, state)
    while not fit.has_all_intervals(settings, estimate):
        estimate = fit.with_next_interval(settings, problem, estimate)
    data = figure_data(settings, problem, state, estimate, table.model, recordings)
    result = fit.summary(settings, problem, state, estimate)
    physical = [asdict(one) for one in physical_inputs(table.model, result["axes"], result["mean"], result["std"])]
    return pictures({"result": result, "physical": physical, "figure_data": data})["profiles"]


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
