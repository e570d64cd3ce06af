"""Which laws the recordings of any declared machine ask for: laws, mixed model, evidence and selection."""

from slipstick.engine.measured_law import Law
from slipstick.engine.recordings import Recorded, prepare
from slipstick.engine.selection import Finding, Identification, identify
from slipstick.engine.settings import EngineSettings
from slipstick.engine.simulation import simulate
from slipstick.engine.study import MachineStudy

__all__ = ["EngineSettings", "Finding", "Identification", "Law", "MachineStudy", "Recorded", "identify", "prepare",
           "simulate"]
