"""The model cut at its measured signals: each block predicts one signal from others, as they were measured.

An error upstream does not reach a block, and no event has to be located, because the inputs of a block are the measured
signals. Every block is a frozen value made from recordings, and `predict` takes one parameter vector per engagement, so
that any parameter may differ from run to run.
"""

from slipstick.blocks.block import Block
from slipstick.blocks.clutch import Clutch
from slipstick.blocks.friction import Friction
from slipstick.blocks.input import Input
from slipstick.blocks.load import Load
from slipstick.blocks.valve import Valve

__all__ = ["Block", "Clutch", "Friction", "Input", "Load", "Valve"]
