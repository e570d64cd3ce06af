"""A hidden effect: a law for the dependence of one quantity of the bench on another."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

Law = Callable[[float, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Effect:
    """`law(strength, abscissa)` multiplies `quantity` if `kind` is "ratio" and is added to it if it is "difference".

    `law(0, x)` is neutral. `strength` has the unit `unit`; at `typical` it is plausible and its effect visible. `block`
    is the part of the model in which the effect acts. If `quantity` is a lag, width or compliance, which is zero in the
    bench without effects, the law gives its value. `pair` states what pairs.py cannot tell from quantity and abscissa.
    """

    name: str
    block: Literal["pressure", "torque", "output speed", "input speed"]
    quantity: str
    abscissa: str
    kind: Literal["ratio", "difference"]
    unit: str
    typical: float
    law: Law
    pair: tuple[str, str] | None = None
