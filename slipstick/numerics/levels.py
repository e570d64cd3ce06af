"""Levels at which a condition of the runs is stated, and which may be off each by its own error."""

import numpy as np

_FEW = 4
"""Runs that a stated level needs on average, to have an error of its own."""


def has_levels(values: np.ndarray) -> bool:
    """Whether a condition (n,) is stated in levels, each with runs enough to have an error of its own."""
    return len(np.unique(values)) <= len(values) / _FEW


def list_levels(values: np.ndarray, order: np.ndarray | None = None) -> list[np.ndarray]:
    """Return indicators (n,) of stated levels, or of all runs where levels have few; with an `order` also a drift."""
    own = [(values == level).astype(float) for level in np.unique(values)] if has_levels(values) else [
        np.ones(len(values))]
    if order is not None and np.ptp(order) > 0:
        own.append((order - order.mean()) / np.ptp(order))
    return own
