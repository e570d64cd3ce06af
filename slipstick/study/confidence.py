"""How often a name is right: the share of right ones among studies of hidden effects with evidence of the same kind.

`benchmarks.study_blind` measured them, and writes confidence.json; `benchmarks/study_confidence.csv` has the counts,
with intervals and in two halves. A name counts as right where the hidden effect is it, or is tied with it.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from slipstick.study.ranking import Ranked

KINDS = ("clear", "a rival near", "something left over")
SHARES: dict[str, float] = json.loads(Path(__file__).with_name("confidence.json").read_text())
"""Kind of evidence -> share of right names."""
_NEAR = 3.0
"""Standard errors within which an effect that is not tied with the first is still a rival."""


def evidence(ranking: Sequence[Ranked], group: Sequence[str], refuted: Sequence[str], over: bool) -> str:
    """The kind of evidence for the first of the effects named.

    `group` are those tied with it, `refuted` what was begun with in vain or added later. `over`: something is left.
    """
    if over:
        return "something left over"
    rivals = [one for one in ranking if one.effect not in (*group, *refuted) and not one.at_bound]
    return "a rival near" if any(one.behind < _NEAR for one in rivals) else "clear"
