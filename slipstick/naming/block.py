"""stub until merged"""
from typing import Any, Sequence
import numpy as np
Pair = tuple[str, str]
Laws = Sequence[tuple[Pair, np.ndarray]]
Block = Any
