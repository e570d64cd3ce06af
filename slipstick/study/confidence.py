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
Kind = Literal["a rival is near", "a weaker one of several findings", "the strongest of several findings",
               "the only finding"]
"""From the counts of the other lists, these predict which names of a list are right better (log score) than kinds with
the closing piston apart, or with the strongest of several among the only ones."""
BY_LIST: dict[str, dict[Kind, list[int]]] = json.loads(FILE.read_text())
"""List of recordings -> kind of evidence -> how many names were right, and of how many."""


def kind_of(pair: Pair, rivals: Iterable[Pair], is_strongest: bool, is_all: bool) -> Kind:
    """The kind of evidence for a finding with `rivals` that gains more than all others, and is all there is, or not.

    What the law of a strong finding leaves may show as a weaker finding, but not the reverse. One cause that no law
    describes often shows as several findings, or leaves a block unexplained. A rival counts if it is another effect, or
    has no name.
    """
    if not all(set(names(pair)) & set(names(rival)) for rival in rivals):
        return "a rival is near"
    if is_all:
        return "the only finding"
    return "the strongest of several findings" if is_strongest else "a weaker one of several findings"


def share(kind: Kind) -> float:
    """The share of right names with this kind of evidence, by Laplace's rule of succession."""
    right, of = counts(kind)
    return (right + 1) / (of + 2)


def counts(kind: Kind) -> tuple[int, int]:
    """How many names with this kind of evidence were right, and of how many."""
    return sum(one[kind][0] for one in BY_LIST.values()), sum(one[kind][1] for one in BY_LIST.values())


def confidence(finding: Finding, findings: Sequence[Finding], unexplained: Sequence[str]) -> tuple[float, str]:
    """The share of right names with the kind of evidence of one of the `findings`, and the kind in words.

    Blocks are `unexplained` in which something is missing beside the findings.
    """
    is_strongest = finding.nats >= max(one.nats for one in findings)
    kind = kind_of(finding.pair, [rival.pair for rival in finding.rivals], is_strongest,
                   len(findings) == 1 and not unexplained)
    right, of = counts(kind)
    return share(kind), f"{kind}: {right} of {of}"
