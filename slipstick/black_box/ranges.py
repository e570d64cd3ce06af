"""What the signals of a machine reach in its own experiments, within a time limit."""

from slipstick.black_box.function import limit_time
from slipstick.engine.simulation import compile_kernels, find_ranges
from slipstick.machine import Machine, SignalRange

_SECONDS = 5.0
"""Longest simulation: a worker tells of its machines before it takes jobs."""


def simulate_ranges(machine: Machine) -> tuple[SignalRange, ...]:
    """Return the range of each signal of a machine in its own experiments, to which recordings are compared.

    There is none where it declares no experiments, or where these fail or take more than seconds.
    """
    compile_kernels()
    try:
        with limit_time(_SECONDS):
            return find_ranges(machine)
    except Exception:  # of any kind: the equations are those of a file, which need not say how the machine is run
        return ()
