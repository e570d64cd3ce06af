"""Whether the names of hidden effects are right, and how often."""

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.rates import bounds
from slipstick.naming.varying_lag import with_constant_lag
from slipstick.study.confidence import BANDS, Evidence, are_reported, confidence
from tests.validation.hidden.case import LAWS

CLEAR = 0.9
"""Confidence from which on a name is called clear."""
LESS_CLEAR = (0.8, 0.7, 0.6)
"""Other such bounds: how many right names would be clear, and how many wrong ones."""
LAW_WITHIN = 1.5
"""How many times its stated error a measured law may be off at most."""
LIMITS = ((0, 1), (1, 2), (2, 5), (5, np.inf), (1, np.inf))
"""Ranges of strengths in naming limits."""
SAME = {("piston rate", "pressure"): ("clearance", "pressure"), ("piston gain", "pressure"): ("clearance", "pressure")}
"""Pairs that are the same effect of the catalogue: air in the oil."""
EQUAL = {"brake torque": "load torque", "contact pressure": "friction coefficient"}
"""Quantities that are compared as another one: the hidden benches count the brake torque as a load torque, and the
friction torque is the product of contact pressure and friction coefficient, which nothing else depends on."""
BLOCK = {"line pressure": "valve", "valve current": "valve", "valve delay": "valve", "pressure sensor": "valve",
         "load torque": "load", "brake torque": "load", "output speed sensor": "load",
         "input torque": "input", "converter torque": "input", "converter lag": "input",
         "input speed sensor": "input", "stick torque": "lock"}
"""Block of a quantity; all others act in the clutch."""

_DRIFTS = {"sequence": "run order", "time": "time"}
"""What the error of a sensor depends on whose offset has one of these abscissas."""


def same(pair: Iterable[str]) -> tuple[str, ...]:
    """The pair under which it is compared: that of a constant lag for one that changes."""
    quantity, on = pair
    quantity, on = with_constant_lag((quantity, on))
    its = EQUAL.get(quantity, quantity), on
    return SAME.get(its, its)


def right(hidden: dict[str, Any]) -> set[tuple[str, ...]]:
    """The pairs that name a hidden effect, as they are compared.

    The offset of a sensor that drifts over the test sequence, or in an engagement, is both an offset and an error over
    the run order, or over time.
    """
    quantity, on = hidden["pair"]
    drifts = on == "offset" and _DRIFTS.get(LAWS[hidden["name"]].abscissa)
    return {same((quantity, on)), *([(quantity, drifts)] if drifts else [])}


def right_of_any(entry: dict[str, Any]) -> set[tuple[str, ...]]:
    """The pairs that name any of the hidden effects of a case, as they are compared."""
    return set[tuple[str, ...]]().union(*(right(its) for its in entry["hidden"]))


def alike(hidden: dict[str, Any]) -> set[tuple[str, ...]]:
    """All pairs that name a hidden effect."""
    its = right(hidden)
    equal = {(one, on) for quantity, on in its for one in EQUAL if EQUAL[one] == quantity}
    return its | equal | {other for other in SAME if SAME[other] in its}


def judged(entry: dict[str, Any]) -> dict[str, Any]:
    """Whether an answer is right: `found` of the hidden effects, named `alone`, wrong names, and wrong names alone."""
    hidden, every = [right(its) for its in entry["hidden"]], right_of_any(entry)
    named = [(same(its["pair"]), {same(pair) for pair in its["rivals"]}) for its in entry["findings"]]
    return {"found": sum(any(({first} | tied) & pairs for first, tied in named) for pairs in hidden),
            "alone": sum(any(first in pairs and tied <= pairs for first, tied in named) for pairs in hidden),
            "wrong": sum(not ({first} | tied) & every for first, tied in named),
            "wrong_alone": sum(not tied and first not in every for first, tied in named),
            "block": bool({block(pair) for pair in every}
                          & ({block(first) for first, _ in named} | set(entry["unexplained"])))}


def block(pair: tuple[str, ...]) -> str:
    """The block in which the quantity of a pair acts."""
    return BLOCK.get(pair[0], "clutch")


def rate(label: str, values: list[bool]) -> list[object]:
    """A row: how many of how many, the rate, and its 95 % bounds (Clopper and Pearson)."""
    hits, n = sum(values), len(values)
    low, high = bounds(hits, n)
    return [label, hits, n, round(hits / n, 3) if n else "", round(low, 3), round(high, 3)]


