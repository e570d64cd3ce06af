"""The rates of a method: how often its answers are right, with 95 % bounds, and beside those of another method."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from .answer import Answer
from .generator.truth import Truth
from .judge import SURE, Verdict, is_right, judge
from .laws import compare_laws

VISIBLE = 1.0
"""Least strength of effects that count: a residual as large as the noise. Weaker ones count apart."""
LAW_WITHIN = 1.5
"""How many times its stated error a measured law may be off at most."""
STAGES = ("all", "reported")
"""Before and after the filter by confidence."""


@dataclass(frozen=True)
class Entry:
    """A case: its suite, its `truth`, and the `answer` of a `version` of a method."""

    truth: Truth
    answer: Answer
    version: str = ""

    @property
    def suite(self) -> str:
        """The suite of the case."""
        return self.truth.case.split("/")[0]

    @property
    def seed(self) -> int:
        """The seed of the case."""
        return int(self.truth.case.split("/seed-")[1].split("/")[0])

    @property
    def strength(self) -> float:
        """The strength of the weakest effect; infinite where there is none."""
        return min((hidden.strength for hidden in self.truth.hidden), default=np.inf)

    @property
    def is_visible(self) -> bool:
        """Whether all effects are visible."""
        return self.strength >= VISIBLE

    def verdict(self, stage: str) -> Verdict:
        """Return the verdict on all findings, or on those that are reported."""
        return judge(self.answer.reported if stage == "reported" else self.answer, self.truth)


@dataclass(frozen=True)
class Rate:
    """`hits` of `of` cases or findings of a suite, at a stage, for which something holds."""

    suite: str
    what: str
    stage: str
    hits: int
    of: int

    @property
    def bounds(self) -> tuple[float, float]:
        """The 95 % bounds (Clopper and Pearson)."""
        return bounds(self.hits, self.of)


Condition = Callable[[Entry, Verdict], bool]
_ONE_EFFECT: dict[str, Condition] = {
    "right first": lambda entry, verdict: verdict.right_first,
    "right in the answer": lambda entry, verdict: verdict.effects_named == 1,
    "right and sure": lambda entry, verdict: verdict.sure,
    "a name too many": lambda entry, verdict: verdict.effects_named == 1 and verdict.too_many > 0,
    "a wrong name that is sure": lambda entry, verdict: verdict.wrong_and_sure,
}
_SAID: dict[str, Condition] = {
    "something said to be missing": lambda entry, verdict: not verdict.silent,
    "a wrong name that is sure": lambda entry, verdict: verdict.wrong_and_sure}
_UNKNOWN: dict[str, Condition] = {
    "something said to be missing": lambda entry, verdict: not verdict.silent,
    "right block": lambda entry, verdict: verdict.right_block,
    "right pair in the answer": lambda entry, verdict: verdict.effects_named == 1,
    "a name of the catalogue": lambda entry, verdict: verdict.named_unknown,
    "a wrong name that is sure": lambda entry, verdict: verdict.wrong_and_sure}
_TWO: dict[str, Condition] = {
    "both in the answer": lambda entry, verdict: verdict.effects_named == 2,
    "one in the answer": lambda entry, verdict: verdict.effects_named >= 1,
    "a name too many": lambda entry, verdict: verdict.too_many > 0,
    "a wrong name that is sure": lambda entry, verdict: verdict.wrong_and_sure}


def _everywhere(entry: Entry) -> bool:
    return all(hidden.share == 1 for hidden in entry.truth.hidden)


def _has_effect(entry: Entry) -> bool:
    return bool(entry.truth.hidden)


def _over_temperature(entry: Entry) -> bool:
    return any(hidden.abscissa == "oil_temperature" for hidden in entry.truth.hidden)


_Choice = Callable[[Entry], bool]


def _of_machine(name: str, choose: _Choice) -> _Choice:
    return lambda entry: f"/{name}/" in entry.truth.case and choose(entry)


_GROUPS: list[tuple[str, str, _Choice, dict[str, Condition]]] = [
    ("nothing_missing", "", lambda entry: True, _SAID),
    ("one_known_effect", "visible", lambda entry: entry.is_visible and _everywhere(entry), _ONE_EFFECT),
    ("one_known_effect", "visible, in a tenth of the runs",
     lambda entry: entry.is_visible and not _everywhere(entry), _ONE_EFFECT),
    ("one_known_effect", "below the noise", lambda entry: not entry.is_visible, _ONE_EFFECT),
    ("one_unknown_effect", "visible", lambda entry: entry.is_visible, _UNKNOWN),
    ("two_effects", "both visible", lambda entry: entry.is_visible, _TWO),
    ("wrong_parameter", "calibrated", lambda entry: "/calibrated-" in entry.truth.case, _SAID),
    ("wrong_parameter", "fixed", lambda entry: "/fixed-" in entry.truth.case, _SAID),
    ("faulty_recordings", "no effect", lambda entry: not _has_effect(entry), _SAID),
    ("faulty_recordings", "visible", lambda entry: _has_effect(entry) and entry.is_visible, _ONE_EFFECT),
    ("missing_signals", "no effect", lambda entry: not _has_effect(entry), _SAID),
    ("missing_signals", "visible", lambda entry: _has_effect(entry) and entry.is_visible,
     {"something said to be missing": lambda entry, verdict: not verdict.silent, **_ONE_EFFECT}),
    ("further_channel", "no effect", lambda entry: not _has_effect(entry), _SAID),
    ("further_channel", "over the channel, visible", lambda entry: _over_temperature(entry) and entry.is_visible,
     _ONE_EFFECT),
    ("further_channel", "over something else, visible",
     lambda entry: _has_effect(entry) and not _over_temperature(entry) and entry.is_visible, _ONE_EFFECT),
    *(("other_machines", f"{words}, {label}", _of_machine(name, choose), conditions)
      for words, name in (("tanks", "two-tanks"), ("motor", "dc-motor"))
      for label, choose, conditions in (
          ("no effect", lambda entry: not _has_effect(entry), _SAID),
          ("visible", lambda entry: _has_effect(entry) and _everywhere(entry), _ONE_EFFECT),
          ("in a tenth of the runs", lambda entry: not _everywhere(entry), _ONE_EFFECT))),
]
"""Suite, which of its cases, and what is counted of them."""


def rate(entries: Sequence[Entry]) -> list[Rate]:
    """Return the rates of the entries of any suites."""
    rates = []
    for suite, label, choose, conditions in _GROUPS:
        chosen = [entry for entry in entries if entry.suite == suite and choose(entry)]
        judged = {stage: [(entry, entry.verdict(stage)) for entry in chosen] for stage in STAGES}
        for what, holds in conditions.items() if chosen else ():
            rates += [count_hits(suite, f"{label}: {what}" if label else what, stage,
                                 [holds(entry, verdict) for entry, verdict in judged[stage]]) for stage in STAGES]
    return [*rates, *_rate_findings(entries)]


def count_hits(suite: str, what: str, stage: str, values: Iterable[bool]) -> Rate:
    """Return the rate of those values that are true."""
    values = list(values)
    return Rate(suite, what, stage, sum(values), len(values))


def _rate_findings(entries: Sequence[Entry]) -> list[Rate]:
    """Return the rates of findings, laws and errors over all suites."""
    findings = [(each, is_right(each, entry.truth)) for entry in entries for each in entry.answer.reported.findings]
    laws = [difference for entry in entries for difference in compare_laws(entry.answer, entry.truth)]
    named = [each for each, right in findings if right and each.effect]
    rates = [count_hits("all", f"findings with a confidence of {words}: right", "reported",
                    [right for each, right in findings if low <= each.confidence < high])
             for words, low, high in (("less than 0.6", 0.0, 0.6), ("0.6 to 0.8", 0.6, 0.8),
                                      (f"0.8 to {SURE:g}", 0.8, SURE), (f"{SURE:g} or more", SURE, np.inf))]
    rates += [count_hits("all", "findings: right", "reported", [right for _, right in findings]),
              Rate("all", "findings: right, as expected by their confidence", "reported",
                   round(sum(each.confidence for each, _ in findings)), len(findings))]
    rates.append(count_hits("all", "right names, left out of the catalogue: unlisted", "reported",
                        [not each.left_out for each in named]))
    rates += [count_hits("all", f"measured laws of right pairs: off by at most {most:g} times the stated error", "all",
                     [law.share <= most * law.stated for law in laws]) for most in (1.0, LAW_WITHIN)]
    rates.append(count_hits("all", "measured laws of right pairs: within 20 % of their size", "all",
                        [law.share <= 0.2 for law in laws]))
    rates.append(count_hits("all", "cases that raised an error", "all",
                            [bool(entry.answer.error) for entry in entries]))
    return [each for each in rates if each.of]


def bounds(hits: int, of: int) -> tuple[float, float]:
    """Return the 95 % bounds of the rate of `hits` of `of` (Clopper and Pearson)."""
    return (float(beta.ppf(0.025, hits, of - hits + 1)) if hits else 0.0,
            float(beta.ppf(0.975, hits + 1, of - hits)) if hits < of else 1.0)


@dataclass(frozen=True)
class Comparison:
    """Two methods on the same cases: how often something holds of either, and how many cases were `lost` or `gained`.

    `stands` tells whether the losses may be chance: they do not exceed the gains by more than 2 sqrt(lost + gained), or
    for false alarms by more than one.
    """

    what: str
    cases: int
    before: int
    after: int
    gained: int
    lost: int
    is_alarm: bool

    @property
    def stands(self) -> bool:
        """Whether the second method is not worse, as far as these cases tell."""
        most = 1.0 if self.is_alarm else 2 * np.sqrt(self.lost + self.gained)
        return bool(self.lost - self.gained <= most)


_PAIRED: dict[str, tuple[_Choice, Callable[[Verdict], bool], bool]] = {
    "right first": (lambda entry: _has_effect(entry) and entry.is_visible, lambda verdict: verdict.right_first, False),
    "right in the answer": (lambda entry: _has_effect(entry) and entry.is_visible,
                            lambda verdict: verdict.effects_named > 0, False),
    "no name too many": (_has_effect, lambda verdict: verdict.too_many == 0, False),
    "no wrong name that is sure": (lambda entry: True, lambda verdict: not verdict.wrong_and_sure, False),
    "no false alarm": (lambda entry: not _has_effect(entry) and "/fixed-" not in entry.truth.case,
                       lambda verdict: verdict.silent, True),
}
"""What is compared: of which cases, whether it holds, and whether it is about false alarms."""


def compare_methods(before: Sequence[Entry], after: Sequence[Entry], stage: str = "all") -> list[Comparison]:
    """Return the comparisons of two methods on the cases that both have answered."""
    others = {entry.truth.case: entry for entry in after}
    pairs = [(entry, others[entry.truth.case]) for entry in before if entry.truth.case in others]
    comparisons = []
    for what, (choose, holds, is_alarm) in _PAIRED.items():
        chosen = [pair for pair in pairs if choose(pair[0])]
        both = np.array([[holds(entry.verdict(stage)) for entry in pair] for pair in chosen], bool).reshape(-1, 2)
        comparisons.append(Comparison(what, len(both), int(both[:, 0].sum()), int(both[:, 1].sum()),
                                      int((~both[:, 0] & both[:, 1]).sum()), int((both[:, 0] & ~both[:, 1]).sum()),
                                      is_alarm))
    return comparisons
