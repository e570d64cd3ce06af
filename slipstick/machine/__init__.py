"""What a machine is, declared once: blocks, parameters, quantities, sensors; and the runs that were recorded of it."""

from slipstick.machine.declaration import (
    Block,
    Command,
    Condition,
    Curve,
    Effect,
    Machine,
    Output,
    Parameter,
    Quantity,
    Sensor,
)
from slipstick.machine.description import (
    BlockDescription,
    EffectDescription,
    MachineDescription,
    SignalRange,
    channels_of,
    describe_machine,
)
from slipstick.machine.experiments import (
    Experiments,
    evaluate_output,
    has_experiments,
    list_experiments,
    select_profiles,
)
from slipstick.machine.kinds import Kind
from slipstick.machine.opening import open_machine
from slipstick.machine.runs import Profile, Runs
from slipstick.machine.runs_file import holds_runs, read_runs, require_runs, units_of, write_runs

__all__ = ["Block", "BlockDescription", "Command", "Condition", "Curve", "Effect", "EffectDescription", "Experiments",
           "Kind", "Machine", "MachineDescription", "Output", "Parameter", "Profile", "Quantity", "Runs", "Sensor",
           "SignalRange", "channels_of", "describe_machine", "evaluate_output", "has_experiments", "holds_runs",
           "list_experiments", "open_machine", "read_runs", "require_runs", "select_profiles", "units_of", "write_runs"]
