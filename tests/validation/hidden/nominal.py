"""The nominal benches, `HEAVY`, `COMPACT`, `BRISK`, `GIANT`, `LIGHT`, `SLOW` and 180 drawn ones, from data files."""

import csv
import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

_DATA = Path(__file__).parent / "data"
DRAWN = _DATA / "drawn"
SYMBOLS = {
    "current_delay": "tau", "current_bias": "a", "current_gain": "k", "piston_pressure_rate": "a2",
    "piston_pressure": "b2", "piston_inertia": "c2", "piston_return": "d2", "pressure_bias": "aa",
    "temperature_gain": "kT", "contact_position": "z_contact", "initial_position": "x30", "contact_length": "beta",
    "film_coefficient": "gamma", "friction_coefficient": "alpha", "gear_ratio": "gr", "input_inertia": "Ji",
    "input_coulomb": "Tic", "input_viscous": "biv", "output_viscous": "bov", "ramp_share": "eps",
}
RPM = np.pi / 30


@dataclass(frozen=True, eq=False)
class Setup:
    """A bench as it is specified.

    `parameters` have the symbols of the paper; the converter curves `torque_ratio` (1) and `capacity` (rad/s/(N m)^0.5)
    are linear in `speed_ratio`. Profiles are (p, m), in s and A; conditions are (n,): number of the profile, rad/s,
    kg m^2 and N m, which is a grid `repeats` times. Signals are sampled every `period` s until `horizon` s. `noise` is
    the stated noise std of each sensor, in the unit of the signal. `scale` gives the size of quantities relative to the
    heavy bench; laws of effects are evaluated in units of it, so that a strength means about the same on every bench.
    """

    name: str
    parameters: Mapping[str, float]
    uncertain: tuple[str, ...]
    speed_ratio: np.ndarray
    torque_ratio: np.ndarray
    capacity: np.ndarray
    profile_time: np.ndarray
    profile_current: np.ndarray
    profile: np.ndarray
    motor_speed: np.ndarray
    load_inertia: np.ndarray
    brake_torque: np.ndarray
    period: float
    horizon: float
    noise: Mapping[str, float] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    repeats: int = 1

    @property
    def time(self) -> np.ndarray:
        """The sampling times (k,) in s."""
        return np.arange(round(self.horizon / self.period) + 1) * self.period


def _columns(path: Path) -> dict[str, np.ndarray]:
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def _setup(name: str, prefix: str, conditions: Path, period: float, horizon: float, scale: dict[str, float]) -> Setup:
    bench = json.loads((_DATA / f"{prefix}parameters.json").read_text())
    currents, columns = _columns(_DATA / f"{prefix}current_profiles.csv"), _columns(conditions)
    shape = len(np.unique(currents["profile"])), -1
    parameters = {name: entry["value"] for name, entry in bench["parameters"].items()}
    uncertain = tuple(name for name, entry in bench["parameters"].items() if entry["uncertain"])
    converter = bench["torque_converter"]
    curves = (np.array(converter[curve]) for curve in ("speed_ratio", "torque_ratio", "capacity_factor"))
    return Setup(name, parameters, uncertain, *curves,
                 currents["time_s"].reshape(shape), currents["current_A"].reshape(shape),
                 columns["profile"].astype(int), columns["motor_speed_rad_s"], columns["load_inertia_kg_m2"],
                 columns["brake_torque_N_m"], period, horizon, bench.get("noise", {}), scale)


