"""What a bench file does when it is simulated, and what about its numbers is implausible."""

from slipstick.plausibility.behaviour import Behaviour
from slipstick.plausibility.finding import Finding
from slipstick.plausibility.inspection import Inspection, inspect

__all__ = ["Behaviour", "Finding", "Inspection", "inspect"]
