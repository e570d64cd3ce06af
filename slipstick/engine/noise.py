"""The noise of a sensor, from its signal, and from what a fit leaves of it.

A signal shows its noise only in differences of neighbouring samples, which say little of strongly correlated noise.
What a fit leaves has no signal, so that differences over more samples show the noise as well, and that of inputs which
the equations integrate. A model that lacks something leaves that, too: slowly, so that second differences lack it, or
suddenly in a few samples, which are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import scipy

from slipstick.errors import InvalidValue

LAGS = (1, 2, 4, 8)
"""Samples between those of a second difference. Correlations from 0.5 to 0.95 show in these; over more samples,
what a model lacks is no longer slow."""
LONGER = (*LAGS, 16)
"""The same where the noise of an input is unknown that equations integrate: its power is then known to 10 % and not to
40 %. Over 32 samples it was doubled by a strong effect that was missing."""
_BEGIN, HIGHEST = 0.9, 0.999
"""Largest magnitude of an autocorrelation by differences of neighbours, which hardly depend on a larger one, and at
all: a random walk has 1."""
CORRELATIONS = np.tanh(np.linspace(-0.5, 2.5, 7))
"""Autocorrelations for which the noise of an input is drawn: between these, what it adds changes by less than half."""
_LEAST = 0.1
"""Least standard deviation, over the least that could by itself give the second differences of neighbouring samples.
Where the integrated noise of an input exceeds all that is left of a signal, its sensor would have no noise at all."""
_KEPT = 0.8
"""Share of the smallest values in a standard deviation that jumps do not reach. The median absolute value would be a
multiple of the resolution of the sensor."""
_EDGE = NormalDist().inv_cdf(0.5 + 0.5 * _KEPT)
_KEPT_VARIANCE = 1 - 2 * _EDGE * np.exp(-_EDGE**2 / 2) / np.sqrt(2 * np.pi) / _KEPT
"""Magnitude below which these values of a standard normal variable are, and their variance."""
_SECOND_ERROR = 6.0
"""Sampling variance of the logarithm of the robust variance of second differences, times the number of samples: 1.8
times that of independent normal values (correlation of neighbouring differences, and the values that are left out)."""
_NONE = 1e-300
"""Least variance of which there is a logarithm."""
_THIRD, _LAGGED = np.array([1.0, -3.0, 3.0, -1.0]), np.array([1.0, -2.0, 0.0, 2.0, -1.0])
_ROUNDED = 100.0
"""Spacings of floating point numbers below which differences of a signal are no noise, but rounding."""


@dataclass(frozen=True)
class Noise:
    """Standard deviation in the unit of the signal, and autocorrelation from sample to sample."""

    std: float
    correlation: float

    @property
    def fresh(self) -> float:
        """Standard deviation of what is new in each sample."""
        return self.std * float(np.sqrt(1 - self.correlation**2))

    @property
    def power(self) -> float:
        """Power at low frequencies, in the square of the unit: the sum of all autocovariances."""
        return self.std**2 * (1 + self.correlation) / (1 - self.correlation)


@dataclass(frozen=True)
class Differences:
    """Standard deviations of the `third` differences of a signal, and of the sums of two successive ones, `lagged`.

    A smooth signal does not reach either, and jumps are rare, so that these are those of the noise.
    """

    third: float
    lagged: float

    @classmethod
    def of(cls, values: np.ndarray) -> "Differences":
        """Return those of rows (n, k)."""
        return cls(*(robust_std(_convolve(values, taps)) for taps in (_THIRD, _LAGGED)))

    @classmethod
    def of_sensor(cls, name: str, values: np.ndarray, rounding: float = 0.0) -> "Differences":
        """Return those of rows (n, k) of the signal `name`; raises `InvalidValue` without noise beyond rounding."""
        shown = cls.of(values)
        if not shown.third > rounding:
            raise InvalidValue(f"The signal {name} shows no noise, so its residuals cannot be weighted",
                               "Record it with a finer resolution, or add the noise of its sensor")
        return shown

    def noise(self, correlation: float) -> Noise:
        """Return the noise of a correlation that has these third differences."""
        return Noise(float(self.third / np.sqrt(filter_variance(_THIRD, correlation))), correlation)

    def excess(self, correlation: float) -> float:
        """Return by how much the sums that belong to a correlation exceed those of the signal, as a logarithm."""
        ratio = filter_variance(_LAGGED, correlation) / filter_variance(_THIRD, correlation)
        return float(np.log(ratio * self.third**2 / max(self.lagged**2, _NONE)))

    @property
    def correlation(self) -> float:
        """The correlation of a noise that has both, or the furthest one where none has."""
        low, high = self.excess(-HIGHEST), self.excess(HIGHEST)
        if low < 0 < high:
            return float(scipy.optimize.brentq(self.excess, -HIGHEST, HIGHEST))
        return HIGHEST if high <= 0 else -HIGHEST


def estimate_sensor_noise(name: str, values: np.ndarray) -> Noise:
    """Return the noise in rows (n, k) of the signal `name`, from its differences.

    Raises `InvalidValue` if there is no noise.
    """
    shown = Differences.of_sensor(name, values, _ROUNDED * float(np.spacing(np.abs(values).max())))
    return shown.noise(float(np.clip(shown.correlation, -_BEGIN, _BEGIN)))


def bound_noise(noise: Noise, values: np.ndarray) -> Noise:
    """Return a noise whose third differences are no larger than those of the signal (n, k) that it is a part of.

    What a fit leaves beyond that is missing in the model.
    """
    largest = robust_std(_convolve(values, _THIRD)) / np.sqrt(filter_variance(_THIRD, noise.correlation))
    return Noise(min(noise.std, float(largest)), noise.correlation)


def _convolve(values: np.ndarray, taps: np.ndarray) -> np.ndarray:
    return np.asarray(np.apply_along_axis(np.convolve, 1, values, taps, "valid"))


def second_variances(values: np.ndarray, counted: np.ndarray, lags: Sequence[int]) -> np.ndarray:
    """Variances (o, lags) of the second differences of o signals (n, o, k), 0 where too few samples count."""
    return np.array([[second_variance(values[:, place], counted[:, place], samples) for samples in lags]
                     for place in range(values.shape[1])])


@dataclass(frozen=True, eq=False)
class SecondDifferences:
    """Those that a fit leaves of o signals, over `lags` in samples: their variances `observed` (o, lags).

    `known` (o, lags) ones come from the noise of inputs. Logarithms count alike, or where that is slow by `weights` (o,
    lags, lags), which make their errors independent and of variance 1.
    """

    lags: Sequence[int]
    observed: np.ndarray
    known: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, left: np.ndarray, counted: np.ndarray, lags: Sequence[int], known: np.ndarray | None = None,
           slow: np.ndarray | None = None) -> "SecondDifferences":
        """Return those of what is `left` (n, o, k), beside draws of what `known` and what `slow` noise of inputs adds.

        Slow noise is known to some per cent of it only, which over several samples may be more than all noise of the
        sensor, and is nearly the same error at all of them (generalised least squares).
        """
        observed = second_variances(left, counted, lags)
        added = np.zeros(observed.shape) if known is None else second_variances(known, counted[:len(known)], lags)
        if slow is None:
            return cls(lags, observed, added, np.tile(np.eye(len(lags)), (len(observed), 1, 1)))
        shares = (added if slow is known else second_variances(slow, counted, lags)) / np.maximum(observed, _NONE)
        errors = [_log_errors(left[:, place], counted[:, place], lags)
                  + share[:, None] * _log_errors(slow[:, place], counted[:, place], lags) * share
                  for place, share in enumerate(shares)]
        return cls(lags, observed, added, np.linalg.inv(np.linalg.cholesky(np.array(errors))))


def _log_errors(values: np.ndarray, counted: np.ndarray, lags: Sequence[int]) -> np.ndarray:
    """Covariance (lags, lags) of the errors of the logarithms of the variances of second differences of rows (n, k).

    It is that of a mean of independent runs, beside the least that independent values have.
    """
    each = np.array([[second_variance(row[None], samples[None], lag) for lag in lags]
                     for row, samples in zip(values, counted, strict=True)])
    each = np.log(each[(each > 0).all(axis=1)])
    least = np.eye(len(lags)) * _SECOND_ERROR / max(counted.sum(), 1)
    return np.asarray(least + np.cov(each.T) / len(each)) if len(each) > 1 else least


@dataclass(frozen=True, eq=False)
class Carried:
    """What the noise of an input adds to second differences: `variances` (c, o, lags) at the `correlations` (c,).

    At each, the noise is that which the input `shows` by its own differences.
    """

    shows: Differences
    correlations: np.ndarray
    variances: np.ndarray

    def at(self, correlation: float) -> np.ndarray:
        """Return the variances (o, lags) at a correlation."""
        place, logs = np.arctanh(correlation), np.log(np.maximum(self.variances, _NONE))
        low = int(np.clip(np.searchsorted(grid := np.arctanh(self.correlations), place) - 1, 0, len(grid) - 2))
        share = (place - grid[low]) / (grid[low + 1] - grid[low])
        return np.asarray(np.exp((1 - share) * logs[low] + share * logs[low + 1]))


def estimate_residual_noise(left: SecondDifferences, sensors: Sequence[Noise],
                            inputs: Sequence[tuple[Noise, Carried]] = ()) -> tuple[list[Noise], list[Noise]]:
    """Return the noise of o sensors, and of inputs, by the second differences that a fit leaves of the signals.

    With the correlation of one of the `inputs`, its noise has the third differences of its signal: what it adds is then
    known, and its power at low frequencies differs widely. A sensor of which too few samples count keeps its noise.
    """
    observed, lags = left.observed, left.lags
    shown = np.flatnonzero((observed > 0).all(axis=1)).tolist()
    if not shown:
        return list(sensors), [noise for noise, _ in inputs]
    most, middle = float(np.arctanh(HIGHEST)), [np.arctanh(float(np.clip(each.correlation, -_BEGIN, _BEGIN)))
                                                for each in (*(sensors[place] for place in shown),
                                                             *(noise for noise, _ in inputs))]
    least = np.log(_LEAST * np.sqrt(observed[shown, 0] / filter_variance(second_taps(1), -1.0)))
    size = 0.5 * np.log([observed[place, 0] / filter_variance(second_taps(1), float(np.tanh(each)))
                         for place, each in zip(shown, middle, strict=False)])

    def log_ratios(values: np.ndarray) -> np.ndarray:
        stds, correlations = np.exp(values[:len(shown)]), np.tanh(values[len(shown):])
        rest = correlations[len(shown):]
        added = left.known[shown] + sum(carried.at(rho)[shown] for rho, (_, carried) in zip(rest, inputs, strict=True))
        own = [[std**2 * filter_variance(second_taps(samples), rho) for samples in lags]
               for std, rho in zip(stds, correlations, strict=False)]
        off = [carried.shows.excess(rho) for rho, (_, carried) in zip(rest, inputs, strict=True)]
        ratios = left.weights[shown] @ np.log((np.array(own) + added) / observed[shown])[:, :, None]
        # Differences of the input itself are known as those of neighbouring samples of a signal.
        return np.concatenate([ratios.ravel(), np.array(off) * left.weights[shown, 0, 0].max()])

    limits = [np.arctanh(carried.correlations[[0, -1]]) for _, carried in inputs]
    bounds = (np.concatenate([least, np.full(len(shown), -most), [low for low, _ in limits]]),
              np.concatenate([np.full(len(shown), np.inf), np.full(len(shown), most), [high for _, high in limits]]))
    begin = np.clip(np.concatenate([size, middle]), *bounds)
    estimate = scipy.optimize.least_squares(log_ratios, begin, bounds=bounds).x
    correlations, noise = np.tanh(estimate[len(shown):]), list(sensors)
    for number, place in enumerate(shown):
        noise[place] = Noise(float(np.exp(estimate[number])), float(correlations[number]))
    return noise, [carried.shows.noise(float(rho)) for rho, (_, carried) in zip(correlations[len(shown):], inputs,
                                                                                 strict=True)]


def estimate_loudness(left: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return the standard deviation (n,) of the noise in each row (n, k) over that in all, by second differences.

    Estimates are drawn to 1 by their sampling error, so that equal noise remains equal (empirical Bayes).
    """
    counts = np.maximum(counted.sum(axis=1), 3)
    own = np.array([second_variance(row[None], samples[None], 1) for row, samples in zip(left, counted, strict=True)])
    typical = float(np.median(own[own > 0])) if (own > 0).any() else 1.0
    ratio = np.log(np.maximum(own, 1e-300) / typical)
    ratio = np.where(own > 0, ratio, 0.0)
    error = _SECOND_ERROR / counts
    between = max(0.0, float(np.median((ratio - np.median(ratio)) ** 2) / 0.455 - np.median(error)))
    return np.asarray(np.exp(0.5 * ratio * between / (between + error)))


