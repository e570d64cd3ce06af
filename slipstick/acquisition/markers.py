"""Instants that a channel marks: the shift command, the triggers of many engagements in one file, lock-up."""

import numpy as np

from slipstick.acquisition.mapping import Marker


def instants(marker: Marker, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Times in s at which `values` (k,) of a channel cross the level of the marker, or change.

    A crossing is interpolated between the two samples. In a channel of two values, and where the value changes, the
    instant is the first sample of the new value: a digital channel does not say where between two samples it switched.
    Missing samples are skipped.
    """
    known = np.isfinite(values)
    time, values = time[known], values[known]
    if marker.level is None:
        return np.asarray(time[1:][np.diff(values) != 0])
    beyond = values > marker.level if marker.rising else values < marker.level
    before = np.flatnonzero(~beyond[:-1] & beyond[1:])
    if len(np.unique(values)) == 2:
        return np.asarray(time[before + 1])
    share = (marker.level - values[before]) / (values[before + 1] - values[before])
    return np.asarray(time[before] + share * (time[before + 1] - time[before]))