def from_text(text: str, repeats: int, scale: Mapping[str, float]) -> Setup:
    """Return the bench of a bench file, recorded until the last sample before the end of the profiles.

    Its units are those of `Setup`, except rpm of the motor speed.
    """
    bench = tomllib.loads(text)
    given = {SYMBOLS[name]: entry if isinstance(entry, dict) else {"value": entry}
             for name, entry in bench["parameters"].items()}
    converter, times = bench["converter"], np.array([profile["time"]["values"] for profile in bench["profiles"]])
    curves = (converter["speed_ratio"], converter["torque_ratio"], converter["capacity_factor"]["values"])
    levels = (bench["conditions"][name]["values"] for name in ("motor_speed", "load_inertia", "brake_torque"))
    number, speed, inertia, brake = np.tile(np.array([*product(range(len(times)), *levels)]), (repeats, 1)).T
    period = _value(bench["sensors"].pop("sample_time"))
    del bench["sensors"]["shifting_time"]
    return Setup(bench["name"], {symbol: _value(entry["value"]) for symbol, entry in given.items()},
                 tuple(symbol for symbol, entry in given.items() if "uncertain" in entry), *map(np.array, curves),
                 times, np.array([profile["current"]["values"] for profile in bench["profiles"]]), number.astype(int),
                 speed * RPM, inertia, brake, period, float(np.floor(times[0, -1] / period - 1) * period),
                 {name: _value(sensor["noise"]) for name, sensor in bench["sensors"].items()}, scale, repeats)


def _value(entry: str | float) -> float:
    return float(str(entry).split()[0])


def _drawn() -> Iterator[Setup]:
    with (DRAWN / "scales.csv").open() as file:
        for row in csv.DictReader(file):
            name, repeats = row.pop("bench"), int(row.pop("repeats"))
            scale = {quantity: float(size) for quantity, size in row.items()}
            yield from_text((DRAWN / f"{name}.toml").read_text(), repeats, scale)


