"""Any other machine: its inputs, conditions and output as a file describes them, its simulator, and measurements of it.

A simulator is a Python callable or an UM-Bridge model. Its tables, likelihoods and fits are those of the clutch.
"""

from slipstick.machine.cases import Cases
from slipstick.machine.function import Function
from slipstick.machine.machine import Input, Machine, Quantity
from slipstick.machine.measurements import Measurements
from slipstick.machine.reader import MachineFile, is_machine_file, open_machine
from slipstick.machine.simulation import Simulation, Workers

__all__ = ["Cases", "Function", "Input", "Machine", "MachineFile", "Measurements", "Quantity", "Simulation", "Workers",
           "is_machine_file", "open_machine"]
