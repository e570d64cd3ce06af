"""The parameters of each engagement that the blocks have found, by the names of the bench."""

from collections.abc import Mapping

import numpy as np

from slipstick.bench.converter import Converter
from slipstick.naming.fit import BlockFit
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.valve import ValveBlock

_KICKS = ("lock_up", "breakaway", "start")
"""Parameters of blocks that stand for what happens between two samples."""
CLOCKS = {"valve": "pressure", "clutch": "output_torque", "load": "output_speed", "input": "input_speed"}
"""Block -> signal whose clock it finds."""


def parameters_of(fits: Mapping[str, BlockFit]) -> dict[str, np.ndarray]:
    """Parameter or condition -> (n,) relative to nominal; errors of a level of a condition are those of each run."""
    parameters: dict[str, np.ndarray] = {}
    for fit in fits.values():
        block = fit.block
        if isinstance(block, ValveBlock | ClutchBlock | LoadBlock | InputBlock):
            own = {name: values for name, values in zip(block.random, fit.points.T, strict=True) if name not in _KICKS}
            errors = block.level_errors(fit.shared) if isinstance(block, LoadBlock | InputBlock) else {}
            parameters |= {name: values + errors.get(name, 0.0) for name, values in own.items()}
    if "load_inertia" in parameters:
        parameters["load_inertia"] = 1 / (1 + parameters["load_inertia"]) - 1  # the block has that of the inverse
    return parameters


def clocks_of(fits: Mapping[str, BlockFit]) -> dict[str, float]:
    """Signal -> delay of its clock in s; the speeds are integrated from the torque, whose delay they share."""
    clocks = {signal: float(fits[block].shared[0]) for block, signal in CLOCKS.items() if block in fits}
    for signal in ("output_speed", "input_speed"):
        if signal in clocks:
            clocks[signal] += clocks.get("output_torque", 0.0)
    return clocks


def converter_of(fits: Mapping[str, BlockFit], given: Converter) -> Converter:
    """The converter with the errors of its curve that the input block has found; `given` where it is closed."""
    fit = fits.get("input")
    return fit.block.converter(fit.shared) if fit and isinstance(fit.block, InputBlock) else given