def draw_noise(noise: Noise, shape: tuple[int, int], random: np.random.Generator) -> np.ndarray:
    """Return noise (n, k)."""
    fresh = random.standard_normal(shape)
    fresh[:, 1:] *= np.sqrt(1 - noise.correlation**2)
    return np.asarray(noise.std * scipy.signal.lfilter([1], [1, -noise.correlation], fresh, axis=1))


def second_variance(values: np.ndarray, counted: np.ndarray, samples: int) -> float:
    """Variance of second differences over `samples`, 0 where there are none."""
    ends, middle = slice(2 * samples, None), slice(samples, -samples)
    every = counted[:, ends] & counted[:, middle] & counted[:, :-2 * samples]
    if not every.any():
        return 0.0
    return robust_std((values[:, ends] - 2 * values[:, middle] + values[:, :-2 * samples])[every]) ** 2


def second_taps(samples: int) -> np.ndarray:
    """Filter of second differences over `samples`."""
    taps = np.zeros(2 * samples + 1)
    taps[[0, samples, -1]] = 1.0, -2.0, 1.0
    return taps


def robust_std(values: np.ndarray) -> float:
    """Standard deviation of normal values from the smallest ones."""
    squares = values.ravel() ** 2
    kept = int(_KEPT * len(squares))
    return float(np.sqrt(np.partition(squares, kept)[:kept].mean() / _KEPT_VARIANCE))


def filter_variance(taps: np.ndarray, rho: float) -> float:
    """Variance of an autoregressive process of variance 1 after a filter."""
    lags = np.abs(np.subtract.outer(np.arange(len(taps)), np.arange(len(taps))))
    return float(taps @ np.power(rho, lags) @ taps)
