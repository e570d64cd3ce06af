"""How often a name is right: the share of right ones among findings with evidence of the same kind.

`benchmarks.naming` counts them on recordings of hidden effects (confidence.json), on one half of the forms; the other
half is the test (`benchmarks/naming_confidence.csv`).
"""

import json
from pathlib import Path

from slipstick.naming.selection import Finding

COUNTS: dict[str, list[int]] = json.loads(Path(__file__).with_name("confidence.json").read_text())
"""Kind of evidence -> how many names were right, and of how many."""
_LARGE = 8.0
"""Standard errors from which evidence is large: twice the least that names anything."""


def evidence(finding: Finding) -> str:
    """The kind of evidence for a finding."""
    if finding.rivals:
        return "rivals near"
    return "alone, large" if finding.errors >= _LARGE else "alone, small"


def confidence(finding: Finding) -> tuple[float, str]:
    """The share of right names with this kind of evidence, by Laplace's rule of succession, and the kind in words."""
    kind = evidence(finding)
    right, of = COUNTS[kind]
    return (right + 1) / (of + 2), f"{kind}: {right} of {of}"
