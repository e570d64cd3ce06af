"""Nominal parameters by nonlinear least squares on the recordings (section II.C of Tod et al.).

A joint fit stalls if it starts far from the optimum, so the fit has stages. The pressure determines the delay, bias and
gain of the current, and the ratio of torque to pressure determines the friction coefficient. Shifting times and torque
then determine the pressure bias and the piston parameters. Finally all parameters are fitted jointly to all data. Each
residual is divided by the standard deviation of its sensor noise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from slipstick.bench import Bench, Prior, parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.processing import blended_at_lock_up, block_means, sensor_noise
from slipstick.recordings.signals import SIGNAL_UNITS

Report = Callable[[tuple[str, ...], int, float], None]
"""Callback after every iteration: names of the free parameters, evaluations of this stage, sum of squares."""

_CHANNELS = (*SIGNAL_UNITS, "shifting_time")
_STAGES: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("current_delay", "current_bias", "current_gain"), ("pressure",)),
    (("pressure_bias", "temperature_gain", "initial_position"), ("output_torque", "shifting_time")),
)
"""Free parameters and fitted channels of each stage before the joint fit."""
_WIDTH = 8
"""Samples per block mean: 16 ms at the 500 Hz of the shipped recordings. Without averaging, the sum of squares jumps
whenever a simulated lock-up crosses a sample, and the optimizer stalls."""
_STEP = 5e-4
"""Step of the central differences, in multiples of nominal values."""
_CONVERGED = 1e-6
"""Relative change of the sum of squares, or of the multipliers, below which the optimizer stops."""
_ACCURACY = ensemble.Accuracy(5e-4, 2e-3)
_FEWEST = 14
"""Minimum number of engagements for a clustered covariance of seven parameters."""
_AT_BOUND = 1e-3
"""Distance to a bound, as a fraction of the parameter's range, below which the parameter is reported at the bound."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """The fitted `model`, with standard errors and correlation of its d `free` parameters.

    `standard_error` (d,), in the units of the parameters, and `correlation` (d, d) come from the sandwich estimator
    clustered by engagement, so that residuals may be dependent within an engagement, as they are if parameters vary
    from run to run. They describe the variance only, not a bias due to this variation or to missing physics.
    `chi_square` is the reduced chi-square of each channel, 1 if only sensor noise remains, and `noise` the standard
    deviation of the sensor noise. `rms_before` and `rms_after` are RMS residuals of the shifting time in s. `at_bound`
    names the parameters at a bound: their values are those of the bound, not estimates.
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
        """Return the calibration as JSON; `Model.from_spec` reads the entry "model"."""
        values = dict(zip(parameters.NAMES, self.model.parameters, strict=True))
        units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
        fitted = {
            name: {"value": values[name], "unit": units[name], "standard_error": float(error)}
            for name, error in zip(self.free, self.standard_error, strict=True)
        }
        return {"model": self.model.spec(), "parameters": fitted, "correlation": self.correlation.tolist(),
                "reduced_chi_square": self.chi_square, "noise": self.noise, "at_bound": list(self.at_bound),
                "rms_before_s": self.rms_before, "rms_after_s": self.rms_after, "evaluations": self.evaluations}


