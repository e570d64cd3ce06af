"""How likely a finding is right: a logistic regression on how far it leads, and on what else is found.

It is fitted to findings in recordings of simulated benches with hidden effects, whose numbers were drawn at random. A
row of confidence.csv is a finding: `group` numbers the sets of benches, of which one is left out where its own findings
are predicted; `lead`, `alone`, `further`, `share` and `rare` are those of `Evidence`; `right` is 1 where the pair of
the finding, or one that is not told from it, is that of a hidden effect.
"""

import csv
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from slipstick.naming.selection import Finding, is_further
from slipstick.studies.result import CountedFindings

FILE = Path(__file__).with_name("confidence.csv")
BANDS = np.array([0.0, 0.4, 0.6, 0.8, 0.9, 1.0])
"""Bounds of the ranges of confidence in which right findings are counted."""
LEAST = 0.5
"""Confidence above which a finding is reported beside the one that gains most: it is more likely right than wrong."""
_SEPARATE = {"valve", "lock"}
"""Blocks in which nothing shows that is left of findings in other ones."""
_CLEAR_LEAD = 5.0
"""Standard errors above which a lead adds nothing: what is wrong is a cause that no pair describes, at any lead."""
_STEPS = 20
"""Newton's steps: the likelihood is concave, and converges to the last digit in fewer."""
_NONE = 0
"""Number of no group."""


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
    blocks = set(finding.blocks)
    return finding.nats / sum(other.nats for other in findings if not blocks <= _SEPARATE or blocks & set(other.blocks))


def confidence(evidence: Evidence, without: int = _NONE) -> float:
    """The expected share of right findings among those with this evidence.

    It follows from all groups but the one numbered `without`, whose findings are predicted.
    """
    return float(_expected_shares([evidence], without)[0])


def are_reported(evidences: Sequence[Evidence], nats: Sequence[float]) -> list[bool]:
    """Which of all findings of a case, which gain these `nats`, are reported: the largest, and others that are likely.

    That something is missing is certain where anything was found. A smaller finding says that there is another cause,
    where the law of the first may only not follow its own one. A rare pair beside a usual one is not reported: it
    follows the residual of that one.
    """
    are_all_rare = all(evidence.rare for evidence in evidences)
    possible = {place for place, evidence in enumerate(evidences) if are_all_rare or not evidence.rare}
    most = max((nats[place] for place in possible), default=0.0)
    return [place in possible and (nats[place] == most or confidence(evidence) > LEAST)
            for place, evidence in enumerate(evidences)]


def count_right(value: float) -> CountedFindings:
    """How many findings in the same band of confidence as `value` were right, each predicted from the other groups."""
    band = int(_band(value))
    right = np.concatenate([[is_right for evidence, is_right in rows if _band(confidence(evidence, group)) == band]
                            for group, rows in read_findings().items()])
    return CountedFindings(float(BANDS[band]), float(BANDS[band + 1]), int(right.sum()), len(right))


@cache
def read_findings() -> dict[int, list[tuple[Evidence, bool]]]:
    """The findings of each group: their evidence, and whether they are right."""
    groups: dict[int, list[tuple[Evidence, bool]]] = {}
    with FILE.open() as file:
        for row in csv.DictReader(file):
            alone, further, rare, right = (row[name] == "1" for name in ("alone", "further", "rare", "right"))
            evidence = Evidence(float(row["lead"]), alone, further, float(row["share"]), rare)
            groups.setdefault(int(row["group"]), []).append((evidence, right))
    return groups


def _expected_shares(evidences: Iterable[Evidence], without: int) -> np.ndarray:
    rows = np.array([evidence.row for evidence in evidences])
    return np.asarray(scipy.special.expit(rows @ coefficients(without)))


@cache
def coefficients(without: int = _NONE) -> np.ndarray:
    """Maximum-likelihood coefficients (6,) of the evidence, fitted to all groups but one."""
    findings = [finding for group, rows in read_findings().items() if group != without for finding in rows]
    rows, right = np.array([evidence.row for evidence, _ in findings]), np.array([hit for _, hit in findings], float)
    estimate = np.zeros(rows.shape[1])
    for _ in range(_STEPS):
        expected = scipy.special.expit(rows @ estimate)
        information = (rows.T * (expected * (1 - expected))) @ rows
        estimate = estimate + np.linalg.solve(information, rows.T @ (right - expected))
    return estimate


def _band(confidences: float | np.ndarray) -> np.ndarray:
    return np.asarray(np.searchsorted(BANDS[1:-1], confidences, side="right"))
