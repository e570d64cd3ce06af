"""The nominal bench: parameters, converter curves, current profiles and the 216 conditions, read from data files."""

import csv
import json
from pathlib import Path

import numpy as np

_DATA = Path(__file__).parent / "data"
_BENCH = json.loads((_DATA / "parameters.json").read_text())

PARAMETERS = {name: entry["value"] for name, entry in _BENCH["parameters"].items()}
UNCERTAIN = tuple(name for name, entry in _BENCH["parameters"].items() if entry["uncertain"])
SPEED_RATIO, TORQUE_RATIO, CAPACITY = (
    np.array(_BENCH["torque_converter"][name]) for name in ("speed_ratio", "torque_ratio", "capacity_factor")
)


def _columns(path: Path) -> dict[str, np.ndarray]:
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


_CURRENTS = _columns(_DATA / "current_profiles.csv")
_SHAPE = len(np.unique(_CURRENTS["profile"])), -1
PROFILE_TIME = _CURRENTS["time_s"].reshape(_SHAPE)
PROFILE_CURRENT = _CURRENTS["current_A"].reshape(_SHAPE)

_CONDITIONS = _columns(_DATA.parents[1] / "data" / "conditions.csv")
PROFILE = _CONDITIONS["profile"].astype(int)
MOTOR_SPEED = _CONDITIONS["motor_speed_rad_s"]
LOAD_INERTIA = _CONDITIONS["load_inertia_kg_m2"]
BRAKE_TORQUE = _CONDITIONS["brake_torque_N_m"]
