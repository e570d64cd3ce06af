"""Gaps, spikes and saturation of a channel: found and reported, and never filled or repaired."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from slipstick.acquisition.clock import GAP, sampling_step

Kind = Literal["gap", "spike", "saturation"]

_SPIKE_WIDTH = 5
"""Samples of the running median: a spike of up to two leaves it, and a step does not."""
_SPIKE_ERRORS, _SPIKE_SHARE = 10.0, 0.05
"""A spike leaves the running median by more robust standard deviations than Gaussian noise ever does. It exceeds a
share of the range of the channel as well, or a signal without noise would have spikes at each of its corners."""
_BESIDE = (2, 3)
"""Distances in samples of the neighbours whose range a spike exceeds as well: the peak of a smooth rise does not."""
_PLATEAU = 5
"""Equal samples at an extreme value that make a plateau."""
_STEEP = 3.0
"""Resolutions by which a signal enters or leaves a plateau that is clipped: one at rest leaves it by one."""


@dataclass(frozen=True)
class Flaw:
    """A gap, spike or saturation from `start` to `end` in s, of one channel."""

    kind: Kind
    start: float
    end: float


def flaws(time: np.ndarray, values: np.ndarray, limits: tuple[float, float] | None = None,
          gap: float | None = None) -> tuple[Flaw, ...]:
    """The flaws of `values` (k,) at `time` (k,) s, which reach the `limits` of the sensor where they saturate.

    A missing value (NaN) is a gap, and so is a step of more than `gap` s (default: 1.5 usual ones). Without limits,
    saturation is a plateau at the largest magnitude that the signal enters or leaves by more than its resolution.
    """
    known = np.isfinite(values)
    if known.sum() < _SPIKE_WIDTH:
        return (Flaw("gap", float(time[0]), float(time[-1])),)
    whole = np.concatenate([time[:1], time[known], time[-1:]])
    missing = np.flatnonzero(np.diff(whole) > (gap or GAP * sampling_step(time)))
    entries = [Flaw("gap", float(whole[place]), float(whole[place + 1])) for place in missing]
    time, values = time[known], values[known]
    entries += [Flaw("spike", float(time[place]), float(time[place])) for place in _spikes(values)]
    entries += [Flaw("saturation", float(time[first]), float(time[last])) for first, last in _plateaus(values, limits)]
    return tuple(entries)


def _spikes(values: np.ndarray) -> np.ndarray:
    away = np.abs(values - scipy.ndimage.median_filter(values, _SPIKE_WIDTH, mode="nearest"))
    spread = float(np.median(away[away > 0])) / 0.6745 if np.any(away > 0) else 0.0
    padded = np.pad(values, _BESIDE[-1], mode="edge")
    beside = np.array([np.roll(padded, shift) for side in _BESIDE for shift in (-side, side)])
    nearby = np.ptp(beside, axis=0)[_BESIDE[-1]:-_BESIDE[-1]]
    least = np.maximum(_SPIKE_ERRORS * spread, _SPIKE_SHARE * float(np.ptp(values)))
    return np.flatnonzero(away > np.maximum(least, nearby))


def _plateaus(values: np.ndarray, limits: tuple[float, float] | None) -> list[tuple[int, int]]:
    """First and last sample of each plateau at a limit, or at the largest magnitude."""
    steps = np.abs(np.diff(values))
    resolution = float(steps[steps > 0].min()) if np.any(steps > 0) else 0.0
    at = np.abs(values) == np.abs(values).max() if limits is None else (values <= limits[0]) | (values >= limits[1])
    edges = np.diff(np.concatenate([[0], at.astype(np.int8), [0]]))
    runs = zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1, strict=True)
    plateaus = []
    for first, last in runs:
        sides = [steps[place] for place in (first - 1, last) if 0 <= place < len(steps)]
        if last - first + 1 >= _PLATEAU and (limits is not None or max(sides, default=0.0) > _STEEP * resolution > 0):
            plateaus.append((int(first), int(last)))
    return plateaus
