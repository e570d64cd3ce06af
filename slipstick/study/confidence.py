"""How likely a finding is right: a logistic regression on how far it leads, and on what else is found.

It is fitted to what was found in lists of recordings with hidden effects, on benches that were drawn at random
(confidence.json, written by `benchmarks.naming`).
"""

import json
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from slipstick.naming.selection import Finding, is_further
from slipstick.study.result import CountedFindings

FILE = Path(__file__).with_name("confidence.json")
BANDS = np.array([0.0, 0.4, 0.6, 0.8, 0.9, 1.0])
"""Bounds of the ranges of confidence in which right findings are counted."""
LEAST = 0.5
"""Confidence above which a finding is reported beside the one that gains most: it is more likely right than wrong."""
_SEPARATE = {"valve", "lock"}
"""Blocks in which nothing shows that is left of findings in other ones."""
_CLEAR_LEAD = 5.0
"""Standard errors at the naming limit. Above it, what is wrong is a cause that no pair describes, at any lead."""
_STEPS = 20
"""Newton's steps: the likelihood is concave, and converges to the last digit in fewer."""


class Evidence(NamedTuple):
    """What the confidence of a finding depends on."""

    lead: float
    """Standard errors by which it leads the next best explanation."""
    alone: bool
    """Whether nothing else is found: one cause that no law describes often shows as several findings."""
    further: bool
    """Whether another finding gains more in its part of the bench: what the law of one leaves shows as another one."""
    share: float
    """Its share of the nats of the findings that may leave something in its blocks: that shows as weak findings."""
    rare: bool = False
    """Whether hardly any bench has such a pair: it follows what is left of others, or of what no pair describes."""

    @property
    def row(self) -> list[float]:
        """What the logarithm of the odds is linear in (6,).

        The lead of a finding with a small share says little: what is left of another effect also leads.
        """
        size = min(max(self.lead, 0.0) / _CLEAR_LEAD, 1.0)
        return [1.0, size * self.share, size * self.alone, float(self.further), float(np.log(self.share)),
                float(self.rare)]


def evidence_of(finding: Finding, findings: Sequence[Finding]) -> Evidence:
    """The evidence of one of the `findings` of a case."""
    return Evidence(finding.lead, len(findings) == 1, is_further(finding, findings), share_of(finding, findings),
                    finding.rare)


def share_of(finding: Finding, findings: Sequence[Finding]) -> float:
    """The share of a finding in the nats of those of the `findings` that may leave something in its blocks.

    The valve is between measured current and pressure, and the shafts after lock-up between two measured speeds: only
    findings in the same block can leave something there. The clutch takes pressure and slip from others, and clutch,
    load and input have the torque sensor in common.
    """
    its = set(finding.blocks)
    return finding.nats / sum(one.nats for one in findings if not its <= _SEPARATE or its & set(one.blocks))


def confidence(evidence: Evidence, without: str = "") -> float:
    """The expected share of right findings among those with this evidence.

    It follows from all lists but `without`, whose findings are predicted.
    """
    return float(_expected([evidence], without)[0])


def are_reported(every: Sequence[Evidence], nats: Sequence[float], without: str = "") -> list[bool]:
    """Which of all findings of a case, which gain these `nats`, are reported: the largest, and others that are likely.

    That something is missing is certain where anything was found. A smaller finding says that there is another cause,
    where the law of the first may only not follow its own one. A rare pair beside a usual one follows what is left of
    that: of 38 that were reported in `outlying` to `alpine`, one was right.
    """
    are_all_rare = all(one.rare for one in every)
    possible = {place for place, one in enumerate(every) if are_all_rare or not one.rare}
    most = max((nats[place] for place in possible), default=0.0)
    return [place in possible and (nats[place] == most or confidence(one, without) > LEAST)
            for place, one in enumerate(every)]


def counted(its: float) -> CountedFindings:
    """How many findings in the same band of confidence as `its` were right, each predicted from the other lists."""
    band = int(_band(its))
    right = np.concatenate([[is_right for evidence, is_right in rows if _band(confidence(evidence, which)) == band]
                            for which, rows in found().items()])
    return CountedFindings(float(BANDS[band]), float(BANDS[band + 1]), int(right.sum()), len(right))


@cache
def found() -> dict[str, list[tuple[Evidence, bool]]]:
    """The findings of each list: their evidence, and whether they are right."""
    lists = json.loads(FILE.read_text())
    return {which: [(Evidence(lead, bool(alone), bool(further), share, bool(rare)), bool(is_right))
                    for lead, alone, further, share, rare, is_right in rows]
            for which, rows in lists.items()}


def _expected(evidence: Iterable[Evidence], without: str) -> np.ndarray:
    return np.asarray(scipy.special.expit(np.array([one.row for one in evidence]) @ coefficients(without)))


@cache
def coefficients(without: str) -> np.ndarray:
    """Maximum-likelihood coefficients (6,) of the evidence, fitted to all lists but one."""
    pairs = [pair for which, its in found().items() if which != without for pair in its]
    rows, right = np.array([evidence.row for evidence, _ in pairs]), np.array([its for _, its in pairs], float)
    at = np.zeros(rows.shape[1])
    for _ in range(_STEPS):
        expected = scipy.special.expit(rows @ at)
        information = (rows.T * (expected * (1 - expected))) @ rows
        at = at + np.linalg.solve(information, rows.T @ (right - expected))
    return at


def _band(confidences: float | np.ndarray) -> np.ndarray:
    return np.asarray(np.searchsorted(BANDS[1:-1], confidences, side="right"))
