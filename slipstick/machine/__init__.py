"""What a machine is, declared once: blocks, parameters, quantities, sensors; and the runs that were recorded of it."""

from slipstick.machine.declaration import (
    Block,
    Command,
    Condition,
    Curve,
    Machine,
    Parameter,
    Quantity,
    Sensor,
)
from slipstick.machine.runs import Profile, Runs

__all__ = ["Block", "Command", "Condition", "Curve", "Machine", "Parameter", "Profile", "Quantity", "Runs", "Sensor"]
