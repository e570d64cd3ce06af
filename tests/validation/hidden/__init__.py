"""An independent simulated test bench that generates recordings with hidden effects (README.md)."""

from .case import EFFECTS, LAWS, Case, generate, simulate
from .catalogue import PHYSICAL, UNLISTED
from .files import write
from .sensors import SENSORS
from .signature import remaining
from .truths import truth, write_truth
from .unseen import UNSEEN
from .world import INGREDIENTS, World, draw

__all__ = ["EFFECTS", "INGREDIENTS", "LAWS", "PHYSICAL", "SENSORS", "UNLISTED", "UNSEEN", "Case", "World", "draw",
           "generate", "remaining", "simulate", "truth", "write", "write_truth"]
