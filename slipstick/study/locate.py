"""Where model and recordings disagree: the model cut at every measured signal, each block driven by measured inputs.

    pressure      valve current -> pressure
    output torque pressure and both speeds -> torque through the clutch
    output speed  torque -> change of the output speed
    input speed   torque -> change of the input speed

All with the parameters and the scatter of the best fit without any effect, so that what a parameter can do is not
called a disagreement. A block that is wrong shows in its own row only, whatever it does to the others in a simulation.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.processing import block_means
from slipstick.study.comparison import WIDTH, Comparison
from slipstick.study.mixed import MixedFit

BLOCKS = ("pressure", "output_torque", "output_speed", "input_speed")
PHASES = ("fill", "film", "slip", "stick")
CONDITIONS = ("current_profile", "motor_speed", "load_inertia", "brake_torque", "run_order")
_THIRDS = 3  # groups of the run order


@dataclass(frozen=True, eq=False)
class Blocks:
    """Of each block the residual (n, k) of k averages in units of its noise, and each average's `phase` (n, k).

    A `phase` is a place in `PHASES`, -1 around the lock-up, where torque jumps. `slip` (n, k) is the plates', in rad/s,
    `friction` (n, k) the friction coefficient that the torque shows in N m/Pa, NaN where the plates are not pressed.
    """

    residual: dict[str, np.ndarray]
    phase: np.ndarray
    slip: np.ndarray
    friction: np.ndarray


def blocks(comparison: Comparison, found: MixedFit) -> Blocks | None:
    """Drive every block of a fitted model by what was measured; None without signals."""
    recordings = comparison.recordings
    signals = recordings.signals
    if signals is None or comparison.times is None:
        return None
    vectors, coefficients = found.design.vectors(found.points)
    curves = comparison.bench.physics.curves
    response = ensemble.simulate(curves, vectors, coefficients, recordings.conditions, comparison.times,
                                 paired=True, laws=found.design.laws)
    p = dict(zip(parameters.NAMES, vectors.T[:, :, None], strict=True))
    time, step = signals.time, float(np.median(np.diff(signals.time)))
    position = _position(signals, p, step)
    gap = p["contact_position"] - position
    ramp, per_gap = _ramp(gap, p)
    share = np.maximum(0.0, position / (p["contact_position"] - p["contact_length"]))
    pressing = ramp * share * 1e5 * np.maximum(0.0, signals.pressure)
    slip = signals.input_speed - p["gear_ratio"] * signals.output_speed
    film = p["film_coefficient"] * per_gap * slip / p["gear_ratio"]
    torque = p["gear_ratio"] * (p["friction_coefficient"] * pressing * np.sign(slip) + film)
    lock = recordings.measured_time[:, None]
    phase = np.where(time > lock, 3, np.where(ramp <= 0.0, 0, np.where(ramp < 1.0, 1, 2)))
    phase[np.abs(time - lock) < 2 * WIDTH * step] = -1
    noise = {name: comparison.noise[name] for name in BLOCKS}
    residual = {
        "pressure": block_means(signals.pressure, WIDTH) - block_means(response.pressure, WIDTH),
        "output_torque": block_means(np.where(time > lock, np.nan, signals.output_torque - torque), WIDTH),
        **_speeds(comparison, signals, p, step),
    }
    # The pressure that drives the torque has noise of its own.
    driven = p["gear_ratio"] * p["friction_coefficient"] * ramp * share * 1e5 * noise["pressure"]
    spread = {"pressure": noise["pressure"],
              "output_torque": np.hypot(noise["output_torque"], block_means(driven, WIDTH)),
              **{name: np.sqrt(2) * noise[name] for name in ("output_speed", "input_speed")}}
    middle = slice(WIDTH // 2, len(time) // WIDTH * WIDTH, WIDTH)
    with np.errstate(divide="ignore", invalid="ignore"):
        shown = (signals.output_torque / p["gear_ratio"] - film) / (pressing * np.sign(slip))
    friction = np.where(phase == 2, shown, np.nan)
    return Blocks({name: residual[name] / spread[name] for name in BLOCKS}, phase[:, middle],
                  block_means(slip, WIDTH), block_means(friction, WIDTH))


def located(comparison: Comparison, cut: Blocks) -> dict[str, Any]:
    """Chi-square per value by block and phase, and of the worst of them by operating condition; 1 is noise."""
    squares = {name: np.where(cut.phase >= 0, residual**2, np.nan) for name, residual in cut.residual.items()}
    table = {name: {PHASES[phase]: _mean(square[cut.phase == phase]) for phase in range(len(PHASES))}
             for name, square in squares.items()}
    # In the film phase a piston a hair off turns into torque: that says nothing of the law of the torque.
    cells = [(value, name, phase) for name, row in table.items() for phase, value in row.items()
             if value is not None and phase != "film"]
    worst, name, phase = max(cells)
    inside = np.where(cut.phase == PHASES.index(phase), squares[name], np.nan)
    return {"chi_square": table, "worst": {"block": name, "phase": phase, "chi_square": worst},
            "by_condition": {column: _grouped(comparison.recordings, column, inside) for column in CONDITIONS}}


def _position(signals: Signals, p: dict[str, np.ndarray], step: float) -> np.ndarray:
    """Piston position (n, k) in m under the measured pressure: eq. 1, by the trapezoidal rule."""
    drive = p["piston_pressure"] * (signals.pressure - p["pressure_bias"])
    # The pressure's derivative integrates to the pressure itself.
    push = p["piston_pressure_rate"] * (signals.pressure - signals.pressure[:, :1])
    inertia, back = p["piston_inertia"][:, 0], p["piston_return"][:, 0]
    state, found = p["initial_position"][:, 0].copy(), np.empty_like(drive)
    free = state.copy()
    for k in range(drive.shape[1]):
        if k:
            middle = (drive[:, k] + drive[:, k - 1]) / 2
            free = (free * (1 - back * step / (2 * inertia)) + step * middle / inertia
                    + (push[:, k] - push[:, k - 1]) / inertia) / (1 + back * step / (2 * inertia))
        found[:, k] = free
    return np.asarray(np.clip(p["temperature_gain"] * found, 0.0, p["contact_position"]))


def _ramp(gap: np.ndarray, p: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """f_reg and (1 - f_reg) / clearance, as in the driveline."""
    width = p["ramp_share"] * p["contact_position"]
    s = np.clip(1 - gap / width, 0.0, 1.0)
    with np.errstate(divide="ignore"):
        return s * s * (3 - 2 * s), np.where(s > 0, (1 - s) * (1 + 2 * s) / width, 1 / gap)


def _speeds(comparison: Comparison, signals: Signals, p: dict[str, np.ndarray], step: float) -> dict[str, np.ndarray]:
    """Measured less predicted change of both speeds (n, k) from one average to the next, in rad/s, 0 for the first."""
    conditions, converter = comparison.recordings.conditions, comparison.bench.physics.curves
    torque = signals.output_torque
    load = conditions.brake_torque[:, None] + p["output_viscous"] * signals.output_speed
    moving = signals.output_speed > _moving(signals)
    output = np.where(moving, (torque - load) / conditions.load_inertia[:, None], np.nan)
    motor = conditions.motor_speed[:, None]
    ratio = signals.input_speed / motor
    capacity = np.interp(ratio, converter.speed_ratio, converter.capacity_factor)
    driving = motor**2 * np.interp(ratio, converter.speed_ratio, converter.torque_ratio) / capacity**2
    losses = p["input_viscous"] * signals.input_speed + p["input_coulomb"]
    rate = (driving - losses - torque / p["gear_ratio"]) / p["input_inertia"]
    found = {}
    for name, slope in (("output_speed", output), ("input_speed", rate)):
        measured = block_means(getattr(signals, name), WIDTH)
        travelled = cumulative_trapezoid(np.nan_to_num(slope), dx=step, axis=1, initial=0)
        change = np.diff(measured, axis=1) - np.diff(block_means(travelled, WIDTH), axis=1)
        still = np.isnan(block_means(slope, WIDTH))
        still[:, 1:] |= still[:, :-1].copy()
        found[name] = np.where(still, np.nan, np.concatenate([np.zeros((len(change), 1)), change], axis=1))
    return found


def _moving(signals: Signals) -> float:
    """Output speed in rad/s above which the load turns for certain."""
    return 0.02 * float(signals.output_speed.max())


def _grouped(recordings: Recordings, column: str, squares: np.ndarray) -> list[dict[str, float | None]]:
    if column == "run_order":
        order = recordings.run_order
        if order is None:
            return []
        values = np.minimum(_THIRDS - 1, order * _THIRDS // len(order)).astype(float)
    else:
        values = np.asarray(getattr(recordings.conditions, column), float)
    return [{"value": float(value), "chi_square": _mean(squares[values == value])} for value in np.unique(values)]


def _mean(squares: np.ndarray) -> float | None:
    kept = squares[np.isfinite(squares)]
    return float(kept.mean()) if len(kept) else None