_COMPACT_SCALE = {
    "current": 1.2, "valve_current": 1.2,
    **dict.fromkeys(("pressure", "pressure_demand", "chamber_pressure", "contact_pressure", "pressure_sensor"), 0.65),
    **dict.fromkeys(("driving_pressure", "net_pressure"), 0.55),
    **dict.fromkeys(("piston", "piston_position", "clearance"), 0.75), "piston_feed": 1.1,
    **dict.fromkeys(("piston_rate", "free_piston_rate"), 0.8),
    **dict.fromkeys(("motor_speed", "input_speed", "input_speed_sensor"), 1.6),
    **dict.fromkeys(("slip", "output_speed", "output_speed_sensor"), 2.8),
    **dict.fromkeys(("output_torque", "output_torque_sensor"), 0.22), "load_torque": 0.4, "input_drag": 0.6,
    **dict.fromkeys(("time", "contact_time", "friction_lag", "converter_lag"), 0.9),
    "energy": 0.5, "load_point": 1.15, "shaft_compliance": 9.0,
    "heat": 0.5, "twist": 2.7, "output_position": 2.5, "current_excess": 1.2,
}
_BRISK_SCALE = {
    "current": 2.0, "valve_current": 2.0,
    **dict.fromkeys(("pressure", "pressure_demand", "chamber_pressure", "contact_pressure", "pressure_sensor"), 0.8),
    **dict.fromkeys(("driving_pressure", "net_pressure"), 0.6),
    **dict.fromkeys(("piston", "piston_position", "clearance"), 1.35), "piston_feed": 1.7,
    **dict.fromkeys(("piston_rate", "free_piston_rate"), 1.5),
    **dict.fromkeys(("motor_speed", "input_speed", "input_speed_sensor"), 1.37),
    **dict.fromkeys(("slip", "output_speed", "output_speed_sensor"), 3.5),
    **dict.fromkeys(("output_torque", "output_torque_sensor"), 0.35), "load_torque": 0.5, "input_drag": 0.9,
    **dict.fromkeys(("time", "contact_time", "friction_lag", "converter_lag"), 0.95),
    "energy": 1.4, "load_point": 1.1, "shaft_compliance": 8.0,
    "heat": 1.5, "twist": 2.8, "output_position": 4.4, "current_excess": 2.0,
}
_GIANT_SCALE = {
    "current": 0.26, "valve_current": 0.26,
    **dict.fromkeys(("pressure", "pressure_demand", "chamber_pressure", "contact_pressure", "pressure_sensor"), 1.15),
    **dict.fromkeys(("driving_pressure", "net_pressure"), 1.05),
    **dict.fromkeys(("piston", "piston_position", "clearance"), 2.3), "piston_feed": 2.2,
    **dict.fromkeys(("piston_rate", "free_piston_rate"), 0.8),
    **dict.fromkeys(("motor_speed", "input_speed", "input_speed_sensor"), 0.63),
    **dict.fromkeys(("slip", "output_speed", "output_speed_sensor"), 0.42),
    **dict.fromkeys(("output_torque", "output_torque_sensor"), 7.8), "load_torque": 15.0, "input_drag": 5.0,
    **dict.fromkeys(("time", "contact_time", "friction_lag", "converter_lag"), 1.8),
    "energy": 6.0, "load_point": 0.8, "shaft_compliance": 0.12,
    "heat": 4.0, "twist": 1.15, "output_position": 0.72, "current_excess": 0.2,
}
_LIGHT_SCALE = {
    "current": 0.66, "valve_current": 0.5,
    **dict.fromkeys(("pressure", "pressure_demand", "chamber_pressure", "contact_pressure", "pressure_sensor"), 0.65),
    **dict.fromkeys(("driving_pressure", "net_pressure"), 0.55),
    **dict.fromkeys(("piston", "piston_position", "clearance"), 0.4), "piston_feed": 0.6,
    **dict.fromkeys(("piston_rate", "free_piston_rate"), 0.9),
    **dict.fromkeys(("motor_speed", "input_speed", "input_speed_sensor"), 1.5),
    **dict.fromkeys(("slip", "output_speed", "output_speed_sensor"), 1.9),
    **dict.fromkeys(("output_torque", "output_torque_sensor"), 0.14), "load_torque": 0.17, "input_drag": 0.25,
    **dict.fromkeys(("time", "contact_time", "friction_lag", "converter_lag"), 0.64),
    "energy": 0.18, "load_point": 1.07, "shaft_compliance": 13.0,
    "heat": 0.27, "twist": 1.9, "output_position": 1.16, "current_excess": 0.45,
}
_SLOW_SCALE = {
    "current": 2.15, "valve_current": 1.8,
    **dict.fromkeys(("driving_pressure", "net_pressure"), 0.75),
    **dict.fromkeys(("piston", "piston_position", "clearance"), 3.4), "piston_feed": 2.0,
    **dict.fromkeys(("piston_rate", "free_piston_rate"), 2.2),
    **dict.fromkeys(("motor_speed", "input_speed", "input_speed_sensor"), 0.68),
    **dict.fromkeys(("slip", "output_speed", "output_speed_sensor"), 2.7),
    **dict.fromkeys(("output_torque", "output_torque_sensor"), 0.72), "load_torque": 2.0, "input_drag": 3.2,
    **dict.fromkeys(("time", "contact_time", "friction_lag", "converter_lag"), 2.0),
    "energy": 3.8, "load_point": 0.8, "shaft_compliance": 4.0,
    "heat": 2.1, "twist": 2.9, "output_position": 4.2, "current_excess": 0.9,
}
HEAVY = _setup("heavy", "", _DATA.parents[1] / "data" / "conditions.csv", 0.002, 2.0, {})
COMPACT = _setup("compact", "compact_", _DATA / "compact_conditions.csv", 0.001, 1.8, _COMPACT_SCALE)
BRISK = _setup("brisk", "brisk_", _DATA / "brisk_conditions.csv", 0.004, 2.4, _BRISK_SCALE)
GIANT = _setup("giant", "giant_", _DATA / "giant_conditions.csv", 0.008, 5.0, _GIANT_SCALE)
LIGHT = _setup("light", "light_", _DATA / "light_conditions.csv", 0.003, 1.5, _LIGHT_SCALE)
SLOW = _setup("slow", "slow_", _DATA / "slow_conditions.csv", 0.006, 4.8, _SLOW_SCALE)
CHOSEN = (HEAVY, COMPACT, BRISK, GIANT, LIGHT, SLOW)
SETUPS = {setup.name: setup for setup in (*CHOSEN, *_drawn())}
