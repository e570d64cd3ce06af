"""The likelihood of any model by integration along lines, with an error that holds.

The density of condition i, given its measured time, lies about its most likely normals m_i. A linear model has

    m_i = g_i (t_i - y_i(m) + g_i m) / (s^2 + |g_i|^2),   g_i = dy_i / du at u = m,

from any m, such as 0. Where that is far from 0, the formula is repeated at the m_i that it gives, as in the first-order
reliability method (Rackwitz and Fiessler 1978). The lines run along the direction in which the times change most, from
the smallest to the largest m_i with a margin. Across it, for three or more inputs, they are drawn from the mean q of
the unit normal densities about all m_i, and weighted by phi / q (importance sampling with a mixture, Owen and Zhou
2000), so that no measured time is out of reach.

`REPLICATES` independent scramblings of a Sobol sequence give independent results. Their jackknife removes the bias of
the logarithm, and gives the standard error of the sum over the conditions, in which errors of conditions may cancel or
add up. The same lines integrate the linear model, whose density is known; the known error of that integral, times the
slope of the regression of one error on the other, is subtracted (a control variate).

For two inputs the rule across the lines is equidistant, and its error follows from every second and every fourth line.
The error of the linear interpolation between breakpoints falls with the square of their distance for a smooth model:
every second breakpoint gives it, and it is subtracted (Richardson). The same with every second and every fourth
breakpoint gives another result, and the difference is the error that is stated: it covers kinks of a model as well.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from slipstick.uncertainty.likelihood import lines
from slipstick.uncertainty.likelihood.lines import Lines

REPLICATES = 8
"""Independent results from which the error is estimated."""
_STUDENT = 2.3646  # 97.5 % quantile of Student's distribution with REPLICATES - 1 degrees of freedom
_MARGIN = 5.5  # of the lines and of the equidistant rule beyond the most likely normals, in stds
_WIDEST = 30.0  # largest margin that is tried
_NEGLIGIBLE = 1e-4  # decades that the outer half of the margin may contribute
_REPEATS, _NEAR, _DIFFERENCE = 6, 2.0, 0.1  # of the search for the most likely normals; the last two in stds
_FURTHEST = 60.0  # largest expected distance from the mean, in stds
_STEP, _ONLY_STEP, _LINES = 0.5, 0.125, 64
"""Distance of the breakpoints in stds, and for a single input, with this number of lines; with more it falls with the
square root of their number."""
_LN10 = math.log(10.0)


class LikelihoodEstimate(NamedTuple):
    """log10 p (n,) per ms, and the half width of the 95 % interval of their sum in decades; infinite if unknown."""

    density: np.ndarray
    error: float


@dataclass(frozen=True, eq=False)
class Target:
    """What is integrated: times (m, n) in s of a model at the normals u (m, d), measured times (n,), noise in s.

    `centre` (n,) are the times at u = 0, and `slopes` (d, n) their derivatives with respect to u.
    """

    times_at: Callable[[np.ndarray], np.ndarray]
    centre: np.ndarray
    slopes: np.ndarray
    measured: np.ndarray
    noise: float

    def most_likely(self) -> np.ndarray:
        """The most likely normals (d, n), given the measured times."""
        expected = expected_normals(self.measured - self.centre, self.slopes, self.noise)
        for _ in range(_REPEATS):
            far = np.flatnonzero(np.sum(expected**2, axis=0) > _NEAR**2)
            if not len(far):
                break
            at, step = expected[:, far].T, _DIFFERENCE * np.eye(len(expected))
            times = self._own_times(at, far)
            slopes = np.array([(self._own_times(at + move, far) - self._own_times(at - move, far))
                               / (2 * _DIFFERENCE) for move in step])
            moved = expected_normals(self.measured[far] - times + np.sum(slopes * at.T, axis=0), slopes, self.noise)
            # Half of the way: the full step may jump to and fro between both sides of a bend.
            expected[:, far] = np.where(np.isfinite(moved), 0.5 * (expected[:, far] + moved), expected[:, far])
        return expected

    def _own_times(self, normals: np.ndarray, conditions: np.ndarray) -> np.ndarray:
        """Time (k,) of each of some `conditions` (k,) at normals (k, d) of its own."""
        return np.asarray(self.times_at(normals)[np.arange(len(conditions)), conditions])


def expected_normals(residual: np.ndarray, slopes: np.ndarray, noise: float) -> np.ndarray:
    """The normals (d, n) that a linear model with `slopes` (d, n) expects for a residual (n,) from its value at 0."""
    expected = np.nan_to_num(slopes * residual / (noise**2 + np.sum(slopes**2, axis=0)))
    distance = np.sqrt(np.sum(expected**2, axis=0))
    return np.asarray(expected * np.minimum(1.0, _FURTHEST / np.maximum(distance, 1e-300)))


def integrate(target: Target, count: int, seed: int) -> LikelihoodEstimate:
    """The likelihood with `count` lines, a power of two from `REPLICATES` on."""
    rotation = _rotation(target.slopes)
    expected = rotation.T @ target.most_likely()
    step = (_STEP if len(rotation) > 1 else _ONLY_STEP) * math.sqrt(_LINES / count)
    margin = _MARGIN
    while True:
        low, high = float(expected[0].min()) - margin, float(expected[0].max()) + margin
        along = np.linspace(low, high, 4 * math.ceil((high - low) / (4 * step)) + 1)
        estimate, reached = _integrate_along(target, rotation, along, expected[1:], step, count, seed)
        if reached or margin > _WIDEST:
            return estimate if reached else LikelihoodEstimate(estimate.density, math.inf)
        margin *= 1.5


def _integrate_along(target: Target, rotation: np.ndarray, along: np.ndarray, expected: np.ndarray, step: float,
                     count: int, seed: int) -> tuple[LikelihoodEstimate, bool]:
    """The likelihood by lines with the breakpoints `along` (g,), and whether these reach all of the densities."""
    if len(rotation) == 1:
        by_step = _densities(target, Lines(np.array([along]), np.zeros((1, 0)), np.zeros(1), rotation))
        correction, remaining = _extrapolation(by_step)
        return LikelihoodEstimate(by_step[0] + correction, remaining), _is_reached(by_step)
    if len(rotation) == 2:
        return _integrate_equidistant(target, rotation, along, expected, step)
    rules = [_draw_lines(along, rotation, expected.T, count // REPLICATES, seed + 1000 * replicate)
             for replicate in range(REPLICATES)]
    by_step = np.array([_densities(target, rule) for rule in rules])  # (replicates, steps, n)
    known, control = _linear_control(target, rules)
    density, error = _jackknife(by_step[:, 0], control, known)
    correction, remaining = _extrapolation(_mean(by_step))
    return LikelihoodEstimate(density + correction, _STUDENT * error + remaining), _is_reached(_mean(by_step))


def _integrate_equidistant(target: Target, rotation: np.ndarray, along: np.ndarray, expected: np.ndarray,
                           step: float) -> tuple[LikelihoodEstimate, bool]:
    """Two inputs; `expected` (1, n) are the most likely normals across the lines."""
    low, high = float(expected.min()) - _MARGIN, float(expected.max()) + _MARGIN
    across = np.linspace(low, high, 4 * math.ceil((high - low) / (4 * step)) + 1)
    log_weight = -0.5 * across**2 - 0.5 * math.log(2 * math.pi) + math.log(across[1] - across[0])
    by_rule = []
    for every in (4, 2, 1):
        places = across[::every]
        by_rule.append(_densities(target, Lines(np.tile(along, (len(places), 1)), places[:, None],
                                                log_weight[::every] + math.log(every), rotation)))
    first, second = (abs(float(_change(before[0], after[0]).sum())) for before, after in pairwise(by_rule))
    correction, remaining = _extrapolation(by_rule[-1])
    # For a smooth density, the error of the rule falls with each halving by a larger factor than with the one before.
    across_error = second * min(1.0, second / first) if first else second
    return LikelihoodEstimate(by_rule[-1][0] + correction, across_error + remaining), _is_reached(by_rule[-1])


def _densities(target: Target, rule: Lines) -> np.ndarray:
    """log10 p (4, n) with all breakpoints, with every second and every fourth one, and without the ends of the lines.
    """
    times = target.times_at(rule.scores).reshape(*rule.breakpoints.shape, -1)
    ends = int(_MARGIN / 2 / (rule.breakpoints[0, 1] - rule.breakpoints[0, 0]))
    parts = [slice(None), slice(None, None, 2), slice(None, None, 4), slice(ends, -ends)]
    return np.array([lines.log10_density(Lines(rule.breakpoints[:, part], rule.across, rule.log_weight, rule.factor),
                                         times[:, part].reshape(-1, times.shape[2]), target.measured, target.noise)
                     for part in parts])


def _is_reached(by_part: np.ndarray) -> bool:
    """Whether the ends of the lines contribute nothing to any condition, so that more beyond them will not either."""
    return not np.any(_change(by_part[3], by_part[0]) > _NEGLIGIBLE)


def _extrapolation(by_step: np.ndarray) -> tuple[np.ndarray, float]:
    """The correction (n,) of log10 p from the smallest step to 0, and what remains; `by_step` has a row for each step.
    """
    correction, before = (_change(coarse, fine) / 3 for fine, coarse in pairwise(by_step[:3]))
    difference = _change(by_step[1] + before, by_step[0] + correction)
    return correction, abs(float(difference.sum()))


def _draw_lines(along: np.ndarray, rotation: np.ndarray, expected: np.ndarray, count: int, seed: int) -> Lines:
    """Lines through points drawn about the expected normals (n, d - 1), weighted by phi / q."""
    places, normals = _sobol(len(rotation), count, seed)
    across = expected[(places * len(expected)).astype(int)] + normals
    squares = np.sum((across[:, None] - expected) ** 2, axis=2)
    log_ratio = -0.5 * np.sum(across**2, axis=1) + math.log(len(expected)) - scipy.special.logsumexp(
        -0.5 * squares, axis=1)
    return Lines(np.tile(along, (count, 1)), across, log_ratio - math.log(count), rotation)


@lru_cache(maxsize=64)
def _sobol(dimension: int, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (count,) from 0 to 1 in the mixture, and standard normals (count, dimension - 1)."""
    uniform = scipy.stats.qmc.Sobol(dimension, rng=seed).random(count)
    return uniform[:, 0], scipy.special.ndtri(np.clip(uniform[:, 1:], 1e-12, 1 - 1e-12))


