"""The files of a case: its bench, and the HDF5 file of its recordings, which does not contain the truth."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .case import Case, bad_runs_of, measure, measure_further
from .run import Run

_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}


def write_recordings(path: Path, case: Case, run: Run) -> None:
    """Write the recordings of a `run` of the case, in the layout of the shipped recordings."""
    shifting_time, signals = measure(case, run)
    bench, conditions, time = case.bench, run.conditions, case.bench.time
    profile = bench.profile[conditions]
    for bad in bad_runs_of(case, conditions):
        profile[bad.run] = profile[bad.run] if bad.recorded is None else bad.recorded
    with h5py.File(path, "w") as file:
        file.attrs["description"] = f"Simulated test-bench recordings of {len(conditions)} clutch engagements; " \
                                    "t = 0 is the shift command"

        def put(name: str, values: np.ndarray, unit: str, **storage: Any) -> None:
            file.create_dataset(name, data=values, **storage).attrs["units"] = unit

        put("conditions/current_profile", profile, "1")
        put("conditions/motor_speed", bench.motor_speed[conditions], "rad/s")
        put("conditions/load_inertia", bench.load_inertia[conditions], "kg m^2")
        put("conditions/brake_torque", bench.brake_torque[conditions], "N m")
        put("conditions/run_order", run.order, "1")
        put("current_profiles/time", bench.profile_time, "s")
        put("current_profiles/current", bench.profile_current, "A")
        put("shifting_time", shifting_time, "s")
        put("signals/time", time, "s")
        chunks = (min(27, len(conditions)), len(time))
        for name, unit in _UNITS.items():
            if name not in case.missing:
                put(f"signals/{name}", signals[name], unit, compression="gzip", chunks=chunks)
        for name, values in measure_further(case, run).items():
            put(f"further/{name}", values, "degC", compression="gzip", chunks=chunks)
