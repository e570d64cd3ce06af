"""Fits of uncertain inputs to recordings (section III.B): search, refinement, and profile-likelihood intervals."""

from slipstick.uncertainty.fit.fit import (
    Estimate,
    SearchState,
    final_state,
    has_all_intervals,
    initial_state,
    is_finished,
    next_state,
    progress,
    refined_estimate,
    summary,
    unfinished,
    with_next_interval,
)
from slipstick.uncertainty.fit.settings import FitSettings

__all__ = ["Estimate", "FitSettings", "SearchState", "final_state", "has_all_intervals", "initial_state", "is_finished",
           "next_state", "progress", "refined_estimate", "summary", "unfinished", "with_next_interval"]
