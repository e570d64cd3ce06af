"""The gap between model and recordings on conditions that a fit has not seen, without and with what was named.

    closure = 1 - (MSE_after - V) / (MSE_before - V)

MSE is that of a signal or of the shifting time, predicted with the mean parameters of a fit without the experiments of
that motor speed or of that current profile. V is what sensor noise and the scatter of the parameters between
engagements leave where the model is right, by the fit with what was named.

Where parameters scatter much, their scatter hides a gap of this kind. The gap `WITHIN` engagements is that of all
signals at once under the predictive distribution, in which the parameters of each engagement are integrated out: noise
alone leaves a mean square of 1.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.clutch.ensemble import Response
from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.traces import Traces
from slipstick.engine.linear_model import likelihood, solve

WITHIN = "within_engagements"
"""Name of the gap of all signals beside the scatter of the parameters."""
_DRAWS = 16
"""Draws of the parameters of each engagement: the variance of 54 engagements is then known to 5 %."""
_BOOTSTRAP = 1000
_TAIL = 0.05
"""Share of bootstrap samples beyond either end of an interval."""
_FEWEST = 3
"""Levels of a condition that make folds; recordings with fewer are split at random."""
_RANDOM_FOLDS = 5


@dataclass(frozen=True, eq=False)
class Prediction:
    """Held-out predictions of n engagements.

    `square` (n, c) are mean squared errors in the c `channels`, the measured signals, the shifting time, and `WITHIN`;
    `variance` (n, c) are those that a right model would have, in the squared units of the channels. `time` (n,) are
    shifting times in s.
    """

    channels: tuple[str, ...]
    square: np.ndarray
    variance: np.ndarray
    time: np.ndarray

    def total(self, traces: Traces) -> float:
        """Mean squared error of all signals and the shifting time, each in the variance of its noise."""
        noise = [*(traces.scene.noise[name][0] for name in traces.signals), traces.scene.timer_noise]
        return float((self.square[:, :len(noise)] / np.square(noise)).mean())


@dataclass(frozen=True)
class Closure:
    """The gap on held-out conditions in one signal (in its unit), the shifting time (in s), or within engagements.

    That is the gap in all signals beside the scatter of the parameters, in standard deviations of the noise.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    rms_before: float
    """Root-mean-square error without the findings."""
    rms_after: float
    """Root-mean-square error with the findings."""
    rms_expected: float
    """Root-mean-square error of a right model, due to noise and scatter."""
    closure: float | None
    """Share of the gap that the findings close; null if there is no significant gap without them."""
    lower: float | None
    """Lower end of the 90 % bootstrap interval of `closure`."""
    upper: float | None
    """Upper end of the 90 % bootstrap interval of `closure`."""


def folds(conditions: Conditions, seed: int) -> list[np.ndarray]:
    """Rows (n,) of the experiments to leave out: those of a motor speed, then those of a current profile."""
    left_out = []
    for column in (conditions.motor_speed, conditions.current_profile):
        levels = np.unique(column)
        if _FEWEST <= len(levels) < len(column):
            left_out += [column == level for level in levels]
    if not left_out:
        place = np.random.default_rng(seed).permutation(len(conditions)) % _RANDOM_FOLDS
        left_out = [place == fold for fold in range(_RANDOM_FOLDS)]
    return left_out


