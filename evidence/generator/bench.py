"""A bench as its file specifies it: parameters, converter, current profiles, conditions, clock and stated noise."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

SYMBOLS = {
    "current_delay": "tau", "current_bias": "a", "current_gain": "k", "piston_pressure_rate": "a2",
    "piston_pressure": "b2", "piston_inertia": "c2", "piston_return": "d2", "pressure_bias": "aa",
    "temperature_gain": "kT", "contact_position": "z_contact", "initial_position": "x30", "contact_length": "beta",
    "film_coefficient": "gamma", "friction_coefficient": "alpha", "gear_ratio": "gr", "input_inertia": "Ji",
    "input_coulomb": "Tic", "input_viscous": "biv", "output_viscous": "bov", "ramp_share": "eps",
}
"""Name of each parameter in a bench file, and its symbol in the paper."""
SENSORS = ("pressure", "input_speed", "output_speed", "output_torque")
RPM = np.pi / 30


@dataclass(frozen=True, eq=False)
class Bench:
    """A bench as it is specified.

    `text` is its file. `parameters` have the symbols of the paper, `uncertain` are those that are calibrated; the
    converter curves `torque_ratio` (1) and `capacity` (rad/s/(N m)^0.5) are linear in `speed_ratio`. Profiles are
    (p, m), in s and A; conditions are (n,): number of the profile, rad/s, kg m^2 and N m, which is a grid `repeats`
    times. Signals are sampled every `period` s until `horizon` s. `noise` is the stated noise std of each sensor, in
    the unit of the signal. Of the nominal runs, `pace` is the median shifting time in s, and `ranges` has the range of
    each signal; both are 1 until they are known.
    """

    name: str
    text: str
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
    noise: Mapping[str, float]
    repeats: int = 1
    pace: float = 1.0
    ranges: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(SENSORS, 1.0))

    @property
    def time(self) -> np.ndarray:
        """The sampling times (k,) in s."""
        return np.arange(round(self.horizon / self.period) + 1) * self.period

    @property
    def grid(self) -> np.ndarray:
        """The index of each condition once."""
        return np.arange(len(self.profile) // self.repeats)


def open_bench(path: Path, horizon: float | None = None) -> Bench:
    """Return the bench of a file, recorded until `horizon` s, by default until its profiles end."""
    return read_bench(path.read_text(), 1, horizon)


def read_bench(text: str, repeats: int = 1, horizon: float | None = None) -> Bench:
    """Return the bench of the text of a file; its units are those of `Bench`, except rpm of the motor speed and ms."""
    document = tomllib.loads(text)
    given = {SYMBOLS[name]: entry if isinstance(entry, dict) else {"value": entry}
             for name, entry in document["parameters"].items()}
    converter, times = document["converter"], np.array([each["time"]["values"] for each in document["profiles"]])
    curves = (converter["speed_ratio"], converter["torque_ratio"], converter["capacity_factor"]["values"])
    levels = (np.array(document["conditions"][name]["values"], float)
              for name in ("motor_speed", "load_inertia", "brake_torque"))
    number, speed, inertia, brake = np.tile(np.array([*product(range(len(times)), *levels)]), (repeats, 1)).T
    period = _value(document["sensors"]["sample_time"])
    end = float(np.floor(times[0, -1] / period - 1) * period) if horizon is None else horizon
    return Bench(document["name"], text, {symbol: _value(entry["value"]) for symbol, entry in given.items()},
                 tuple(symbol for symbol, entry in given.items() if "uncertain" in entry), *map(np.array, curves),
                 times, np.array([each["current"]["values"] for each in document["profiles"]]), number.astype(int),
                 speed * RPM, inertia, brake, period, end,
                 {name: _value(document["sensors"][name]["noise"]) for name in SENSORS}, repeats)


def _value(entry: str | float) -> float:
    """Return a number with its unit in a text, in s where that is ms."""
    number, *unit = str(entry).split()
    return float(number) * (1e-3 if unit == ["ms"] else 1.0)
