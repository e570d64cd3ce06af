"""Recordings of engagements: shifting times, conditions and signals, from HDF5 or CSV."""

from slipstick.recordings.recordings import Form, Recordings, open_conditions
from slipstick.recordings.signals import FurtherChannel, Signals

__all__ = ["Form", "FurtherChannel", "Recordings", "Signals", "open_conditions"]
