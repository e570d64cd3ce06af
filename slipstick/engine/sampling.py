"""Which blocks must be studied together, because samples do not show what a signal between them does."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slipstick.engine.equations import straighten
from slipstick.engine.noise import estimate_sensor_noise
from slipstick.engine.recordings import Part, Recorded, explain, pose_nominal
from slipstick.engine.trajectory import solve
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Block
from slipstick.machine.whole import compose

_HIDDEN = 1.0
"""Mean square, over the variance of noise, that a block may miss of its signal by what its inputs do between samples:
as much as noise."""


def find_hidden(recorded: Recorded, prepare_whole: Callable[[Block], Part]) -> set[str]:
    """Return the names of two blocks between which a signal does more than its samples show, empty without such.

    The whole machine is simulated at nominal parameters, and each block by itself from samples of a signal that it
    reads. Blocks with a window are left out: they do not explain their signal elsewhere.
    """
    givers = {signal: part for part in recorded.parts if part.block.window is None for signal in part.signals}
    readers = [(part, name) for part in recorded.parts if part.block.states and part.block.window is None
               for name in part.block.reads if givers.get(name, part) is not part]
    if not readers:
        return set()
    try:
        machine = replace(recorded.machine, blocks=tuple(part.block for part in recorded.parts))
        whole = prepare_whole(compose(machine).blocks[0])
    except InvalidValue:  # an algebraic loop, or states of the same name
        return set()
    simulated = solve(pose_nominal(whole)).outputs
    if not np.isfinite(simulated).all():
        return set()
    signals = dict(zip(whole.signals, simulated.transpose(1, 0, 2), strict=True))
    # Coarse samples of a signal look like noise: what a simulation leaves of them does so much less.
    left = whole.measured - simulated[:, :, ::whole.fine]
    noise = {name: estimate_sensor_noise(name, left[:, place]).std for place, name in enumerate(whole.signals)}
    for reader, name in readers:
        sampled = {**signals, name: straighten(signals[name][:, ::whole.fine])}
        part = explain(recorded.select({reader.name}), sampled).parts[0]
        alone = solve(pose_nominal(part)).outputs[:, :, ::part.fine]
        for place, signal in enumerate(part.signals):
            missed = alone[:, place] - signals[signal][:, ::whole.fine][:, :alone.shape[2]]
            if np.mean(missed**2) > _HIDDEN * noise[signal] ** 2:
                return {reader.name, givers[name].name}
    return set()
