"""Start values of a calibration, block by block: a joint fit from far away ends in a local optimum.

The pressure determines delay, bias and gain of the current, by least squares for each engagement. Pressure bias and
initial position of the piston come from a search over their bounds, because the torque of the closing plates has local
optima in them. In full contact the torque determines the friction coefficient of each engagement. A signal that was not
measured is simulated at the points so far where it drives a block, and a step that fits it is left out.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks import Clutch, Friction, Valve
from slipstick.calibration.observations import Observations
from slipstick.recordings import Recordings, Signals

_STEP = 1e-4  # of differences of the closed-form prediction, in multiples of nominal values
_ITERATIONS = 12
_LEVELS, _ROUNDS = 11, 4
"""Levels of each parameter in a round of the search; every round searches two spacings about the best point."""
_FEWEST_SEARCHED = 24
"""Engagements that the search uses at least: their common optimum is a start value, not an estimate."""


def start(observations: Observations) -> np.ndarray:
    """Points (n, d) of the engagements, from the base values of the observations."""
    points = np.tile(observations.start, (len(observations.recordings), 1))
    measured = observations.signals.names
    if "pressure" in measured:
        valve = Valve.of(observations.recordings)
        points = least_squares(observations, points, valve.parameters, valve.predict, observations.signals["pressure"])
    if "output_torque" not in measured:
        return points
    driven = replace(observations.recordings, signals=_driving_signals(observations, points))
    points = _search_piston(observations, points, Clutch.of(driven))
    return _fit_friction(observations, points, driven)


def _driving_signals(observations: Observations, points: np.ndarray) -> Signals:
    """The measured signals, and at their points (n, d) the simulated ones of those that were not measured."""
    signals = observations.signals
    if not signals.missing:
        return signals
    response = observations.simulate(points[None], np.arange(len(points)))
    return replace(signals, **{name: getattr(response, name) for name in signals.missing})


def least_squares(observations: Observations, points: np.ndarray, names: tuple[str, ...],
                  predict: Callable[[np.ndarray], np.ndarray], measured: np.ndarray) -> np.ndarray:
    """Fit the free parameters among `names` to the signal `measured` (n, k) of each engagement: new points (n, d).

    Levenberg-Marquardt, with a damping of its own for each engagement.
    """
    columns = [place for place, name in enumerate(observations.free) if name in names]
    if not columns:
        return points
    lower, upper = observations.bounds

    def residuals(at: np.ndarray) -> np.ndarray:
        return np.asarray(measured - predict(observations.vectors(at)))

    left, damping = residuals(points), np.full(len(points), 1e-3)
    for _ in range(_ITERATIONS):
        slopes = np.stack([(left - residuals(points + _STEP * np.eye(points.shape[1])[column])) / _STEP
                           for column in columns], axis=1)
        gram, pull = slopes @ slopes.transpose(0, 2, 1), (slopes @ left[..., None])[..., 0]
        gram += damping[:, None, None] * np.einsum("npp->np", gram)[:, None] * np.eye(len(columns))
        change = np.linalg.solve(gram, pull[..., None])[..., 0]
        tried = points.copy()
        tried[:, columns] += change
        tried = np.clip(tried, lower, upper)
        tried_left = residuals(tried)
        better = (tried_left**2).sum(axis=1) < (left**2).sum(axis=1)
        points, left = np.where(better[:, None], tried, points), np.where(better[:, None], tried_left, left)
        damping = np.where(better, damping / 10, damping * 10)
        if np.max(np.abs(change)) < _STEP:
            break
    return points


def _search_piston(observations: Observations, points: np.ndarray, clutch: Clutch) -> np.ndarray:
    """Points with the pressure bias and initial position that suit the torque of all engagements best."""
    columns = [place for place, name in enumerate(observations.free) if name in ("pressure_bias", "initial_position")]
    if not columns:
        return points
    step = max(1, len(points) // _FEWEST_SEARCHED)
    slipping = _slipping_samples(observations)
    sample = slice(None, None, step)
    few = Clutch(clutch.time, clutch.pressure[sample], clutch.input_speed[sample], clutch.output_speed[sample])
    torque, counted, vectors = observations.signals["output_torque"][sample], slipping[sample], points[sample]
    lower, upper = (bound[columns] for bound in observations.bounds)

    def misfit(values: np.ndarray) -> float:
        at = vectors.copy()
        at[:, columns] = values
        predicted = few.predict(observations.vectors(at)) * counted
        scale = _scale(predicted, torque) if "friction_coefficient" in observations.free else 1.0
        return float(((torque * counted - scale * predicted) ** 2).sum())

    for _ in range(_ROUNDS):
        axes = [np.linspace(low, high, _LEVELS) for low, high in zip(lower, upper, strict=True)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(columns))
        best = grid[np.argmin([misfit(values) for values in grid])]
        spacing = 2 * (upper - lower) / (_LEVELS - 1)
        lower, upper = np.maximum(lower, best - spacing), np.minimum(upper, best + spacing)
    starts = points.copy()
    starts[:, columns] = best
    return starts


def _fit_friction(observations: Observations, points: np.ndarray, driven: Recordings) -> np.ndarray:
    """Points with the friction coefficient that each engagement shows in full contact; 1 where it has none."""
    if "friction_coefficient" not in observations.free:
        return points
    vectors = observations.vectors(points)
    position = Clutch.of(driven).piston_position(vectors)
    contact = position >= vectors[:, parameters.index("contact_position"), None]
    counted = contact & _slipping_samples(observations)
    # The later half: how early the plates are in contact depends on the piston, whose parameters are only a start.
    counted &= 2 * counted.cumsum(axis=1) > counted.sum(axis=1, keepdims=True)
    predicted = Friction.of(driven).predict(vectors) * counted
    column, (lower, upper) = observations.free.index("friction_coefficient"), observations.bounds
    starts = points.copy()
    starts[:, column] *= _scale(predicted, observations.signals["output_torque"])[:, 0]
    return np.asarray(np.clip(starts, lower, upper))


def _slipping_samples(observations: Observations) -> np.ndarray:
    """Samples (n, k) before lock-up, as measured."""
    noise = observations.bench.sensors["shifting_time"].noise or 0.0
    return np.asarray(~observations.locked(noise))


def _scale(predicted: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """The factor (n, 1) of a prediction, 0 where it does not count, that suits a torque best."""
    square = (predicted**2).sum(axis=1, keepdims=True)
    product = (predicted * torque).sum(axis=1, keepdims=True)
    return np.asarray(np.where(square > 0, product / np.where(square > 0, square, 1), 1.0))
