"""Simulation of many engagements at once: shifting times, and signals at sample times.

The compiled integrator consists of `driver` (main loop), `integrator`, `steps`, `events` and `sampling` (one step),
`flow` (the solution of eq. 1), `hydraulics` and `driveline` (equations, with all effects of the catalogue). `reference`
is the slow, readable reference implementation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import get_num_threads

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.bench.converter import Converter
from slipstick.clutch import effects, law_kernels
from slipstick.clutch.active_effects import active_effects, sensor_reading
from slipstick.clutch.compilation import drive, initial_speeds
from slipstick.clutch.driver import FAILED, LOCKED, NEVER_LOCKED, workspace
from slipstick.clutch.lanes import LANES
from slipstick.clutch.laws import MOST_LAWS, MeasuredLaw
from slipstick.clutch.loading import segments
from slipstick.clutch.model import Model
from slipstick.clutch.sensor_laws import with_sensor_laws
from slipstick.errors import InvalidValue
from slipstick.numerics.threads import mapped

__all__ = ["DEFAULT", "FAILED", "LOCKED", "NEVER_LOCKED", "STATUS", "TIGHT", "Accuracy", "Response", "Simulator",
           "initial_input_speed", "shifting_times", "signals", "simulate"]

_SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque", "piston_position")
STATUS = {LOCKED: "locked", NEVER_LOCKED: "never locked", FAILED: "failed"}
_MAX_BLOCK = 4096
"""Largest number of engagements that a thread simulates at a time."""
_MAX_SAMPLE_VALUES = 2_000_000
"""Largest number of sample values that a thread stores at a time, so that they fit into the cache."""


@dataclass(frozen=True)
class Accuracy:
    """Steps in s: at most `coarse`, and at least `fine` unless a time constant is shorter (`steps`)."""

    fine: float
    coarse: float


DEFAULT = Accuracy(1e-3, 24e-3)
"""Shifting times within 1e-4 s of TIGHT over the default grid (tests/validation)."""
TIGHT = Accuracy(2e-4, 1e-3)
"""Shifting times within 1e-5 s of the independent reference."""


@dataclass(frozen=True, eq=False)
class Response:
    """Results at m points under n conditions: shifting times and status (m, n), and signals (m, n, k) at k times.

    For paired points and conditions the shapes are (n,) and (n, k). Shifting times are in s, and NaN unless the status
    is locked. Signals of a failed engagement are NaN from the failure on.
    """

    shifting_time: np.ndarray
    status: np.ndarray
    pressure: np.ndarray
    """bar"""
    input_speed: np.ndarray
    """rad/s"""
    output_speed: np.ndarray
    """rad/s"""
    output_torque: np.ndarray
    """N m"""
    piston_position: np.ndarray
    """m"""


def simulate(converter: Converter, vectors: np.ndarray, coefficients: np.ndarray, conditions: Conditions,
             sample_times: np.ndarray | None = None, accuracy: Accuracy = DEFAULT,
             threads: int | None = None, paired: bool = False, laws: Sequence[MeasuredLaw] = ()) -> Response:
    """Simulate parameter vectors (m, 20) with effect coefficients (m, c) under n conditions, with a `converter`.

    All points are combined with all conditions; with `paired`, m = n and point i is combined with condition i only. The
    measured `laws` act at all points; those of sensors change the signals only. With `sample_times` (k,) in s, not
    decreasing, the response contains the sensor signals at these times. The result of an engagement depends neither on
    `threads`, by default as many as numba's, nor on the other engagements of the call. Raises `InvalidValue` for
    invalid arguments; an engagement that never locks or diverges is reported by its status.
    """
    vectors, coefficients = np.ascontiguousarray(vectors, float), np.ascontiguousarray(coefficients, float)
    times = np.empty(0) if sample_times is None else np.ascontiguousarray(sample_times, float)
    _check(vectors, coefficients, times, accuracy, laws)
    if paired and len(vectors) != len(conditions):
        raise InvalidValue(f"{len(vectors)} points do not pair up with {len(conditions)} conditions",
                           "Give one point per condition")
    integrated = [law for law in laws if not law.of_sensor and any(law.change)]
    active = active_effects(coefficients, integrated)
    terms = law_kernels.terms(integrated)
    initial, column = (_paired_input_speed if paired else initial_input_speed)(converter, vectors, conditions)
    order = np.zeros(len(conditions)) if conditions.run_order is None else conditions.run_order
    given = np.zeros(len(conditions)) if conditions.input_torque is None else conditions.input_torque
    columns = np.column_stack([conditions.motor_speed, conditions.load_inertia, conditions.brake_torque, order, given])
    profiles = np.column_stack([conditions.current_profile, column]).astype(np.int64)
    profile_segments = segments(conditions.profile_time, conditions.profile_current, conditions.profile_input_torque)

    n, k, workers = len(conditions), len(times), threads or get_num_threads()
    shape, conditions_per_point = ((n,), 1) if paired else ((len(vectors), n), n)
    total = math.prod(shape)
    limit = min(_MAX_BLOCK, math.ceil(total / workers), _MAX_SAMPLE_VALUES // max(1, k * (active.state_size + 2)))
    size = LANES * max(1, math.ceil(limit / LANES))
    shifting_time, status = np.empty(total), np.empty(total, np.uint8)
    true_signals = np.empty((len(_SIGNALS), total, k))

    def simulate_block(first: int) -> None:
        stop = min(first + size, total)
        samples = np.empty((stop - first, active.state_size + 2, k))
        drive(workspace(converter.terms, terms), np.zeros((4, LANES), np.int64), first, stop, conditions_per_point,
              vectors, coefficients, active, columns, profiles, initial, profile_segments, accuracy.fine,
              accuracy.coarse, times, samples, true_signals, shifting_time, status)

    mapped(simulate_block, range(0, total, size), workers)
    shaped = {name: signal.reshape(*shape, k) for name, signal in zip(_SIGNALS, true_signals, strict=True)}
    readings = {name: sensor_reading(signal, f"{name.replace('_', ' ')} sensor", times, coefficients) if k else signal
                for name, signal in shaped.items()}
    return Response(shifting_time.reshape(shape), status.reshape(shape),
                    **with_sensor_laws(readings, shaped, laws, times, conditions))


def shifting_times(model: Model, conditions: Conditions, axes: Sequence[str] = (), points: np.ndarray | None = None,
                   accuracy: Accuracy = DEFAULT, threads: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Shifting times in s (NaN unless locked) and status, both (m, n), at points (m, d) of multipliers of `axes`.

    A multiplier scales the parameter value of the model; without points the model is simulated as it is (m = 1).
    """
    response = simulate(model.converter, *_scale(model, axes, points), conditions, None, accuracy, threads,
                        laws=model.laws)
    return response.shifting_time, response.status


