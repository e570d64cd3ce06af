"""How often a name is right: the share of right ones among findings with evidence of the same kind.

`benchmarks.naming` counts them on lists of recordings with hidden effects whose forms the development has not used
(confidence.json).
"""

import json
from pathlib import Path
from typing import Literal

from slipstick.naming.selection import Finding

FILE = Path(__file__).with_name("confidence.json")
Kind = Literal["a rival is near", "one of several findings", "the only finding, in the closing piston",
               "the only finding"]
BY_LIST: dict[str, dict[Kind, list[int]]] = json.loads(FILE.read_text())
"""List of recordings -> kind of evidence -> how many names were right, and of how many."""
_CLOSING = ("piston gain", "piston rate", "clearance", "film torque")
"""Quantities that act only until the plates are in full contact, where each can nearly replace another one."""


def kind_of(quantity: str, has_rivals: bool, is_single: bool) -> Kind:
    """The kind of evidence for a finding that has rivals or not, and is all that the blocks say or not.

    One cause that is not among the tested pairs often shows as several findings, or leaves a block unexplained.
    """
    if has_rivals:
        return "a rival is near"
    if not is_single:
        return "one of several findings"
    return "the only finding, in the closing piston" if quantity in _CLOSING else "the only finding"


def share(kind: Kind) -> float:
    """The share of right names with this kind of evidence, by Laplace's rule of succession."""
    right, of = counts(kind)
    return (right + 1) / (of + 2)


def counts(kind: Kind) -> tuple[int, int]:
    """How many names with this kind of evidence were right, and of how many."""
    return sum(one[kind][0] for one in BY_LIST.values()), sum(one[kind][1] for one in BY_LIST.values())


def confidence(finding: Finding, is_single: bool) -> tuple[float, str]:
    """The share of right names with the kind of evidence of a finding, and the kind in words."""
    kind = kind_of(finding.pair[0], bool(finding.rivals), is_single)
    right, of = counts(kind)
    return share(kind), f"{kind}: {right} of {of}"
