"""Channels of different clocks on one, with an anti-alias filter.

A value of the new clock is that of a straight line, fitted with weights of a Hann window to the samples within one step
of the new clock on either side. The window halves amplitudes at half the new rate. It is zero at the new rate, whose
surroundings would alias to the slowest frequencies, and more than 31 dB down from there on. No weight is negative, so
that the jump of the torque at lock-up does not ring: it reaches one sample to either side. At equal rates the line is
linear interpolation, and a sample that lies on the new clock stays as it is.
"""

import numpy as np

FILTER = ("a straight line fitted with a Hann window of one new step to either side: -6 dB at half the new rate, "
          "zero at the new rate")
_ALONE = 1e-6
"""Spread of the samples in steps below which a line cannot be fitted: there is one sample, and the others have no
weight."""
GAP = 1.5
"""Steps between two samples from which one is missing."""
JITTER = 1.02
"""Ratio of sampling steps below which two clocks are the same: quartzes agree far better, but times are rounded."""


def sampling_step(time: np.ndarray) -> float:
    """The usual step in s of sample times (k,)."""
    return float(np.median(np.diff(time)))


def resampled(time: np.ndarray, values: np.ndarray, wanted: np.ndarray, step: float) -> np.ndarray:
    """`values` (k,) at the increasing times `time` (k,), at the times `wanted` (m,) of a clock of `step` s.

    A channel that is slower than the new clock is interpolated linearly. NaN where no sample is within reach.
    """
    steps = np.diff(time)
    # As far as the samples of an uneven clock lie apart, but not over gaps.
    reach = max(step, float(steps[steps < GAP * sampling_step(time)].max()))
    first = np.searchsorted(time, wanted - reach, "left")
    last = np.searchsorted(time, wanted + reach, "right")
    sums = np.zeros((5, len(wanted)))
    for number in range(int((last - first).max(initial=0))):
        place = first + number
        inside = place < last
        place = np.minimum(place, len(time) - 1)
        offset = (time[place] - wanted) / reach
        weight = np.where(inside, np.cos(0.5 * np.pi * np.clip(offset, -1, 1)) ** 2, 0.0)
        value = values[place]
        sums += weight * np.array([np.ones_like(offset), offset, offset**2, value, value * offset])
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_offset, mean, mixed = sums[1] / sums[0], sums[3] / sums[0], sums[4] / sums[0]
        spread = sums[2] / sums[0] - mean_offset**2
        slope = np.where(spread > _ALONE**2, (mixed - mean_offset * mean) / spread, 0.0)
    return np.asarray(mean - slope * mean_offset)