def signals(model: Model, conditions: Conditions, sample_times: np.ndarray, axes: Sequence[str] = (),
            points: np.ndarray | None = None, accuracy: Accuracy = DEFAULT, threads: int | None = None) -> Response:
    """As `shifting_times`, with all signals at `sample_times` (k,) in s."""
    return simulate(model.converter, *_scale(model, axes, points), conditions, sample_times, accuracy, threads,
                    laws=model.laws)


@dataclass(frozen=True)
class Simulator:
    """The direct simulation as a callable: shifting times (m, n) in s at points (m, d) of multipliers of `axes`."""

    model: Model
    axes: tuple[str, ...]
    accuracy: Accuracy = DEFAULT
    threads: int | None = None

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        """Shifting times (m, n) in s; NaN where an engagement does not lock."""
        return shifting_times(self.model, conditions, self.axes, points, self.accuracy, self.threads)[0]


def initial_input_speed(converter: Converter, vectors: np.ndarray,
                        conditions: Conditions) -> tuple[np.ndarray, np.ndarray]:
    """Input speed at t = 0 in rad/s, (m, distinct speeds), and its column for each condition, (n,)."""
    if conditions.initial_input_speed is not None:
        speeds, column = np.unique(conditions.initial_input_speed, return_inverse=True)
        return np.tile(speeds, (len(vectors), 1)), column
    speeds, column = np.unique(conditions.motor_speed, return_inverse=True)
    initial = np.empty((len(vectors), len(speeds)))
    initial_speeds(np.ascontiguousarray(vectors, float), speeds[None], converter.terms, initial)
    return initial, column


def _paired_input_speed(converter: Converter, vectors: np.ndarray,
                        conditions: Conditions) -> tuple[np.ndarray, np.ndarray]:
    """As `initial_input_speed` for pairs of points and conditions, (n, 1): without the speeds of all other pairs."""
    if conditions.initial_input_speed is not None:
        return initial_input_speed(converter, vectors, conditions)
    initial = np.empty((len(vectors), 1))
    initial_speeds(vectors, np.ascontiguousarray(conditions.motor_speed, float)[:, None], converter.terms, initial)
    return initial, np.zeros(len(vectors), np.int64)


def _scale(model: Model, axes: Sequence[str], points: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    multipliers = np.ones((1, len(axes))) if points is None else np.asarray(points, float)
    if multipliers.ndim != 2 or multipliers.shape[1] != len(axes):
        raise InvalidValue(f"Points of shape {multipliers.shape} do not fit {len(axes)} axes",
                           f"Give (m, {len(axes)}) multipliers of {', '.join(axes)}")
    vectors = np.tile(model.parameters, (len(multipliers), 1))
    for column, name in enumerate(axes):
        vectors[:, parameters.index(name)] *= multipliers[:, column]
    return vectors, np.tile(model.coefficients(), (len(multipliers), 1))


def _check(vectors: np.ndarray, coefficients: np.ndarray, sample_times: np.ndarray, accuracy: Accuracy,
           laws: Sequence[MeasuredLaw]) -> None:
    if vectors.ndim != 2 or vectors.shape[1] != len(parameters.NAMES):
        raise InvalidValue(f"Parameter vectors have shape {vectors.shape}", f"Give (m, {len(parameters.NAMES)})")
    if coefficients.shape != (len(vectors), len(effects.neutral())):
        raise InvalidValue(f"Effect coefficients have shape {coefficients.shape}",
                           f"Give ({len(vectors)}, {len(effects.neutral())}), as `Model.coefficients` does")
    if not (np.all(np.isfinite(vectors)) and np.all(np.isfinite(coefficients))):
        raise InvalidValue("A parameter or coefficient is not finite", "Give finite numbers")
    if sample_times.ndim != 1 or np.any(~np.isfinite(sample_times)) or np.any(np.diff(sample_times, prepend=0.0) < 0):
        raise InvalidValue("The sample times are negative, decreasing or not finite",
                           "Sort them, in seconds after the shift command")
    if not (0 < accuracy.fine <= accuracy.coarse < np.inf):
        raise InvalidValue(f"The maximum steps {accuracy.fine} and {accuracy.coarse} s are invalid",
                           "Give 0 < fine <= coarse")
    if len(laws) > MOST_LAWS:
        raise InvalidValue(f"{len(laws)} measured laws are too many", f"Give at most {MOST_LAWS}")
