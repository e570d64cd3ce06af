"""Blocks that read each other's signals, as one block in which these are simulated."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import pose_nominal
from slipstick.engine.trajectory import solve
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Block, Machine
from slipstick.machine.runs import Runs
from slipstick.machine.whole import join_blocks


def join_loops(machine: Machine, runs: Runs, values: Mapping[str, float] | None = None) -> Machine:
    """Return the machine with one block in the place of those that read each other's signals, itself without such.

    Blocks stay apart that have a window, as they do not explain their signal elsewhere; that cannot be joined; and
    those that tell less of a signal than its mean, simulated at nominal `values`: such as an unstable machine without
    its controller.
    """
    known = {*runs.signals, *runs.commands, *runs.conditions, *runs.channels}
    recorded = [block for block in machine.blocks if {*block.signals, *block.reads} <= known]
    for loop in _find_loops(recorded):
        try:
            joined = join_blocks(machine, loop)
        except InvalidValue:  # an algebraic loop, or states of the same name
            continue
        names = {block.name for block in joined.blocks}.difference(block.name for block in machine.blocks)
        part = next(part for part in prepare(joined, runs, values, is_free=True).parts if part.name in names)
        with np.errstate(over="ignore", invalid="ignore"):
            left = part.measured - solve(pose_nominal(part)).outputs[:, :, ::part.fine]
            tells = np.mean(left**2, axis=(0, 2)) < part.measured.var(axis=(0, 2))
        if tells.all():
            machine = joined
    return machine


def _find_loops(blocks: Sequence[Block]) -> Iterator[set[str]]:
    """Yield the names of blocks without a window that read each other's signals, directly or not."""
    givers = {signal: block.name for block in blocks if block.window is None for signal in block.signals}
    feeding = {block.name: {givers[name] for name in block.reads if name in givers} for block in blocks
               if block.window is None}
    reached = {name: _reach(name, feeding) for name in feeding}
    loops = {frozenset(other for other in reached[name] if name in reached[other]) for name in feeding}
    yield from (set(loop) for loop in sorted(loops, key=sorted) if len(loop) > 1)


def _reach(name: str, feeding: Mapping[str, set[str]]) -> set[str]:
    """Return the blocks from whose signals that of a block is computed, directly or not."""
    reached, left = set[str](), [name]
    while left:
        new = feeding[left.pop()] - reached
        reached |= new
        left += new
    return reached