def predict(fit: SimulationFit, seed: int) -> Prediction:
    """Predict every experiment by the fits without it, the mean over the folds that leave it out."""
    block, scene, q = fit.block, fit.block.scene, len(fit.block.random)
    n, linear = len(scene), fit.fitted.fitted
    square, time, count = np.zeros((n, len(block.traces.channels))), np.zeros(n), np.zeros(n)
    whole, within = solve(linear.gram, linear.marginal.sum(axis=0)).coefficients, np.zeros(n)
    for rows in folds(scene.recordings.conditions, seed):
        # The change by the engagements that are left out is linear; the fit itself need not be where its linear
        # model points to, because a model that lacks an effect may not come to rest.
        others = solve(linear.gram, linear.marginal[~rows].sum(axis=0)).coefficients
        within[rows] += _mean_squares_within(fit, others)[rows]
        change = others - whole
        mean, shared = fit.fitted.mean + change[:q], fit.fitted.shared + change[q:]
        response = block.respond(np.tile(mean, (n, 1)), shared)
        square[rows] += _squares(fit, response)[rows]
        time[rows] += fit.block.traces.times(response)[rows]
        count[rows] += 1
    # Draws in common would leave the mean variance of all engagements as uncertain as that of one.
    drawn = np.random.default_rng(seed).standard_normal((_DRAWS, n, q)) * np.sqrt(fit.fitted.variance)
    scattered = [block.respond(fit.fitted.mean + draw, fit.fitted.shared) for draw in drawn]
    noise = np.full(n, min(1.0, float(_mean_squares_within(fit, whole).mean())))  # no more than what the fit leaves
    return Prediction((*block.traces.channels, WITHIN), np.column_stack([square, within]) / count[:, None],
                      np.column_stack([_variances(fit, scattered), noise]), time / count)


def closures(before: Prediction, after: Prediction, seed: int) -> dict[str, Closure]:
    """What is closed of the gap of each channel."""
    n, closed = len(before.square), {}
    drawn = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), _BOOTSTRAP) / n
    for at, name in enumerate(before.channels):
        wide, narrow, expected = before.square[:, at], after.square[:, at], after.variance[:, at]
        gap = drawn @ (wide - expected)
        sure = np.quantile(gap, _TAIL) > 0
        shares = 1 - drawn @ (narrow - expected) / gap if sure else np.zeros(1)
        share = 1 - (narrow - expected).mean() / (wide - expected).mean()
        lower, upper = np.quantile(shares, (_TAIL, 1 - _TAIL)).tolist()
        rms = (float(np.sqrt(values.mean())) for values in (wide, narrow, expected))
        closed[name] = Closure(*rms, *((float(share), lower, upper) if sure else (None, None, None)))
    return closed


def _mean_squares_within(fit: SimulationFit, coefficients: np.ndarray) -> np.ndarray:
    """Mean squares (n,) of all whitened residuals at `coefficients` (c - 1,), the random effects integrated out."""
    linear = fit.fitted.fitted
    squares = -2 * likelihood(linear.marginal, np.zeros(len(linear.marginal)), coefficients)
    return np.asarray(squares / fit.block.counted.sum(axis=1))


def _squares(fit: SimulationFit, response: Response) -> np.ndarray:
    """Mean squared errors (n, c) of a simulation."""
    scene, values = fit.block.scene, []
    for name in fit.block.traces.signals:
        left = scene.measured(name) - np.nan_to_num(getattr(response, name))
        values.append((left**2).mean(axis=1))
    return np.stack([*values, (scene.recordings.measured_time - fit.block.traces.times(response)) ** 2], axis=1)


def _variances(fit: SimulationFit, scattered: list[Response]) -> np.ndarray:
    """Variances (n, c) of simulations with other parameters, and of the sensors' noise.

    Differences of neighbouring samples tell the noise roughly. It is no more than what the fit leaves.
    """
    traces, values = fit.block.traces, []
    left = _squares(fit, fit.block.respond(fit.fitted.points, fit.fitted.shared)).mean(axis=0)
    for name, most in zip(traces.signals, left, strict=False):
        drawn = np.array([np.nan_to_num(getattr(response, name)) for response in scattered])
        values.append(drawn.var(axis=0, ddof=1).mean(axis=1) + min(traces.scene.noise[name][0] ** 2, most))
    times = np.array([traces.times(response) for response in scattered])
    return np.stack([*values, times.var(axis=0, ddof=1) + traces.scene.timer_noise**2], axis=1)
