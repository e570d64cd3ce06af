"""How often a name is right: the share of right ones among studies of hidden effects with evidence of the same kind.

`benchmarks.study_blind` measured them, and writes confidence.json; `benchmarks/study_confidence.csv` has the counts,
with intervals and in two halves. A name counts as right where the hidden effect is it, or is tied with it.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from slipstick.study.ranking import APART, Ranked, rivals

KINDS = ("clear", "a rival near", "something left over")
SHARES: dict[str, float] = json.loads(Path(__file__).with_name("confidence.json").read_text())
"""Kind of evidence -> share of right names."""
_NEAR = 3.0
"""Standard errors within which an effect that is not tied with the first is still a rival."""


def evidence(ranking: Sequence[Ranked], name: str, others: Sequence[str], over: bool) -> str:
    """The kind of evidence for the first effect named, by the ranking of its round.

    `others` were added later. `over`: something is left. What is nearer than a tie is one, or was told apart since.
    """
    if over:
        return "something left over"
    near, tied = (len(rivals(ranking, name, others, within)) for within in (_NEAR, APART))
    return "a rival near" if near > tied else "clear"