def _linear_control(target: Target, rules: list[Lines]) -> tuple[np.ndarray, np.ndarray]:
    """log10 p (n,) of the linear model, and its integrals (r, n) by the rules."""
    def log10_normal(residual: np.ndarray, variance: np.ndarray) -> np.ndarray:
        return np.asarray((-0.5 * residual**2 / variance - 0.5 * np.log(2 * np.pi * variance)) / _LN10 - 3.0)

    residual, variance = target.measured - target.centre, target.noise**2 + np.sum(target.slopes**2, axis=0)
    along, across = rules[0].factor[:, 0] @ target.slopes, rules[0].factor[:, 1:].T @ target.slopes
    integrals = [scipy.special.logsumexp(
        _LN10 * log10_normal(residual - rule.across @ across, target.noise**2 + along**2) + rule.log_weight[:, None],
        axis=0) / _LN10 for rule in rules]
    return log10_normal(residual, variance), np.array(integrals)


def _jackknife(densities: np.ndarray, control: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """log10 p (n,) from replicates (r, n) of densities and of the control, and the standard error of their sum."""
    centred = control - control.mean(axis=0)
    spread = float(np.sum(centred**2))
    with np.errstate(invalid="ignore"):
        product = float(np.nansum(centred * (densities - densities.mean(axis=0))))
    slope = min(max(product / spread, 0.0), 1.0) if spread else 0.0

    def corrected(kept: np.ndarray) -> np.ndarray:
        return np.asarray(_mean(densities[kept]) - slope * (_mean(control[kept]) - known))

    count = len(densities)
    with np.errstate(invalid="ignore"):  # -inf minus -inf, where the density is 0
        pseudo = np.array([count * corrected(np.ones(count, bool)) - (count - 1) * corrected(np.arange(count) != left)
                           for left in range(count)])
        density = np.where(np.any(np.isfinite(densities), axis=0), pseudo.mean(axis=0), -np.inf)
        error = float(np.std(pseudo.sum(axis=1), ddof=1)) / math.sqrt(count)
    return density, error if math.isfinite(error) else math.inf


def _mean(densities: np.ndarray) -> np.ndarray:
    """log10 of the mean of 10^densities over the first axis."""
    with np.errstate(divide="ignore"):
        return np.asarray((scipy.special.logsumexp(_LN10 * densities, axis=0) - math.log(len(densities))) / _LN10)


def _change(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Changes (n,); that of a density of 0 which remains 0 is 0."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(after == before, 0.0, after - before))


def _rotation(slopes: np.ndarray) -> np.ndarray:
    """An orthogonal matrix whose first column is the direction in which the times change most."""
    vectors = np.linalg.eigh(slopes @ slopes.T)[1][:, ::-1]
    return np.ascontiguousarray(vectors * np.where(vectors[np.argmax(np.abs(vectors), axis=0),
                                                           np.arange(len(vectors))] < 0, -1.0, 1.0))