def summary(entries: list[dict[str, Any]], which: str) -> list[list[object]]:
    """The rates of the answers to a list, over ranges of strengths in naming limits.

    Findings have the confidence that other lists give them.
    """
    entries = [reported(entry, which) for entry in entries]
    verdicts = [(entry, judged(entry)) for entry in entries]
    nulls = [(e, v) for e, v in verdicts if not e["hidden"]]
    single = [(e, v) for e, v in verdicts if len(e["hidden"]) == 1 and e["hidden"][0]["listed"]]
    outside = [(e, v) for e, v in verdicts if len(e["hidden"]) == 1 and not e["hidden"][0]["listed"]]
    both = [(e, v) for e, v in verdicts if len(e["hidden"]) == 2]
    rows = [rate("nulls called anything", [bool(e["findings"] or e["unexplained"]) for e, _ in nulls])]
    for low, high in LIMITS:
        some = [(e, v) for e, v in single if low <= e["hidden"][0]["named"] < high]
        label = f"listed, {low} to {high} naming limits" if high < np.inf else f"listed, from {low} naming limits"
        rows += [rate(f"{label}: found, alone or in a tie", [v["found"] == 1 for _, v in some]),
                 rate(f"{label}: named alone", [v["alone"] == 1 for _, v in some]),
                 rate(f"{label}: a wrong name, alone", [v["wrong_alone"] > 0 for _, v in some]),
                 rate(f"{label}: one name too many", [v["found"] == 1 and v["wrong"] > 0 for _, v in some])]
    strong = [e for e, _ in single if e["hidden"][0]["named"] >= 1]
    for least, wrong, right_ones in ((CLEAR, "a wrong name called clear", "right names that are clear"),
                                     *((one, f"a wrong name with a confidence of {one:g} or more",
                                        f"right names with a confidence of {one:g} or more") for one in LESS_CLEAR)):
        rows += [rate(f"listed, from 1 naming limits: {wrong}",
                      [any(its["confidence"] >= least and not its["right"] for its in e["findings"]) for e in strong]),
                 rate(f"listed, from 1 naming limits: {right_ones}",
                      [its["confidence"] >= least for e in strong for its in e["findings"] if its["right"]])]
    seen = [(e, v) for e, v in outside if e["hidden"][0]["seen"] >= 1]
    rows += [rate("unlisted, visible: right block", [v["block"] for _, v in seen]),
             rate("unlisted, visible: a wrong pair, alone", [v["wrong_alone"] > 0 for _, v in seen]),
             rate("unlisted, visible: a name of the catalogue",
                  [any(its["effect"] for its in e["findings"]) for e, _ in seen]),
             rate("unlisted, from 1 naming limit: right pair",
                  [v["found"] == 1 for e, v in seen if e["hidden"][0]["named"] >= 1])]
    named = [its for e, _ in single for its in e["findings"] if its["effect"] and same(its["pair"]) in
             right(e["hidden"][0])]
    rows.append(rate("right names, left out of the catalogue: unlisted", [not its["left_out"] for its in named]))
    rows.append(rate("two effects, both from 1 naming limit: both found",
                     [v["found"] == 2 for e, v in both if min(its["named"] for its in e["hidden"]) >= 1]))
    every = [its for e in entries for its in e["findings"]]
    rows += [rate(f"findings with a confidence of {low:g} to {high:g}: right",
                  [its["right"] for its in every if low <= its["confidence"] < high])
             for low, high in pairwise(BANDS.tolist())]
    rows.append(["findings: expected right, and right", round(sum(its["confidence"] for its in every), 1),
                 sum(its["right"] for its in every), "", "", ""])
    rows.append(rate("cases that raised an error", [bool(e["error"]) for e, _ in verdicts]))
    return rows + accuracy(entries)


def accuracy(entries: list[dict[str, Any]]) -> list[list[object]]:
    """How far the measured laws of right pairs are from the hidden ones, relative to the errors that they state.

    The other unit is the error of an oracle that knows all but the size of the effect: 1/5 at the limit `seen`.
    """
    laws = [(its, next(one["seen"] for one in entry["hidden"] if one["pair"] == its["pair"]))
            for entry in entries for its in entry.get("laws", ())]
    rows = [rate(f"laws of right pairs: RMS off by at most {most:g} times the stated error",
                 [its["share"] <= most * its["stated"] for its, _ in laws]) for most in (1.0, LAW_WITHIN, 3.0)]
    averages = [(np.median, "off by, as a share of the law: median", [its["share"] for its, _ in laws]),
                (np.median, "off by, over the error of an oracle that knows the form: median",
                 [5 * seen * its["share"] for its, seen in laws]),
                (np.mean, "share of the visited range in the 90 % band: mean", [its["held"] for its, _ in laws])]
    return rows + [[f"laws of right pairs: {what}", "", len(laws),
                    float(f"{average(values):.3g}") if laws else "", "", ""] for average, what, values in averages]


def findings_of(entry: dict[str, Any]) -> list[tuple[Evidence, bool]]:
    """The evidence of each finding, and whether it or a rival is right."""
    every = right_of_any(entry)
    return [(Evidence(its["lead"], len(entry["findings"]) == 1, its["further"], its["share"], its["rare"]),
             bool({same(its["pair"]), *(same(pair) for pair in its["rivals"])} & every))
            for its in entry["findings"]]


def reported(entry: dict[str, Any], which: str) -> dict[str, Any]:
    """A case of the list `which` with the findings that a study reports.

    What others leave in a block that only unlikely ones explain is not explained.
    """
    found, kept, unlikely = findings_of(entry), list[dict[str, Any]](), list[dict[str, Any]]()
    are = are_reported([evidence for evidence, _ in found], [its["nats"] for its in entry["findings"]], which)
    for its, (evidence, is_right), is_reported in zip(entry["findings"], found, are, strict=True):
        (kept if is_reported else unlikely).append(its | {"confidence": confidence(evidence, which), "right": is_right})
    left = {*entry["unexplained"], *(block(its["pair"]) for its in unlikely)}
    return entry | {"findings": kept, "unlikely": unlikely, "unexplained": sorted(left)}
