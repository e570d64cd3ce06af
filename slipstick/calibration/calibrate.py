"""Nominal parameters from recordings (section II.C of Tod et al.), by a nonlinear mixed-effects fit."""

import time
from dataclasses import replace

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.blocks.sensor_noise import noise_of, sensor_noise
from slipstick.blocks.whitening import BlockNoise
from slipstick.calibration.mixed import MixedFit, Report, fit
from slipstick.calibration.noise import Noise
from slipstick.calibration.observations import Observations
from slipstick.calibration.result import Calibration
from slipstick.calibration.start import start as start_values
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.plausibility.mismatch import require_match
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.fitness import require_one_clock
from slipstick.time_budget import Partial

LEVEL = 0.9
"""Probability of the intervals."""
_FEWEST_PER_PARAMETER = 2
"""Minimum number of engagements for each free parameter: one determines its mean, a second its scatter."""
_SCATTER = 0.05
"""Standard deviation of a multiplier from run to run that the search assumes where the bench file states none. It keeps
single engagements near the others while no common values are known; the fit estimates the scatter."""
_AT_BOUND = 1e-3
"""Distance to a bound, as a fraction of the parameter's range, below which the parameter is reported at the bound."""


def calibrate(recordings: Recordings, bench: Bench, start: Model | None = None,
              report: Report = lambda *_: None, budget: float = np.inf) -> Calibration:
    """Fit the uncertain parameters of the `bench` to `recordings`, which must have at least one signal.

    The search starts from the model `start`, by default from the nominal parameters, whose effects and laws are not
    changed. The noise of the shifting time is that of the bench; the noise of the signals is estimated from the
    recordings. A signal that was not measured counts nothing. `report` is called after every iteration. The first one
    that ends after the time `budget` in s is the last one. Raises `InvalidValue`, also for recordings that cannot be of
    the bench.
    """
    end = time.monotonic() + budget
    model = start or Model(bench.physics)
    bench.require(model.physics)
    signals, lock_up_noise = require_signals(recordings, bench)
    observations = Observations(recordings, signals, bench, bench.uncertain, np.array(model.parameters),
                                model.coefficients(), model.laws)
    shown = [sensor_noise(name, signals[name]) for name in signals.names]
    sensors = Noise(*np.array([*shown, (lock_up_noise, 0.0)]).T)
    require_match(recordings, bench, model)
    scatter = [bench.prior(name).scatter for name in bench.uncertain]
    fitted = fit(observations, start_values(observations), sensors,
                 np.array([std or _SCATTER for std in scatter]), report, end)
    partial = Partial(budget, [f"iterations: {fitted.iterations}"], ["convergence"]) if fitted.is_partial else None
    return replace(_conclude(observations, model, fitted, lock_up_noise), partial=partial)


def require_signals(recordings: Recordings, bench: Bench) -> tuple[Signals, float]:
    """The signals, and the noise of the shifting time in s; raises `InvalidValue` if these do not suffice."""
    noise = bench.sensors["shifting_time"].noise
    if not noise:
        raise InvalidValue(f"The bench '{bench.name}' does not state the noise of the shifting time",
                           'Add `shifting_time = { noise = "3 ms" }` to its [sensors]')
    if recordings.signals is not None:
        require_one_clock(recordings)
    if not bench.uncertain:
        raise InvalidValue(f"No parameter of the bench '{bench.name}' is uncertain",
                           "Mark those to calibrate in its [parameters] with `uncertain = true`")
    if recordings.signals is None:
        raise InvalidValue("These recordings have no signals, and shifting times alone do not determine the parameters",
                           "Record pressure, speeds or torque as well")
    fewest = _FEWEST_PER_PARAMETER * len(bench.uncertain)
    if len(recordings.conditions) < fewest:
        raise InvalidValue(f"{len(recordings.conditions)} engagements are too few for a calibration",
                           f"Record at least {fewest} engagements under different conditions")
    return recordings.signals, noise


def _conclude(observations: Observations, model: Model, fitted: MixedFit, lock_up_noise: float) -> Calibration:
    effects, bench, free = fitted.effects, observations.bench, observations.free
    nominal = np.array(bench.physics.nominal)[[parameters.index(name) for name in free]]
    lower, upper = observations.bounds
    margin = _AT_BOUND * (upper - lower)
    values = dict(zip(free, effects.mean * nominal, strict=True))
    calibrated, error = model.with_parameters(values), effects.standard_error
    noise, chi_square = _estimate_noise(observations, fitted, lock_up_noise)
    return Calibration(
        model=calibrated, free=free, standard_error=error * nominal,
        interval=effects.intervals(LEVEL) * nominal[:, None], level=LEVEL,
        correlation=effects.covariance / np.outer(error, error), scatter=effects.scatter * nominal,
        scatter_error=effects.scatter_error * nominal, chi_square=chi_square,
        noise=dict(zip(observations.channels, noise.std.tolist(), strict=True)),
        noise_correlation=dict(zip(observations.signals.names, noise.correlation[:-1].tolist(), strict=True)),
        rms_before=_rms_of_times(observations, observations.start), rms_after=_rms_of_times(observations, effects.mean),
        at_bound=tuple(name for name, value, low, high, near in
                       zip(free, effects.mean, lower, upper, margin, strict=True)
                       if value < low + near or value > high - near),
        signals=observations.signals.names,
        undetermined=tuple(name for name, is_so in zip(free, effects.undetermined, strict=True) if is_so),
        evaluations=fitted.iterations, converged=fitted.converged, bench=bench.name, bench_digest=bench.digest,
        sensing_digest=bench.sensing_digest, bounds=np.column_stack([lower, upper]) * nominal[:, None])


def _estimate_noise(observations: Observations, fitted: MixedFit,
                    lock_up_noise: float) -> tuple[Noise, dict[str, float]]:
    """The noise of the sensors as the residuals of each engagement show it, and the reduced chi-square of channels."""
    points, places = fitted.about.points, np.arange(len(observations.recordings))
    response = observations.simulate(points[None], places)
    signals, times = observations.residuals(response, places)
    counted = observations.counted(observations.lock_up(response, places), places, lock_up_noise)
    shown = [noise_of(left[0], is_counted, BlockNoise(*sensor_noise(name, left[0])))
             for left, is_counted, name in zip(signals, counted, observations.signals.names, strict=True)]
    noise = Noise(*np.array([*shown, (lock_up_noise, 0.0)]).T)
    squares = [float(np.mean(signals[channel, 0][counted[channel]] ** 2)) for channel in range(len(signals))]
    # What the parameters of the engagements have taken from the residuals, by the trace of the posterior.
    samples = fitted.about.counts[:, 0].sum(axis=1)
    taken = np.einsum("cnpq,nqp->c", fitted.about.products[:, 0, :, :-1, :-1], fitted.effects.posterior, optimize=True)
    mean = np.array([*squares, float(np.mean(times**2))]) + taken / samples
    return noise, dict(zip(observations.channels, (mean / noise.std**2).tolist(), strict=True))


def _rms_of_times(observations: Observations, point: np.ndarray) -> float:
    places = np.arange(len(observations.recordings))
    response = observations.simulate(np.tile(point, (1, len(places), 1)), places)
    return float(np.sqrt(np.mean(observations.residuals(response, places)[1] ** 2)))
