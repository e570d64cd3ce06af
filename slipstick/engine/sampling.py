"""Which blocks are studied as one, because samples do not show what the signals between them do."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from slipstick.engine.equations import straighten
from slipstick.engine.noise import estimate_sensor_noise
from slipstick.engine.recordings import Part, Recorded, explain, pose_nominal
from slipstick.engine.trajectory import solve
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Block
from slipstick.machine.whole import compose

EXACT = 1.0
"""Nats in all runs by which an approximation may change the likelihood: no decision depends on it."""


def find_hidden(recorded: Recorded, prepare_whole: Callable[[Block], Part]) -> set[str]:
    """Return the names of blocks that read each other's signals, whose samples hide what they do; empty without such.

    The whole machine is simulated at nominal parameters, and each block by itself from samples of a signal that it
    reads. In a chain, the block that gives a signal explains it, with what it does between samples. Blocks with a
    window are left out: they do not explain their signal elsewhere.
    """
    parts = {part.name: part for part in recorded.parts if part.block.window is None}
    givers = {signal: part.name for part in parts.values() for signal in part.signals}
    feeding = {name: {givers[read] for read in part.block.reads if read in givers} for name, part in parts.items()}
    loops = {name: {other for other in _reach(name, feeding) if name in _reach(other, feeding)} - {name}
             for name in parts}
    readers = [(parts[name], read, {name, *loops[name]}) for name in parts if parts[name].block.states
               for read in parts[name].block.reads if givers.get(read) in loops[name]]
    if not readers:
        return set()
    machine = replace(recorded.machine, blocks=tuple(part.block for part in recorded.parts))
    try:
        whole = prepare_whole(compose(machine).blocks[0])
    except InvalidValue:  # an algebraic loop, or states of the same name
        return set()
    simulated = solve(pose_nominal(whole)).outputs
    left = whole.measured - simulated[:, :, ::whole.fine]
    with np.errstate(over="ignore", invalid="ignore"):
        tells = np.mean(left**2, axis=(0, 2)) < whole.measured.var(axis=(0, 2))
    if not tells.all():  # less than the mean does: of an unstable machine, or of quite another one
        return set()
    signals = dict(zip(whole.signals, simulated.transpose(1, 0, 2), strict=True))
    # Coarse samples of a signal look like noise: what a simulation leaves of them does so much less.
    noise = {name: estimate_sensor_noise(name, left[:, place]).std for place, name in enumerate(whole.signals)}
    for reader, name, loop in readers:
        sampled = {**signals, name: straighten(signals[name][:, ::whole.fine])}
        part = explain(recorded.select({reader.name}), sampled).parts[0]
        alone = solve(pose_nominal(part)).outputs[:, :, ::part.fine]
        for place, signal in enumerate(part.signals):
            missed = alone[:, place] - signals[signal][:, ::whole.fine][:, :alone.shape[2]]
            if 0.5 * np.sum((missed / noise[signal]) ** 2) > EXACT:
                return loop
    return set()


def _reach(name: str, feeding: Mapping[str, set[str]]) -> set[str]:
    """Return the blocks from whose signals that of a block is computed, directly or not."""
    reached, left = set[str](), [name]
    while left:
        new = feeding[left.pop()] - reached
        reached |= new
        left += new
    return reached
