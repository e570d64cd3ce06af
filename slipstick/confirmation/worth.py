"""What a finding is worth: how much it changes the shifting times and signals under the recorded conditions."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.starts import shared_of


@dataclass(frozen=True)
class Worth:
    """What a finding changes under the recorded conditions."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    shifting_time: float
    """Root-mean-square change of the shifting time in ms."""
    largest: float
    """Change of largest magnitude of a shifting time in ms, with its sign."""
    signals: dict[str, float]
    """Root-mean-square change of each measured signal, in standard deviations of its noise."""


def worth(fit: SimulationFit, term: str) -> Worth:
    """The difference that the `term` (an effect or a measured law) makes in a fitted simulation."""
    block, scene = fit.block, fit.block.scene
    rest = block.terms.only([name for name in block.terms.names if name != term])
    other = SimulatedBench(block.traces, rest)
    points = np.tile(fit.fitted.mean, (len(scene), 1))
    there = block.respond(points, fit.fitted.shared)
    gone = other.respond(points, shared_of(block, fit.fitted.shared, other))
    change = 1e3 * (there.shifting_time - gone.shifting_time)
    change = change[np.isfinite(change)] if np.isfinite(change).any() else np.zeros(1)
    squares = {name: np.nanmean((getattr(there, name) - getattr(gone, name)) ** 2) for name in block.traces.signals}
    signals = {name: float(np.sqrt(square) / scene.noise[name][0]) for name, square in squares.items()}
    return Worth(float(np.sqrt((change**2).mean())), float(change[np.abs(change).argmax()]), signals)
