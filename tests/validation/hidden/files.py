"""The HDF5 file of a case, in the layout of the shipped recordings."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .case import Case, bad_runs_of, further, generate

_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}


def write(path: Path, case: Case, relative: float = 1e-8) -> None:
    """Write the recordings of `case`; the file does not contain the names of the effects."""
    run, shifting_time, signals = generate(case, relative)
    setup, conditions, time = case.setup, run.conditions, case.setup.time
    profile = setup.profile[conditions]
    for bad in bad_runs_of(case, conditions):
        profile[bad.run] = profile[bad.run] if bad.recorded is None else bad.recorded
    with h5py.File(path, "w") as file:
        file.attrs["description"] = f"Simulated test-bench recordings of {len(conditions)} clutch engagements; " \
                                    "t = 0 is the shift command"

        def put(name: str, values: np.ndarray, unit: str, **storage: Any) -> None:
            file.create_dataset(name, data=values, **storage).attrs["units"] = unit

        put("conditions/current_profile", profile, "1")
        put("conditions/motor_speed", setup.motor_speed[conditions], "rad/s")
        put("conditions/load_inertia", setup.load_inertia[conditions], "kg m^2")
        put("conditions/brake_torque", setup.brake_torque[conditions], "N m")
        put("conditions/run_order", run.order, "1")
        put("current_profiles/time", setup.profile_time, "s")
        put("current_profiles/current", setup.profile_current, "A")
        put("shifting_time", shifting_time, "s")
        if case.signals:
            put("signals/time", time, "s")
            for name, unit in _UNITS.items():
                chunks = (min(27, len(conditions)), len(time))
                put(f"signals/{name}", signals[name], unit, compression="gzip", chunks=chunks)
            for name, values in further(case, run).items():
                put(f"further/{name}", values, "degC", compression="gzip", chunks=chunks)
