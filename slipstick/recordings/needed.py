"""Which signals each block of the model needs to be asked by a study."""

from collections.abc import Collection

from slipstick.recordings.signals import SIGNAL_UNITS

NEEDED = {"valve": {"pressure"}, "contact": set(SIGNAL_UNITS), "clutch": set(SIGNAL_UNITS),
          "load": {"output_torque", "output_speed"}, "input": {"output_torque", "input_speed"},
          "lock": {"output_torque", "output_speed", "input_speed"}}
"""The signals of each block: those at both of its ends, and what its laws need."""


def open_blocks(signals: Collection[str]) -> tuple[str, ...]:
    """The blocks that can be asked where these signals were measured."""
    return tuple(block for block, its in NEEDED.items() if its <= set(signals))
