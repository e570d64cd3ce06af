"""Confirmation: the simulation of the whole bench with what blocks have named, fitted to all signals at once."""

from slipstick.confirmation.fit import SimulationFit, confirmed, fit_simulation
from slipstick.confirmation.terms import Terms
from slipstick.confirmation.traces import Traces

__all__ = ["SimulationFit", "Terms", "Traces", "confirmed", "fit_simulation"]
