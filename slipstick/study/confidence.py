"""How often a name is right: the share of right ones among findings with evidence of the same kind.

`benchmarks.naming` counts them on recordings of hidden effects whose forms the development has not seen
(confidence.json).
"""

import json
from pathlib import Path

from slipstick.naming.selection import Finding

FILE = Path(__file__).with_name("confidence.json")
COUNTS: dict[str, list[int]] = json.loads(FILE.read_text())
"""Kind of evidence -> how many names were right, and of how many."""
_LARGE = 8.0
"""Standard errors from which evidence is large: twice the least that names anything."""


def kind_of(has_rivals: bool, errors: float) -> str:
    """The kind of evidence for a finding that has rivals or not, and gains so many standard errors."""
    if has_rivals:
        return "rivals near"
    return "alone, large" if errors >= _LARGE else "alone, small"


def confidence(finding: Finding) -> tuple[float, str]:
    """The share of right names with this kind of evidence, by Laplace's rule of succession, and the kind in words."""
    kind = kind_of(bool(finding.rivals), finding.errors)
    right, of = COUNTS[kind]
    return (right + 1) / (of + 2), f"{kind}: {right} of {of}"
