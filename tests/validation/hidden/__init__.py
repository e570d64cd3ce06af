"""An independent simulated test bench that generates recordings with hidden effects (README.md)."""

from .case import EFFECTS, Case, generate, simulate
from .catalogue import PHYSICAL, UNLISTED
from .files import truth, write, write_truth
from .sensors import SENSORS
from .signature import remaining

__all__ = ["EFFECTS", "PHYSICAL", "SENSORS", "UNLISTED", "Case", "generate", "remaining", "simulate", "truth", "write",
           "write_truth"]
