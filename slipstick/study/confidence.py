"""How likely a name is right: a logistic regression on how certain a finding is and how many findings there are.

It is fitted to names that were given to lists of recordings with hidden effects, whose forms the development has not
used (confidence.json, written by `benchmarks.naming`). Of the benches that the development has used, more names are
right; what is stated is for a bench that it has not.
"""

import json
from functools import cache
from pathlib import Path

import numpy as np
import scipy

from slipstick.study.result import CountedNames

FILE = Path(__file__).with_name("confidence.json")
ON_NEW_BENCHES = ("beyond", "abroad", "afield")
"""Lists on benches that were drawn at random after the method had been developed on others."""
BANDS = np.array([0.0, 0.4, 0.6, 0.8, 0.9, 1.0])
"""Bounds of the ranges of confidence in which right names are counted."""
_STEPS = 20
"""Newton's steps: the likelihood is concave, and converges to the last digit in fewer."""


@cache
def names() -> dict[str, np.ndarray]:
    """The names of each list (n, 3): number of findings of a case, standard errors of this one, whether it is right."""
    return {which: np.array(rows, float).reshape(-1, 3) for which, rows in json.loads(FILE.read_text()).items()}


def confidence(findings: float | np.ndarray, errors: float | np.ndarray, without: str = "") -> np.ndarray:
    """The expected share of right names among those at these standard `errors`, each one of so many `findings`.

    It is that of a bench that the development has not used, and follows from all lists but `without`, whose names are
    predicted.
    """
    return np.asarray(scipy.special.expit(_evidence(findings, errors) @ _coefficients(without)[:-1]))


@cache
def _coefficients(without: str) -> np.ndarray:
    """Maximum-likelihood coefficients (4,) of the evidence and of a bench in use, fitted to all lists but one."""
    lists = {which: its for which, its in names().items() if which != without}
    rows = np.concatenate(list(lists.values()))
    in_use = np.concatenate([np.full(len(its), float(which not in ON_NEW_BENCHES)) for which, its in lists.items()])
    evidence, at = np.column_stack([_evidence(rows[:, 0], rows[:, 1]), in_use]), np.zeros(4)
    for _ in range(_STEPS):
        expected = scipy.special.expit(evidence @ at)
        information = (evidence.T * (expected * (1 - expected))) @ evidence
        at = at + np.linalg.solve(information, evidence.T @ (rows[:, 2] - expected))
    return at


def _evidence(findings: float | np.ndarray, errors: float | np.ndarray) -> np.ndarray:
    """What the logarithm of the odds is linear in (..., 3).

    One cause that no law describes often shows as several findings, and what the law of one finding leaves shows as
    another. Whether a rival is near, a block is unexplained or the finding is the strongest adds nothing to this: names
    of a list are predicted no better from the other lists.
    """
    return np.stack(np.broadcast_arrays(1.0, np.log(errors), np.subtract(findings, 1.0)), -1)


def counted(its: float) -> CountedNames:
    """How many names with a confidence in the same band as `its` were right, on benches new to the development.

    Each is predicted from the other lists.
    """
    band, new = int(_band(its)), {which: rows for which, rows in names().items() if which in ON_NEW_BENCHES}
    right = np.concatenate([rows[_band(confidence(rows[:, 0], rows[:, 1], which)) == band, 2]
                            for which, rows in new.items()])
    return CountedNames(float(BANDS[band]), float(BANDS[band + 1]), int(right.sum()), len(right))


def _band(confidences: float | np.ndarray) -> np.ndarray:
    return np.asarray(np.searchsorted(BANDS[1:-1], confidences, side="right"))
