"""The conditions of engagements: current profile, motor speed, load inertia and brake torque (section II.A)."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from slipstick.errors import InvalidValue

CONDITION_UNITS = {"current_profile": "1", "motor_speed": "rad/s", "load_inertia": "kg m^2", "brake_torque": "N m"}
"""The columns of conditions in every file, and their units."""
INPUT_UNITS = {"input_torque": "N m", "initial_input_speed": "rad/s"}
"""Further columns on a bench without a torque converter."""
PROFILE_UNITS = {"time": "s", "current": "A"}
"""The columns of current profiles."""
_LARGEST = 1e9
"""Of motor speeds, inertias and brake torques in their units: their squares and products must not overflow."""
_COLUMNS = ("current_profile", "motor_speed", "load_inertia", "brake_torque", "run_order", "input_torque",
            "initial_input_speed")


@dataclass(frozen=True, eq=False)
class Conditions:
    """n conditions and their p current profiles, each piecewise linear between k breakpoints.

    Shapes: `current_profile` (n,) index into the profiles, `motor_speed` (n,) rad/s, `load_inertia` (n,) kg m^2,
    `brake_torque` (n,) N m, `profile_time` (p, k) s, `profile_current` (p, k) A. `run_order` (n,) is the position of
    each engagement in the test sequence, from 0, or None if unknown. Only drift effects depend on it, and it does not
    enter the identity (`digest`) of the conditions. Without a torque converter, `input_torque` (n,) N m drives the
    input shaft, which rotates at `initial_input_speed` (n,) rad/s at t = 0. `profile_input_torque` (p, k) N m, a torque
    that varies over the current profile, is added to it. With a converter all three are None. Raises `InvalidValue`.
    """

    current_profile: np.ndarray
    motor_speed: np.ndarray
    load_inertia: np.ndarray
    brake_torque: np.ndarray
    profile_time: np.ndarray
    profile_current: np.ndarray
    run_order: np.ndarray | None = None
    input_torque: np.ndarray | None = None
    initial_input_speed: np.ndarray | None = None
    profile_input_torque: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Validate shapes, order, finiteness and signs."""
        n = len(self.current_profile)
        for name in ("motor_speed", "load_inertia", "brake_torque"):
            column = getattr(self, name)
            _require(column.shape == (n,), f"{name} has shape {column.shape}, not ({n},)",
                     "Give one value per condition")
            in_range = column >= 0 if name == "brake_torque" else column > 0
            _require(bool(np.all(np.isfinite(column) & in_range)),
                     f"{name} has values that are not finite and positive", "Check the column and its unit")
            _require(bool(np.all(column < _LARGEST)), f"{name} has a value of {column.max(initial=0):g}",
                     f"Give less than {_LARGEST:g}, and check its unit")
        _require((self.input_torque is None) == (self.initial_input_speed is None),
                 "input torque and initial input speed do not come together",
                 "Give both for a bench without a torque converter, else none")
        for given in (self.input_torque, self.initial_input_speed):
            _require(given is None or (given.shape == (n,) and bool(np.all(np.isfinite(given)))),
                     "input torque or initial input speed is not one finite number per condition", "Check the columns")
        varying = self.profile_input_torque
        _require(varying is None or (self.input_torque is not None and varying.shape == self.profile_time.shape
                                     and bool(np.all(np.isfinite(varying)))),
                 "the input torque of the profiles is not one finite number per breakpoint, or the initial input speed "
                 "is missing", "Give an input torque for each breakpoint, and an initial input speed per condition")
        order = np.zeros(n) if self.run_order is None else self.run_order
        _require(order.shape == (n,) and bool(np.all(np.equal(np.mod(order, 1), 0))),
                 "the run order is not one whole number per condition",
                 "Give the position of each engagement in the sequence, or omit run_order")
        time, current = self.profile_time, self.profile_current
        _require(time.ndim == 2 and time.shape == current.shape and time.shape[1] >= 2,
                 f"profile times {time.shape} and currents {current.shape} have invalid shapes",
                 "Give equal shapes (profiles, breakpoints), with at least two breakpoints")
        _require(bool(np.all(np.isfinite(time)) and np.all(np.isfinite(current))),
                 "a current profile has values that are not finite", "Check its breakpoints")
        _require(bool(np.all(np.diff(time, axis=1) > 0) and np.all(time[:, 0] == 0)),
                 "the times of a current profile do not rise strictly from 0",
                 "Sort its breakpoints and start at t = 0")
        is_valid = (self.current_profile >= 0) & (self.current_profile < len(time))
        _require(bool(np.all(is_valid)), f"current_profile refers to a profile beyond the {len(time)} profiles",
                 "Number the profiles from 0")

    def __len__(self) -> int:
        return len(self.current_profile)

    def columns(self, with_run_order: bool = False) -> list[np.ndarray]:
        """All fields that define the conditions, and on request the run order if it is known."""
        values = [getattr(self, field.name) for field in fields(self) if field.name != "run_order"]
        columns = [column for column in values if column is not None]
        return [*columns, self.run_order.astype(np.int64)] if with_run_order and self.run_order is not None else columns

    @property
    def digest(self) -> str:
        """SHA-256 over all columns at nine significant digits, independent of the rounding of a file format."""
        columns = (np.asarray(column, dtype=float) for column in self.columns())
        text = "\n".join(f"{column.shape} " + " ".join(f"{value:.9g}" for value in column.flat) for column in columns)
        return hashlib.sha256(text.encode()).hexdigest()

    def take(self, indices: Sequence[int] | np.ndarray) -> "Conditions":
        """Conditions at `indices`, in that order."""
        rows = np.asarray(indices, dtype=np.int64)
        columns = {name: getattr(self, name) for name in _COLUMNS}
        return replace(self, **{name: column[rows] for name, column in columns.items() if column is not None})


def reversals(current: np.ndarray) -> np.ndarray:
    """History of a current (k,) in A at each of its breakpoints, as hysteresis needs it: shape (k, 3).

    Columns: direction of the segment that starts there (+1 rising, -1 falling; a constant segment keeps the previous
    direction), current at the last reversal (initially the first current), and magnitude of the change up to that
    reversal (initially 0).
    """
    slopes = np.sign(np.diff(current, append=current[-1]))
    changes = slopes[slopes != 0]
    direction, reversal, swing = changes[0] if len(changes) else 1.0, current[0], 0.0
    history = []
    for value, slope in zip(current, slopes, strict=True):
        if slope == -direction:
            direction, reversal, swing = slope, value, abs(value - reversal)
        history.append((direction, reversal, swing))
    return np.array(history)


def _require(valid: bool, cause: str, remedy: str) -> None:
    if not valid:
        raise InvalidValue(cause[0].upper() + cause[1:], remedy)
