"""Nominal parameters by nonlinear least squares on the recordings (section II.C of Tod et al.).

A cold joint fit stalls, so the start is staged: the pressure gives delay, bias and gain of the current; torque over
pressure gives the friction; shifting times and torque give the piston; then all move together on all data. Each
residual is divided by the noise of its sensor.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from slipstick.clutch import ensemble, parameters
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.processing import blended_at_lock_up, block_means, sensor_noise
from slipstick.recordings.signals import SIGNAL_UNITS

Report = Callable[[tuple[str, ...], int, float], None]
"""Told after every iteration: the parameters that move, evaluations so far, and the sum of squares."""

_CHANNELS = (*SIGNAL_UNITS, "shifting_time")
_STAGES: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("current_delay", "current_bias", "current_gain"), ("pressure",)),
    (("pressure_bias", "temperature_gain", "initial_position"), ("output_torque", "shifting_time")),
)
_WIDTH = 8
"""Samples averaged to one compared value: 16 ms at the shipped 500 Hz. Picking single samples instead would make the
sum of squares jump whenever a simulated lock-up passes one, and the search stall."""
_STEP = 5e-4
"""Of the central differences, in multiples of nominal."""
_CONVERGED = 1e-6
"""Relative change of the sum of squares, or of the multipliers, at which the search ends."""
_ACCURACY = ensemble.Accuracy(5e-4, 2e-3)
_FEWEST = 14
"""Engagements for which the clustered covariance of seven parameters means something."""
_AT_BOUND = 1e-3
"""A parameter within this share of its range from a bound counts as being at it."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a calibration found: `model`, and of its d `free` parameters value, standard error and correlation.

    `standard_error` (d,) in the parameters' units and `correlation` (d, d) are those of estimates whose residuals may
    depend on each other within an engagement, as they do when a run scatters as a whole (sandwich estimator, clustered
    by engagement). They hold the variance only: what scatter or missing physics does to the estimates themselves is
    not in them. `chi_square` is the reduced chi-square per signal: 1 where only sensor noise is left. `rms_before`
    and `rms_after` are of the shifting time in s. `at_bound` names parameters that the recordings push against a
    bound: their values are the bound's, not a result.
    """

    model: Model
    free: tuple[str, ...]
    standard_error: np.ndarray
    correlation: np.ndarray
    chi_square: dict[str, float]
    noise: dict[str, float]
    rms_before: float
    rms_after: float
    at_bound: tuple[str, ...]
    evaluations: int

    def spec(self) -> dict[str, Any]:
        """The calibration as JSON; `Model.from_spec` reads its "model"."""
        values = dict(zip(parameters.NAMES, self.model.parameters, strict=True))
        units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
        fitted = {
            name: {"value": values[name], "unit": units[name], "standard_error": float(error)}
            for name, error in zip(self.free, self.standard_error, strict=True)
        }
        return {"model": self.model.spec(), "parameters": fitted, "correlation": self.correlation.tolist(),
                "reduced_chi_square": self.chi_square, "noise": self.noise, "at_bound": list(self.at_bound),
                "rms_before_s": self.rms_before, "rms_after_s": self.rms_after, "evaluations": self.evaluations}


def calibrate(recordings: Recordings, start: Model | None = None, shifting_time_noise: float = 3e-3,
              report: Report = lambda *_: None) -> Calibration:
    """Fit the seven uncertain parameters of `start` to `recordings`, which must have signals.

    `shifting_time_noise` is the standard deviation of the shifting-time measurement in s; those of the signals are
    estimated from the recordings. `report` is told of every iteration. The effects of `start` stay as they are.
    Raises `InvalidValue`.
    """
    if recordings.signals is None:
        raise InvalidValue("These recordings have no signals, and shifting times alone do not determine the parameters",
                           "Record pressure, speeds and torque as well")
    if len(recordings.conditions) < _FEWEST:
        raise InvalidValue(f"{len(recordings.conditions)} engagements are too few to calibrate on",
                           f"Record {_FEWEST} or more, under different conditions")
    model = start or Model()
    noise = {**sensor_noise(recordings.signals), "shifting_time": shifting_time_noise}
    problem = _Problem(recordings, recordings.signals, noise, model.coefficients(), report)
    before = problem.residuals(model.parameters)["shifting_time"] * shifting_time_noise
    evaluations = 0
    for free, compared in _STAGES:
        model, solution = problem.solve(model, free, compared)
        evaluations += solution.nfev
        if "pressure" in compared:
            model = model.with_parameters({"friction_coefficient": problem.friction(model)})
    fitted = parameters.UNCERTAIN
    model, solution = problem.solve(model, fitted, _CHANNELS)

    covariance = problem.covariance(solution)
    error = np.sqrt(np.diag(covariance))
    residuals = problem.residuals(model.parameters)
    dof = 1 - len(fitted) / sum(residual.size for residual in residuals.values())
    nominal = parameters.nominal()[[parameters.index(name) for name in fitted]]
    return Calibration(
        model=model, free=fitted, standard_error=error * nominal,
        correlation=covariance / np.outer(error, error),
        chi_square={name: float(np.mean(residual**2) / dof) for name, residual in residuals.items()},
        noise=problem.noise, rms_before=_rms(before), rms_after=_rms(residuals["shifting_time"] * shifting_time_noise),
        at_bound=tuple(name for name, value in zip(fitted, solution.x, strict=True) if _near_bound(name, value)),
        evaluations=evaluations + solution.nfev,
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """The recordings to meet, the noise of each channel, and the coefficients (c,) of the model's effects."""

    recordings: Recordings
    signals: Signals
    noise: dict[str, float]
    coefficients: np.ndarray
    report: Report

    def residuals(self, vector: Any) -> dict[str, np.ndarray]:
        """(simulated - measured) / noise of each channel at one parameter vector (20,): (n,) or (n, averages)."""
        return {name: residual[0] for name, residual in self._residuals(np.array([vector], float)).items()}

    def _residuals(self, vectors: np.ndarray) -> dict[str, np.ndarray]:
        coefficients = np.tile(self.coefficients, (len(vectors), 1))
        response = ensemble.simulate(vectors, coefficients, self.recordings.conditions, self.signals.time, _ACCURACY)
        if np.any(response.status == ensemble.FAILED):
            raise InvalidValue("The simulation blows up within the bounds of the calibration",
                               "Start from a model nearer to the nominal one")
        simulated = {name: getattr(response, name) for name in SIGNAL_UNITS}
        simulated["output_torque"] = blended_at_lock_up(response.output_torque, response.shifting_time,
                                                        self.signals.time)
        found = {name: block_means(simulated[name] - getattr(self.signals, name), _WIDTH)
                 / (self.noise[name] / np.sqrt(_WIDTH)) for name in SIGNAL_UNITS}
        # An engagement that does not lock is as wrong as one that locks at the end of its current profile.
        conditions = self.recordings.conditions
        latest = conditions.profile_time[conditions.current_profile, -1]
        times = np.where(response.status == ensemble.LOCKED, response.shifting_time, latest)
        found["shifting_time"] = (times - self.recordings.measured_time) / self.noise["shifting_time"]
        return found

    def solve(self, model: Model, free: tuple[str, ...], compared: tuple[str, ...]) -> tuple[Model, Any]:
        """Least squares over multipliers of the nominal values of `free`, from `model` on."""
        columns = [parameters.index(name) for name in free]
        nominal = parameters.nominal()[columns]
        base = np.array(model.parameters)

        def vectors(points: np.ndarray) -> np.ndarray:
            full = np.tile(base, (len(points), 1))
            full[:, columns] = points * nominal
            return full

        def flat(points: np.ndarray) -> np.ndarray:
            found = self._residuals(vectors(points))
            return np.concatenate([found[name].reshape(len(points), -1) for name in compared], axis=1)

        def residuals(point: np.ndarray) -> np.ndarray:
            return np.asarray(flat(point[None])[0])

        def slopes(point: np.ndarray) -> np.ndarray:
            steps = _STEP * np.eye(len(free))
            shifted = flat(np.concatenate([point + steps, point - steps]))
            return np.asarray((shifted[:len(free)] - shifted[len(free):]).T / (2 * _STEP))

        lower = np.array([parameters.PARAMETERS[column].lower for column in columns])
        upper = np.array([parameters.PARAMETERS[column].upper for column in columns])
        inside = np.clip(base[columns] / nominal, lower + 1e-6, upper - 1e-6)
        solution = least_squares(residuals, inside, jac=slopes,
                                 bounds=(lower, upper), x_scale="jac",
                                 ftol=_CONVERGED, xtol=_CONVERGED, max_nfev=60,
                                 callback=lambda intermediate_result: self.report(
                                     free, intermediate_result.nfev, 2 * intermediate_result.cost))
        return model.with_parameters(dict(zip(free, solution.x * nominal, strict=True))), solution

    def friction(self, model: Model) -> float:
        """Friction coefficient in N m/Pa: torque over pressure while the pressed plates slip, just before lock-up."""
        values = dict(zip(parameters.NAMES, model.parameters, strict=True))
        before = self.recordings.measured_time[:, None] - self.signals.time
        pressing = (before > 0.02) & (before < 0.08) & (self.signals.pressure > 1.0)
        share = values["contact_position"] / (values["contact_position"] - values["contact_length"])
        if not np.any(pressing):
            raise InvalidValue("No recording has samples under pressure in the 80 ms before lock-up",
                               "Check the units of pressure and time, and that the signals reach the shifting times")
        torque = self.signals.output_torque / values["gear_ratio"]
        return float(np.median(torque[pressing] / (share * 1e5 * self.signals.pressure[pressing])))

    def covariance(self, solution: Any) -> np.ndarray:
        """Sandwich estimator of the covariance of the multipliers, clustered by engagement: (d, d)."""
        n, d, k = len(self.recordings.conditions), solution.jac.shape[1], len(self.signals.time) // _WIDTH
        scores, position = np.zeros((n, d)), 0
        for name in _CHANNELS:
            width = 1 if name == "shifting_time" else k
            rows = slice(position, position + n * width)
            weighted = solution.jac[rows] * solution.fun[rows, None]
            scores += weighted.reshape(n, width, d).sum(axis=1)
            position += n * width
        bread = np.linalg.inv(solution.jac.T @ solution.jac)
        return np.asarray(bread @ (scores.T @ scores) @ bread * n / (n - 1))


def _near_bound(name: str, multiplier: float) -> bool:
    parameter = parameters.PARAMETERS[parameters.index(name)]
    margin = _AT_BOUND * (parameter.upper - parameter.lower)
    return multiplier < parameter.lower + margin or multiplier > parameter.upper - margin


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
