"""Where runs are cut from a recording: at standstills, reversals, markers, or in equal parts."""

import numpy as np
import scipy

from slipstick.acquisition.channel import Source
from slipstick.acquisition.clock import sampling_step
from slipstick.acquisition.excerpt import read_marks
from slipstick.acquisition.mapping import Cut, FileMap, Marker, Parts, Reversals, Standstills
from slipstick.acquisition.tracks import track
from slipstick.errors import BadRecording
from slipstick.numerics.quantities import raised


def cut_runs(cut: Cut, source: Source, mapping: FileMap, begin: float, end: float) -> np.ndarray:
    """Begin and end (n, 2) of runs in s, on the clock of the file, between `begin` and `end`.

    What comes before the first cut and after the last one is in no run, as runs would not be whole there; the last
    marker begins a run all the same. Raises `BadRecording` where there is none.
    """
    if isinstance(cut, Parts):
        # Rounded times may end the last part early.
        marks = begin + cut.length * np.arange(np.floor((end - begin) / cut.length + 1e-6) + 1)
        spans = np.column_stack([marks[:-1], marks[1:]])
        reason = f"it is shorter than {cut.length:g} s"
    elif isinstance(cut, Marker):
        marks = read_marks(source, mapping, cut, "run")
        marks = np.concatenate([[begin] if cut.level is None else [], marks, [end]])
        spans = np.column_stack([marks[:-1], marks[1:]])
        reason = "its markers are where other channels have no samples"
    else:
        channel = track(source, cut.source, mapping.time, None).known()
        if isinstance(cut, Standstills):
            marks = _find_standstills(cut, channel.time, channel.values)
            spans, what = np.column_stack([marks[:-1], marks[1:]]), "standstills"
        else:
            marks, signs = _find_reversals(cut, channel.time, channel.values)
            spans, what = np.column_stack([marks[:-1], marks[1:]]), "reversals"
            spans = spans[signs[:-1] == cut.direction] if cut.direction else spans
        low, high = (channel.values.min(), channel.values.max()) if len(channel.values) else (np.nan, np.nan)
        reason = (f"the channel '{cut.source.channel}' has {len(marks)} {what} by the level {cut.level:g}, and lies "
                  f"between {low:g} and {high:g} {raised(channel.unit)}".rstrip())
    # The middle of a standstill may lie between two samples, and the first one of another channel after it.
    spans = spans[(spans[:, 0] >= begin) & (spans[:, 1] <= end) & (spans[:, 1] > spans[:, 0])]
    if not len(spans):
        raise BadRecording(f"No run can be cut from {source.name}: {reason}",
                           "Correct [runs] in the mapping, whose levels are in the unit of the file, or leave the file "
                           "out")
    return spans


def _find_standstills(cut: Standstills, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The instants (k,) at which runs begin and end: middles or ends of standstills."""
    if len(time) < 2:
        return np.array([])
    if cut.moving:
        step = sampling_step(time)
        even = np.arange(time[0], time[-1] + step / 2, step)
        size = 2 * max(1, round(cut.least / step / 2)) + 1
        values = np.interp(even, time, values)
        moved = (scipy.ndimage.maximum_filter1d(values, size, mode="constant", cval=np.inf)
                 - scipy.ndimage.minimum_filter1d(values, size, mode="constant", cval=-np.inf))
        time, still = even, scipy.ndimage.binary_dilation(moved < cut.level, np.ones(size, bool))
    else:
        still = np.abs(values) < cut.level
    edges = np.diff(np.concatenate([[0], still.astype(np.int8), [0]]))
    first, last = time[edges[:-1] == 1], time[edges[1:] == -1]
    long = last - first >= (0 if cut.moving else cut.least * (1 - 1e-6))
    return np.asarray(last[long] if cut.at_end else (first[long] + last[long]) / 2)


def _find_reversals(cut: Reversals, time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The instants (k,) of reversals, and the direction (k,) after each, 1 or -1."""
    if not cut.of_sign:
        places, signs = _find_turning_points(values, cut.level)
        return time[places], signs
    beyond = np.flatnonzero(np.abs(values) > cut.level)
    sign = np.sign(values[beyond])
    changes = np.flatnonzero(np.diff(sign))
    instants = []
    for last, first, after in zip(beyond[changes], beyond[changes + 1], sign[changes + 1], strict=True):
        between = values[last:first + 1] * after
        place = last + np.flatnonzero((between[:-1] <= 0) & (between[1:] > 0))[-1]
        share = -values[place] / (values[place + 1] - values[place])
        instants.append(time[place] + share * (time[place + 1] - time[place]))
    return np.array(instants), sign[changes + 1]


def _find_turning_points(values: np.ndarray, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (k,) of extremes from which the values go back by more than `level`, and the signs (k,) of these changes.

    What the recording begins with is none: it did not come from anywhere.
    """
    places, signs = [], []
    low = high = 0
    direction, series = 0, values.tolist()
    for place, value in enumerate(series):
        if value > series[high]:
            high = place
        if value < series[low]:
            low = place
        if direction >= 0 and series[high] - value > level:
            places.append(high)
            signs.append(-1)
            direction, low = -1, place
        elif direction <= 0 and value - series[low] > level:
            places.append(low)
            signs.append(1)
            direction, high = 1, place
    return np.array(places[1:], int), np.array(signs[1:], int)
