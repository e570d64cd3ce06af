"""Draw the figure of the README: one recorded engagement and its simulations before and after calibration."""

import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.benches import HEAVY
from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.pictures import engagement, theme
from slipstick.pictures.rendering import render
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS

CONDITION = 100
SIGNALS = (*SIGNAL_UNITS, "piston_position")


def main(calibration: Path, out: Path) -> None:
    recordings = Recordings.open("tables/measured.h5")
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
    contact_time = time[np.argmax(position > (1 - values["ramp_share"]) * values["contact_position"])]
    picture = theme.picture(
        f"Experiment {CONDITION} locks at {theme.milliseconds(locks['measured'])} on the bench, at "
        f"{theme.milliseconds(locks['calibrated'])} in the calibrated model",
        "Shaded: the phases of the calibrated simulation. Dashed: the shifting times.",
        engagement.panels(time.tolist(), lines, locks, float(contact_time), values["gear_ratio"]))
    out.write_bytes(render(picture, "svg"))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
