"""Numbers of recorded signals: means with an irregular clock, what follows on a reversal, and delays."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import scipy

from slipstick.machine import Runs


def average(time: np.ndarray, values: np.ndarray, begins: np.ndarray, length: float) -> np.ndarray:
    """Return means (m, columns) over a `length` of time from `begins` (m,) on, of values (k, columns) at times (k,).

    They are those of lines between the samples, so that an irregular clock has no weight.
    """
    integral = scipy.integrate.cumulative_trapezoid(values, time, axis=0, initial=0)
    return np.array([np.interp(begins + length, time, column) - np.interp(begins, time, column)
                     for column in integral.T]).T / length


def cut(time: np.ndarray, begins: np.ndarray, length: float, samples: int, longest: float) -> Iterator[slice]:
    """Yield the rows of so many means each, over a `length` from `begins` on, without those of pauses of the recording.

    In these, more than the `longest` time is between two of the times (k,).
    """
    pauses = np.flatnonzero(np.diff(time) > longest)
    for first in range(0, len(begins) - samples + 1, samples):
        end = begins[first + samples - 1] + length
        if not ((time[pauses + 1] > begins[first]) & (time[pauses] < end)).any():
            yield slice(first, first + samples)


def find_reversals(position: np.ndarray, half: int, samples: int) -> Iterator[int]:
    """Yield where runs of so many samples begin: where a position (k,) is furthest out in half of a period.

    The first tenth is left out.
    """
    begin = len(position) // 10
    while begin + half + samples <= len(position):
        begin += int(np.argmax(np.abs(position[begin:begin + half])))
        if begin + samples <= len(position):
            yield begin
        begin += samples


def follow_reversals(position: np.ndarray, force: np.ndarray, counted: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """Return a force (strokes, m) in the direction of the motion, over the travel (m,) since a reversal.

    Position and force are (n, k); strokes that are longer than the travel count, of samples that are `counted` (n, k).
    """
    strokes = list[np.ndarray]()
    for place, against, counts in zip(position, force, counted, strict=True):
        turns = 1 + np.flatnonzero((np.diff(np.sign(np.diff(place))) != 0) & (counts[1:-1] > 0))
        for begin, end in pairwise(turns):
            path = place[begin:end] - place[begin]
            if np.abs(path[-1]) > travel[-1]:
                strokes.append(np.interp(travel, np.abs(path), against[begin:end] * np.sign(path[-1])))
    return np.array(strokes).reshape(-1, len(travel))


def average_strokes(runs: Runs, force: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """Return means (tests, m) of a force over the travel since reversals, as a share of the second half of the travel.

    Runs have the signal "displacement", and the channels "test" and "counted".
    """
    tests = [runs.channels["test"] == test for test in np.unique(runs.channels["test"])]
    strokes = [follow_reversals(runs.signals["displacement"][rows], force[rows], runs.channels["counted"][rows], travel)
               for rows in tests]
    return np.array([each.mean(axis=0) / each[:, len(travel) // 2:].mean() for each in strokes if len(each)])


def find_delay(signal: np.ndarray, other: np.ndarray, furthest: int) -> float:
    """Return by how many samples the `other` signal (n, k) is behind, up to the `furthest`, by correlation."""
    samples, inner = np.arange(signal.shape[1]), slice(furthest, -furthest)

    def differ(delay: float) -> float:
        late = np.array([np.interp(samples - delay, samples, row) for row in signal])
        return -float(np.corrcoef(late[:, inner].ravel(), other[:, inner].ravel())[0, 1])

    return float(scipy.optimize.minimize_scalar(differ, bounds=(-furthest, furthest)).x)
