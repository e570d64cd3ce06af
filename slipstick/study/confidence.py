"""How often a name is right: the share of right ones among findings with evidence of the same kind.

`benchmarks.naming` counts them on recordings of hidden effects whose forms the development has not seen
(confidence.json).
"""

import json
from pathlib import Path
from typing import Literal

FILE = Path(__file__).with_name("confidence.json")
Kind = Literal["a rival is near", "one of several", "the only finding"]
COUNTS: dict[Kind, list[int]] = json.loads(FILE.read_text())
"""Kind of evidence -> how many names were right, and of how many."""


def kind_of(has_rivals: bool, is_single: bool) -> Kind:
    """The kind of evidence for a finding that has rivals or not, and is all that the blocks say or not.

    One cause that is not among the tested pairs often shows as several findings, or leaves a block unexplained.
    """
    if has_rivals:
        return "a rival is near"
    return "the only finding" if is_single else "one of several"


def confidence(kind: Kind) -> tuple[float, str]:
    """The share of right names with this kind of evidence, by Laplace's rule of succession, and the kind in words."""
    right, of = COUNTS[kind]
    return (right + 1) / (of + 2), f"{kind}: {right} of {of}"
