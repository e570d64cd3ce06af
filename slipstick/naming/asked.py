"""What naming is doing, for those who wait for it: its steps, the blocks that it asks, and what it tries in them."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Literal

from slipstick.naming.scene import Pair

Step = Literal["engagements", "valve", "onset", "load", "input", "lock", "contact", "laws", "clutch"]
_BLOCK_OF: dict[Step, str] = {"valve": "valve", "onset": "clutch", "load": "load", "input": "input", "lock": "lock",
                              "contact": "contact", "clutch": "clutch"}


@dataclass(frozen=True)
class Asked:
    """A step of naming, and the `blocks` that it asks.

    It `tries` a further pair in them, or `compares` what each pair promises, or else fits them as they are.
    """

    step: Step
    blocks: tuple[str, ...] = ()
    tries: Pair | None = None
    compares: bool = False


Ask = Callable[[Asked], None]


def steps(can: Collection[str]) -> tuple[Step, ...]:
    """The steps in their order where the blocks `can` be asked.

    If engagements are set aside, the blocks are fitted once more without them, and their steps are repeated.
    """
    fitted: tuple[Step, ...] = tuple(step for step, block in _BLOCK_OF.items() if block in can and step != "clutch")
    behind: tuple[Step, ...] = ("laws",) if set(can) - {"valve"} else ()
    return ("engagements", *fitted, *behind, *(("clutch",) if "clutch" in can else ()))