def calibrate(recordings: Recordings, bench: Bench, start: Model | None = None,
              report: Report = lambda *_: None) -> Calibration:
    """Fit the uncertain parameters of the `bench` to `recordings`, which must have signals.

    The search starts from the model `start`, by default from the nominal parameters, whose effects are not changed. The
    noise of the shifting time is that of the bench; the noise of the signals is estimated from the recordings. `report`
    is called after every iteration. Raises `InvalidValue`.
    """
    shifting_time_noise = bench.sensors["shifting_time"].noise
    if not shifting_time_noise:
        raise InvalidValue(f"The bench '{bench.name}' does not state the noise of the shifting time",
                           'Add `shifting_time = { noise = "3 ms" }` to its [sensors]')
    if recordings.signals is None:
        raise InvalidValue("These recordings have no signals, and shifting times alone do not determine the parameters",
                           "Record pressure, speeds and torque as well")
    if len(recordings.conditions) < _FEWEST:
        raise InvalidValue(f"{len(recordings.conditions)} engagements are too few for a calibration",
                           f"Record at least {_FEWEST} engagements under different conditions")
    model = start or Model(bench.physics)
    bench.require(model.physics)
    noise = {**sensor_noise(recordings.signals), "shifting_time": shifting_time_noise}
    problem = _Problem(recordings, recordings.signals, bench, noise, model.coefficients(), report)
    before = problem.residuals(model.parameters)["shifting_time"] * shifting_time_noise
    evaluations = 0
    for stage, channels in _STAGES:
        free = tuple(name for name in stage if name in bench.uncertain)
        if not free:
            continue
        model, solution = problem.solve(model, free, channels)
        evaluations += solution.nfev
        if "pressure" in channels and "friction_coefficient" in bench.uncertain:
            model = model.with_parameters({"friction_coefficient": problem.friction(model)})
    fitted = bench.uncertain
    model, solution = problem.solve(model, fitted, _CHANNELS)

    covariance = problem.covariance(solution)
    error = np.sqrt(np.diag(covariance))
    residuals = problem.residuals(model.parameters)
    dof = 1 - len(fitted) / sum(residual.size for residual in residuals.values())
    nominal = model.nominal[[parameters.index(name) for name in fitted]]
    return Calibration(
        model=model, free=fitted, standard_error=error * nominal,
        correlation=covariance / np.outer(error, error),
        chi_square={name: float(np.mean(residual**2) / dof) for name, residual in residuals.items()},
        noise=problem.noise, rms_before=_rms(before), rms_after=_rms(residuals["shifting_time"] * shifting_time_noise),
        at_bound=tuple(name for name, value in zip(fitted, solution.x, strict=True)
                       if _is_at_bound(bench.prior(name), value)),
        evaluations=evaluations + solution.nfev,
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """The least-squares problem: recordings, noise std of each channel, coefficients (c,) of the model's effects."""

    recordings: Recordings
    signals: Signals
    bench: Bench
    noise: dict[str, float]
    coefficients: np.ndarray
    report: Report

    def residuals(self, vector: Any) -> dict[str, np.ndarray]:
        """(simulated - measured) / noise of each channel at one parameter vector (20,): (n,) or (n, averages)."""
        return {name: residual[0] for name, residual in self._residuals(np.array([vector], float)).items()}

    def _residuals(self, vectors: np.ndarray) -> dict[str, np.ndarray]:
        coefficients = np.tile(self.coefficients, (len(vectors), 1))
        response = ensemble.simulate(self.bench.physics.curves, vectors, coefficients, self.recordings.conditions,
                                     self.signals.time, _ACCURACY)
        if np.any(response.status == ensemble.FAILED):
            raise InvalidValue("A simulation failed within the bounds of the calibration",
                               "Start from a model closer to the nominal one")
        simulated = {name: getattr(response, name) for name in SIGNAL_UNITS}
        simulated["output_torque"] = blended_at_lock_up(response.output_torque, response.shifting_time,
                                                        self.signals.time)
        residuals = {name: block_means(simulated[name] - getattr(self.signals, name), _WIDTH)
                     / (self.noise[name] / np.sqrt(_WIDTH)) for name in SIGNAL_UNITS}
        # An engagement that never locks is given the end of its current profile, so that its residual is finite.
        conditions = self.recordings.conditions
        profile_end = conditions.profile_time[conditions.current_profile, -1]
        times = np.where(response.status == ensemble.LOCKED, response.shifting_time, profile_end)
        residuals["shifting_time"] = (times - self.recordings.measured_time) / self.noise["shifting_time"]
        return residuals

    def solve(self, model: Model, free: tuple[str, ...], channels: tuple[str, ...]) -> tuple[Model, Any]:
        """Fit the multipliers of the nominal values of `free` to `channels` by least squares, starting at `model`."""
        columns = [parameters.index(name) for name in free]
        nominal = model.nominal[columns]
        base = np.array(model.parameters)

        def vectors(points: np.ndarray) -> np.ndarray:
            full = np.tile(base, (len(points), 1))
            full[:, columns] = points * nominal
            return full

        def residual_rows(points: np.ndarray) -> np.ndarray:
            by_channel = self._residuals(vectors(points))
            return np.concatenate([by_channel[name].reshape(len(points), -1) for name in channels], axis=1)

        def residuals(point: np.ndarray) -> np.ndarray:
            return np.asarray(residual_rows(point[None])[0])

        def jacobian(point: np.ndarray) -> np.ndarray:
            steps = _STEP * np.eye(len(free))
            shifted = residual_rows(np.concatenate([point + steps, point - steps]))
            return np.asarray((shifted[:len(free)] - shifted[len(free):]).T / (2 * _STEP))

        lower = np.array([self.bench.prior(name).lower for name in free])
        upper = np.array([self.bench.prior(name).upper for name in free])
        initial = np.clip(base[columns] / nominal, lower + 1e-6, upper - 1e-6)
        solution = least_squares(residuals, initial, jac=jacobian,
                                 bounds=(lower, upper), x_scale="jac",
                                 ftol=_CONVERGED, xtol=_CONVERGED, max_nfev=60,
                                 callback=lambda intermediate_result: self.report(
                                     free, intermediate_result.nfev, 2 * intermediate_result.cost))
        return model.with_parameters(dict(zip(free, solution.x * nominal, strict=True))), solution

    def friction(self, model: Model) -> float:
        """Friction coefficient in N m/Pa: torque over pressure while the loaded plates slip, just before lock-up."""
        values = dict(zip(parameters.NAMES, model.parameters, strict=True))
        to_lock_up = self.recordings.measured_time[:, None] - self.signals.time
        loaded = (to_lock_up > 0.02) & (to_lock_up < 0.08) & (self.signals.pressure > 1.0)
        contact_ratio = values["contact_position"] / (values["contact_position"] - values["contact_length"])
        if not np.any(loaded):
            raise InvalidValue("No engagement has samples above 1 bar between 80 and 20 ms before lock-up",
                               "Check the units of pressure and time, and that the signals reach the shifting times")
        torque = self.signals.output_torque / values["gear_ratio"]
        return float(np.median(torque[loaded] / (contact_ratio * 1e5 * self.signals.pressure[loaded])))

    def covariance(self, solution: Any) -> np.ndarray:
        """Sandwich estimator of the covariance of the multipliers, clustered by engagement: (d, d)."""
        n, d, k = len(self.recordings.conditions), solution.jac.shape[1], len(self.signals.time) // _WIDTH
        scores, offset = np.zeros((n, d)), 0
        for name in _CHANNELS:
            width = 1 if name == "shifting_time" else k
            rows = slice(offset, offset + n * width)
            weighted = solution.jac[rows] * solution.fun[rows, None]
            scores += weighted.reshape(n, width, d).sum(axis=1)
            offset += n * width
        bread = np.linalg.inv(solution.jac.T @ solution.jac)
        return np.asarray(bread @ (scores.T @ scores) @ bread * n / (n - 1))


def _is_at_bound(prior: Prior, multiplier: float) -> bool:
    margin = _AT_BOUND * (prior.upper - prior.lower)
    return multiplier < prior.lower + margin or multiplier > prior.upper - margin


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
