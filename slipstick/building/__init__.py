"""Tables are built: runs planned over axes, made chunk by chunk so that a killed build resumes, stored or trained on.

Whatever computes is an `Executor` that the caller gives.
"""

from slipstick.building.axes import axes_of
from slipstick.building.black_box_runs import BlackBoxRuns
from slipstick.building.chunks import build_grid, require_memory
from slipstick.building.compiling import compile_simulator, say_compilation
from slipstick.building.plan import Plan
from slipstick.building.surrogates import train_on_black_box, train_on_clutch

__all__ = ["BlackBoxRuns", "Plan", "axes_of", "build_grid", "compile_simulator", "require_memory", "say_compilation",
           "train_on_black_box", "train_on_clutch"]
