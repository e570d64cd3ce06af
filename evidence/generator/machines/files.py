"""The files of a case: `machine.json` and `runs.h5` in its folder, and the truth beside the folder."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .draw import MachineCase, describe_machine_case, measure_machine_case, simulate_machine_case
from .recordings import MACHINES
from .runs import CHANNELS

_UNITS = {"start level 1": "m", "start level 2": "m", "load torque": "N m"}


def truth_file(folder: Path) -> Path:
    """Return the file of the truth, beside the folder of a case."""
    return folder.parent / f"{folder.name}.truth.json"


def write_machine_case(folder: Path, case: MachineCase) -> None:
    """Simulate the case and write its files; the truth, which no method sees, is written last."""
    reading = simulate_machine_case(case)
    folder.mkdir(parents=True, exist_ok=True)
    content = {"machine": case.machine, "values": case.values}
    (folder / "machine.json").write_text(json.dumps(content, indent=1) + "\n")
    write_runs(folder / "runs.h5", case, measure_machine_case(case, reading))
    truth_file(folder).write_text(json.dumps(describe_machine_case(case, reading).to_json()))


def write_runs(path: Path, case: MachineCase, signals: dict[str, np.ndarray]) -> None:
    """Write the measured signals (n, k) with what is stated of the runs."""
    runs = case.runs
    with h5py.File(path, "w") as file:
        file.attrs["runs_of"] = case.machine
        file.attrs["description"] = f"Simulated recordings of {len(runs.order)} runs of a machine: {case.machine}"

        def put(name: str, values: np.ndarray, unit: str, **storage: Any) -> None:
            file.create_dataset(name, data=values, **storage).attrs["units"] = unit

        put("time", runs.time, "s")
        for name, unit in MACHINES[case.machine].SIGNALS.items():
            put(f"signals/{name}", signals[name], unit, compression="gzip")
        put("commands/voltage/time", runs.corner_time, "s")
        put("commands/voltage/value", runs.corner_value, "V")
        for name, levels in case.stated.items():
            put(f"conditions/{name}", levels, _UNITS[name])
        put(f"channels/{CHANNELS[case.machine]}", runs.channel, "degC")
        put("order", runs.order, "1")
