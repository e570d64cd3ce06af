"""How likely a name is right: a logistic regression on how certain a finding is, and on what else is found.

It is fitted to names that were given to lists of recordings with hidden effects, on benches that were drawn at random
after the method had been developed on others (confidence.json, written by `benchmarks.naming`).
"""

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import scipy

from slipstick.naming.selection import Finding, is_further
from slipstick.study.result import CountedNames

FILE = Path(__file__).with_name("confidence.json")
BANDS = np.array([0.0, 0.4, 0.6, 0.8, 0.9, 1.0])
"""Bounds of the ranges of confidence in which right names are counted."""
_STEPS = 20
"""Newton's steps: the likelihood is concave, and converges to the last digit in fewer."""


@cache
def names() -> dict[str, np.ndarray]:
    """The names of each list (n, 4): the evidence of `confidence` in three columns, and whether the name is right."""
    return {which: np.array(rows, float).reshape(-1, 4) for which, rows in json.loads(FILE.read_text()).items()}


def confidence(findings: float | np.ndarray, errors: float | np.ndarray, further: float | np.ndarray,
               without: str = "") -> np.ndarray:
    """The expected share of right names among those at these standard `errors`, each one of so many `findings`.

    A `further` finding gains less than another one in its part of the bench. The share follows from all lists but
    `without`, whose names are predicted.
    """
    return np.asarray(scipy.special.expit(_evidence(findings, errors, further) @ _coefficients(without)))


def confidence_of(finding: Finding, findings: Sequence[Finding]) -> float:
    """The confidence of one of the `findings` of a case, if it has a name."""
    return float(confidence(len(findings), finding.errors, is_further(finding, findings)))


@cache
def _coefficients(without: str) -> np.ndarray:
    """Maximum-likelihood coefficients (4,) of the evidence, fitted to all lists but one."""
    rows = np.concatenate([its for which, its in names().items() if which != without])
    evidence, at = _evidence(rows[:, 0], rows[:, 1], rows[:, 2]), np.zeros(4)
    for _ in range(_STEPS):
        expected = scipy.special.expit(evidence @ at)
        information = (evidence.T * (expected * (1 - expected))) @ evidence
        at = at + np.linalg.solve(information, evidence.T @ (rows[:, 3] - expected))
    return at


def _evidence(findings: float | np.ndarray, errors: float | np.ndarray, further: float | np.ndarray) -> np.ndarray:
    """What the logarithm of the odds is linear in (..., 4).

    One cause that no law describes often shows as several findings, and what the law of one finding leaves shows as
    another, further one. Standard errors are at least 1, as a law that few engagements show may have fewer. Whether a
    rival is near or a block is unexplained adds nothing to this.
    """
    return np.stack(np.broadcast_arrays(1.0, np.log(np.maximum(errors, 1.0)), np.subtract(findings, 1.0), further), -1)


def counted(its: float) -> CountedNames:
    """How many names with a confidence in the same band as `its` were right, each predicted from the other lists."""
    band = int(_band(its))
    right = np.concatenate([rows[_band(confidence(rows[:, 0], rows[:, 1], rows[:, 2], which)) == band, 3]
                            for which, rows in names().items()])
    return CountedNames(float(BANDS[band]), float(BANDS[band + 1]), int(right.sum()), len(right))


def _band(confidences: float | np.ndarray) -> np.ndarray:
    return np.asarray(np.searchsorted(BANDS[1:-1], confidences, side="right"))
