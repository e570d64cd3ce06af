"""What a hidden effect is: a law for how one quantity of the bench depends on another."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

Law = Callable[[float, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Effect:
    """`quantity` is multiplied by ("ratio"), or added to it is ("difference"), `law(strength, abscissa)`.

    `law(0, x)` is neutral; `strength` has the `unit`, and is plausible and visible at `typical`. `block` is the part
    of the model that the effect acts in. Where `quantity` is a lag, a width or a compliance, which the plain bench
    lacks, the law is its size.
    """

    name: str
    block: Literal["pressure", "torque", "output speed", "input speed"]
    quantity: str
    abscissa: str
    kind: Literal["ratio", "difference"]
    unit: str
    typical: float
    law: Law
