"""Channels of different clocks on one, with an anti-alias filter.

A value of the new clock is the mean of the samples within half a new step on either side, those at the edges by the
share of their time. The mean is down by 3.9 dB at half the new rate, zero at the new rate, whose surroundings would
alias to the slowest frequencies, and at least 13 dB down from there on. A steeper filter would correlate the noise of
neighbouring values in a way that the noise model of calibration and study, first-order autoregressive, does not state.
No weight is negative, so that the jump of the torque at lock-up does not ring. At equal rates the mean is linear
interpolation, and a sample that lies on the new clock stays as it is.
"""

import numpy as np

FILTER = ("the mean over one new step: -3.9 dB at half the new rate, zero at the new rate, at least 13 dB down from "
          "there on")
GAP = 1.5
"""Steps between two samples from which one is missing."""
JITTER = 1.03
"""Ratio of sampling steps below which two clocks are the same: quartzes agree far better, but times are rounded."""
HELD = "its values are held on a faster clock"
"""What the note on such a channel begins with."""
_COVERED = 0.5
"""Share of a new step that samples must cover for its mean to be a value."""
_LATE = 1.5
"""Samples by which a held value begins early or late: both clocks are rounded to samples."""
_LEAST_HELD = 20
"""Changes that show held values: by chance the next sample would be equal after all of them in one case of 2^20."""


def sampling_step(time: np.ndarray) -> float:
    """The usual step in s of sample times (k,)."""
    return float(np.median(np.diff(time)))


def mean_step(time: np.ndarray, gap: float | None = None) -> float:
    """The mean step in s of sample times (k,) that are rounded; the usual one where both differ.

    Steps of more than `gap` s, by default `GAP` usual ones, are gaps and do not count.
    """
    steps, usual = np.diff(time), sampling_step(time)
    mean = float(steps[steps <= max(gap or 0.0, GAP * usual)].mean())
    return float(f"{mean:.6g}") if max(mean, usual) < JITTER * min(mean, usual) else usual


def own_clock(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """Times and values (k,) of a channel at its own rate, where a file states it at a faster one, and a note on it.

    The file leaves most values of a slower channel out (NaN), or holds each until the next one.
    """
    known = np.isfinite(values)
    if known.sum() > 1 and (own := sampling_step(time[known])) > GAP * sampling_step(time):
        return time[known], values[known], f"most of its values are missing: it is used every {1e3 * own:.4g} ms"
    places = _find_held_starts(values[known])
    if places is None:
        return time, values, ""
    time, values = time[known][places], values[known][places]
    return time, values, (f"{HELD}: the first of each is used, every "
                          f"{1e3 * sampling_step(time):.4g} ms")


def _find_held_starts(values: np.ndarray) -> np.ndarray | None:
    """Places (k,) at which values that are held begin; None for a channel that is sampled at its clock.

    A channel that moves by several of its resolutions, and yet never in two successive samples, is held: if it were
    sampled at its clock, a next sample would be different in at least half of the cases. Steps of a set point are told
    from it by their irregular times.
    """
    steps = np.abs(np.diff(values))
    changes = np.flatnonzero(steps) + 1
    if not len(changes):
        return None
    several = np.count_nonzero(steps[changes - 1] > 1.5 * steps[changes - 1].min())
    lengths = np.diff(changes)
    if several < _LEAST_HELD or lengths.min() < 2:
        return None
    period = float(lengths[lengths < 1.5 * lengths.min()].mean())  # twice the period where two values are equal
    if np.any(np.abs(lengths - period * np.round(lengths / period)) > _LATE):
        return None
    before = changes[0] - np.round(period * np.arange(changes[0] // period, 0, -1)).astype(int)
    runs = [start + np.round(np.arange(max(1, round(length / period))) * length / max(1, round(length / period)))
            for start, length in zip(changes[:-1], lengths, strict=True)]
    after = changes[-1] + np.round(period * np.arange(max(1, (len(values) - changes[-1]) // period)))
    return np.concatenate([before, *runs, after]).astype(int)


def resampled(time: np.ndarray, values: np.ndarray, wanted: np.ndarray, step: float,
              gap: float | None = None) -> np.ndarray:
    """`values` (k,) at the increasing times `time` (k,), at the times `wanted` (m,) of a clock of `step` s.

    A channel that is slower than the new clock is interpolated linearly. NaN where samples are missing, which are more
    than `gap` s apart (default: 1.5 usual steps).
    """
    own = sampling_step(time)
    if own > step * JITTER:
        return np.asarray(np.interp(wanted, time, values, left=np.nan, right=np.nan))
    # Each sample stands for the time up to half of the way to the next one, and over a gap for half of its usual step.
    half = np.where(np.diff(time) < (gap or GAP * own), np.diff(time), own) / 2
    starts = time - np.concatenate([[own / 2], half])
    ends = time + np.concatenate([half, [own / 2]])
    edges = np.ravel(np.column_stack([starts, ends]))
    covered, area = (np.concatenate([[0.0], np.cumsum(np.ravel(np.column_stack([part, np.zeros_like(part)])))[:-1]])
                     for part in (ends - starts, (ends - starts) * (values - values[0])))
    low, high = wanted - step / 2, wanted + step / 2
    width = np.interp(high, edges, covered) - np.interp(low, edges, covered)
    total = np.interp(high, edges, area) - np.interp(low, edges, area)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(width >= _COVERED * step, values[0] + total / width, np.nan))
