"""Whether an answer is right: the pairs of the findings beside those of the hidden effects."""

from dataclasses import dataclass

from .answer import Answer, NamedPair, Pair, block_of
from .generator.machines.pairs import PAIRS, accept_pairs
from .generator.truth import HiddenEffect, Truth

SURE = 0.9
"""Confidence from which a name is called sure."""
_EQUAL = {"brake torque": "load torque", "contact pressure": "friction coefficient"}
"""Quantities that are compared as another one.

The brake is a part of the load, and the friction torque is the product of contact pressure and friction coefficient,
which nothing else depends on.
"""
_AIR = {("piston rate", "pressure"), ("piston gain", "pressure"), ("clearance", "pressure")}
"""Pairs that are one effect, air in the oil, by several names."""
_CHANGING_LAG = {"friction lag": "friction coefficient", "converter lag": "converter torque"}
"""Quantities that are lags, and what has the lag."""
_DRIFTS = {"sequence": "run order", "time": "time"}
"""What the offset of a sensor may also be called to depend on, by its abscissa."""


@dataclass(frozen=True)
class Verdict:
    """An answer beside the truth of its case.

    `right_first`: the finding that gains most is right. `effects_named` is the number of hidden effects in the answer,
    by name or in a tie, `too_many` that of findings which are none of them. `wrong_and_sure`: such a finding has a
    confidence of `SURE` or more. `sure`: a right finding has it. `right_block`: something is said of a part of the
    machine where an effect acts. `named_unknown`: a finding has the name of a catalogued effect where none is hidden.
    `silent`: nothing is said to be missing.
    """

    right_first: bool
    effects_named: int
    too_many: int
    wrong_and_sure: bool
    sure: bool
    right_block: bool
    named_unknown: bool
    silent: bool


def judge(answer: Answer, truth: Truth) -> Verdict:
    """Return the verdict on an answer."""
    accepted = [accept(hidden) for hidden in truth.hidden]
    right = [finding for finding in answer.findings if is_right(finding, truth)]
    wrong = [finding for finding in answer.findings if not is_right(finding, truth)]
    first = max(answer.findings, key=lambda finding: finding.nats, default=None)
    explained = {compare_as(pair) for pair in answer.explanations[:1]}
    named = [{compare_as(pair) for pair in (finding.pair, *finding.rivals)} for finding in answer.findings]
    blocks = {block_of(hidden.pair) for hidden in truth.hidden}
    return Verdict(
        first is not None and any(compare_as(first.pair) in pairs for pairs in accepted),
        sum(any(pairs & said for said in [*named, explained]) for pairs in accepted), len(wrong),
        any(finding.confidence >= SURE for finding in wrong), any(finding.confidence >= SURE for finding in right),
        bool(blocks & {*(block_of(finding.pair) for finding in answer.findings),
                       *map(_merge_contact, answer.unexplained)}),
        any(finding.effect for finding in answer.findings) and not any(hidden.is_known for hidden in truth.hidden),
        answer.is_silent)


def is_right(finding: NamedPair, truth: Truth) -> bool:
    """Return whether a finding or one of its rivals is a hidden effect."""
    said = {compare_as(pair) for pair in (finding.pair, *finding.rivals)}
    return any(said & accept(hidden) for hidden in truth.hidden)


def accept(hidden: HiddenEffect) -> set[Pair]:
    """Return the pairs that name a hidden effect, as `compare_as` gives them.

    The offset of a sensor that drifts over the run order, or in an engagement, is both an offset and an error over it.
    """
    quantity, on = hidden.pair
    for machine, pairs in PAIRS.items():
        if hidden.pair in pairs:
            return accept_pairs(machine, hidden.pair)
    drifts = on == "offset" and _DRIFTS.get(hidden.abscissa)
    return {compare_as(hidden.pair), *([(quantity, drifts)] if drifts else [])}


def compare_as(pair: Pair) -> Pair:
    """Return the pair under which another one is compared: for a lag that changes, that of a constant one."""
    quantity, on = pair
    if quantity in _CHANGING_LAG:
        quantity, on = _CHANGING_LAG[quantity], "lag"
    pair = _EQUAL.get(quantity, quantity), on
    return ("clearance", "pressure") if pair in _AIR else pair


def _merge_contact(block: str) -> str:
    """Return the part of the machine of a block; full contact is one of the clutch."""
    return "clutch" if block in ("contact", "onset") else block
