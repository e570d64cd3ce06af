"""Any other machine: its inputs, conditions and output as a file describes them, its simulator, and measurements of it.

A simulator is a Python callable, an FMU, an UM-Bridge model or a declared machine. Its tables, likelihoods and fits are
those of the clutch.
"""

from slipstick.black_box.cases import Cases
from slipstick.black_box.description import BlackBoxDescription, Input, Quantity
from slipstick.black_box.function import Function
from slipstick.black_box.measurements import Measurements
from slipstick.black_box.reader import BlackBox, is_black_box
from slipstick.black_box.recorded import measure_runs
from slipstick.black_box.simulation import Simulation, Workers

__all__ = ["BlackBox", "BlackBoxDescription", "Cases", "Function", "Input", "Measurements", "Quantity", "Simulation",
           "Workers", "is_black_box", "measure_runs"]
