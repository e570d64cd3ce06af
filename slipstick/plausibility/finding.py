"""One implausible thing about a bench."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

_LISTED = 5  # conditions or profiles named in a sentence


@dataclass(frozen=True)
class Finding:
    """What is implausible about the quantity at the dotted `key` of a bench file, `why` it matters, and the `remedy`.

    `conditions` are those whose engagements it explains. What else is unusual about these follows from it, and is not a
    finding of its own.
    """

    key: str
    what: str
    why: str
    remedy: str
    conditions: tuple[int, ...] = ()

    @classmethod
    def of(cls, key: str, affected: np.ndarray, what: str, why: str, remedy: str) -> list["Finding"]:
        """The finding about the conditions where `affected` (n,) is true; none where it is true nowhere."""
        rows = tuple(int(row) for row in np.flatnonzero(affected))
        return [cls(key, what, why, remedy, rows)] if rows else []


def mask_explained(findings: Iterable[Finding], n: int) -> np.ndarray:
    """Which of n conditions the findings explain: (n,)."""
    mask = np.zeros(n, bool)
    for finding in findings:
        mask[list(finding.conditions)] = True
    return mask


def list_numbers(what: str, numbers: np.ndarray) -> str:
    """Some numbers in words, such as "conditions 0, 1, 2 and 40 more"."""
    shown = ", ".join(str(number) for number in numbers[:_LISTED])
    rest = f" and {len(numbers) - _LISTED} more" if len(numbers) > _LISTED else ""
    return f"{what}{'' if len(numbers) == 1 else 's'} {shown}{rest}"
