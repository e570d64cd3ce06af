"""How often a name is right: the share of right ones among findings with evidence of the same kind.

`benchmarks.naming` counts them on lists of recordings with hidden effects whose forms the development has not used
(confidence.json).
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from slipstick.naming.answer import names
from slipstick.naming.block import Pair
from slipstick.naming.selection import Finding

FILE = Path(__file__).with_name("confidence.json")
Kind = Literal["a rival is near", "a weaker one of several findings", "the strongest finding, in the closing piston",
               "the strongest finding"]
BY_LIST: dict[str, dict[Kind, list[int]]] = json.loads(FILE.read_text())
"""List of recordings -> kind of evidence -> how many names were right, and of how many."""
_CLOSING = ("piston gain", "piston rate", "clearance", "film torque")
"""Quantities that act only until the plates are in full contact, where each can nearly replace another one."""


def kind_of(pair: Pair, rivals: Iterable[Pair], is_strongest: bool) -> Kind:
    """The kind of evidence for a finding with `rivals` that gains more than all others, or not.

    What the law of a strong finding leaves may show as a weaker finding, but not the reverse. A rival counts if it is
    another effect, or has no name.
    """
    if not all(set(names(pair)) & set(names(rival)) for rival in rivals):
        return "a rival is near"
    if not is_strongest:
        return "a weaker one of several findings"
    return "the strongest finding, in the closing piston" if pair[0] in _CLOSING else "the strongest finding"


def share(kind: Kind) -> float:
    """The share of right names with this kind of evidence, by Laplace's rule of succession."""
    right, of = counts(kind)
    return (right + 1) / (of + 2)


def counts(kind: Kind) -> tuple[int, int]:
    """How many names with this kind of evidence were right, and of how many."""
    return sum(one[kind][0] for one in BY_LIST.values()), sum(one[kind][1] for one in BY_LIST.values())


def confidence(finding: Finding, findings: Sequence[Finding]) -> tuple[float, str]:
    """The share of right names with the kind of evidence of one of the `findings`, and the kind in words."""
    is_strongest = finding.nats >= max(one.nats for one in findings)
    kind = kind_of(finding.pair, [rival.pair for rival in finding.rivals], is_strongest)
    right, of = counts(kind)
    return share(kind), f"{kind}: {right} of {of}"
