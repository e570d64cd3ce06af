"""An effect: the law by which one quantity of the bench changes in dependence on another one."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

Law = Callable[[float, np.ndarray], np.ndarray]
Response = Callable[[np.ndarray, float, float], np.ndarray]


@dataclass(frozen=True)
class Effect:
    """`law(amplitude, abscissa)` multiplies `quantity` if `kind` is "ratio" and is added to it if it is "difference".

    `law(0, x)` is neutral. `pair` says in words which quantity depends on what, and `block` in which part of the model.
    If `quantity` is a lag or a compliance, which is zero in the bench without effects, the law gives its value. The
    `response` of a sensor maps its signals (n, k), the period in s and a delay in s, which is the amplitude, to its
    readings (n, k). A valve with plays has those of the widths `plays`, relative to the amplitude in A, with weights.
    `form` and `trend` describe the law in words.
    """

    pair: tuple[str, str]
    block: Literal["pressure", "torque", "output speed", "input speed"]
    quantity: str
    abscissa: str
    kind: Literal["ratio", "difference"]
    law: Law
    form: str = ""
    trend: str = ""
    response: Response | None = None
    plays: tuple[np.ndarray, np.ndarray, float] | None = None


@dataclass(frozen=True)
class Acting:
    """An `effect` of an `amplitude`, in the runs (n,) in which it `acts`."""

    effect: Effect
    amplitude: float
    acts: np.ndarray
