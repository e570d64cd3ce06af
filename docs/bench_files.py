"""Write recordings as MDF4 files, one engagement a file, as a bench might write them: for docs/your_bench.md.

    python docs/bench_files.py tables/measured-compact.h5 var/bench

Names and units are those of a bench, the torque sensor counts the other way round, each file begins 50 ms before the
shift command with the first samples in reverse, and the oil temperature is made up.
"""

import sys
from pathlib import Path

import numpy as np
from asammdf import MDF, Signal

from slipstick.recordings import Recordings

BEFORE = 50  # samples
RPM = 30 / np.pi


def write(recordings: Recordings, folder: Path) -> None:
    """One file an engagement: load inertia and brake torque are in its name, the others are channels."""
    folder.mkdir(parents=True, exist_ok=True)
    signals, conditions = recordings.signals, recordings.conditions
    assert signals is not None
    noise = np.random.default_rng(15)
    back = slice(BEFORE, 0, -1)
    time = np.concatenate([-signals.time[back], signals.time]) + signals.time[BEFORE]
    for row in range(len(recordings)):
        profile = conditions.current_profile[row]
        current = np.interp(time - time[BEFORE], conditions.profile_time[profile], conditions.profile_current[profile])
        measured = {name: np.concatenate([values[row, back], values[row]])
                    for name, values in (("p", signals.pressure), ("in", signals.input_speed),
                                         ("out", signals.output_speed), ("torque", signals.output_torque))}
        file = MDF(version="4.10")
        file.append([
            Signal(100 * measured["p"], time, "kPa", "p_clutch"),
            Signal(RPM * measured["in"], time, "rpm", "n_turbine"),
            Signal(RPM * measured["out"], time, "rpm", "n_output"),
            Signal(-measured["torque"], time, "Nm", "M_output"),
            Signal(current + noise.normal(0, 0.005, len(time)), time, "A", "i_valve"),
            Signal((np.arange(len(time)) >= BEFORE).astype(np.uint8), time, "", "shift_request")])
        slow = time[::20]
        file.append([
            Signal(RPM * conditions.motor_speed[row] + noise.normal(0, 1.0, len(slow)), slow, "rpm", "n_motor"),
            Signal(80 + 0.02 * row + noise.normal(0, 0.1, len(slow)), slow, "°C", "T_oil")])
        name = f"run{row:03}_J{conditions.load_inertia[row]:g}_M{conditions.brake_torque[row]:g}.mf4"
        file.save(folder / name, overwrite=True, compression=2)


if __name__ == "__main__":
    write(Recordings.open(sys.argv[1]), Path(sys.argv[2]))
