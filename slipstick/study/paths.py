"""Paths of a study: effects one after the other. Another path begins where two effects may have looked like a third."""

from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.study import mixed
from slipstick.study.candidates import SURE, add, better, fit_candidate, ranked
from slipstick.study.comparison import Comparison
from slipstick.study.rounds import Round, candidate, design, left, stored
from slipstick.study.settings import StudySettings

Path = dict[str, Any]
_PATHS = 2
"""First effects to begin with, where the one before leaves something over: two together may look like a third."""


def ended(rounds: list[Round], why: str) -> Path:
    """A path that has come to its end."""
    return {"rounds": rounds, "stopped": why, "gives_way": False}


def begun(paths: list[Path]) -> list[str]:
    """The effects that paths began with."""
    return [path["rounds"][1]["added"][0] for path in paths if len(path["rounds"]) > 1]


def another(settings: StudySettings, comparison: Comparison,
            paths: list[Path]) -> tuple[list[Path], list[Round] | None]:
    """The paths, the last of which may give way to another, and the rounds that this begins with; None for none."""
    instead = _without_a_needless_one(settings, comparison, paths)
    if instead is not None:
        return [*paths[:-1], {**paths[-1], "gives_way": True}], instead
    return paths, _with_another_first(settings, comparison, paths)


def best(settings: StudySettings, comparison: Comparison, paths: list[Path]) -> int:
    """Place of the best path: the first, unless a later one is so much better, or it has given way."""
    found = 0
    for place in range(1, len(paths)):
        then, now = paths[found]["rounds"][-1], paths[place]["rounds"][-1]
        if found == place - 1 and paths[found]["gives_way"]:
            found = found if better(settings, comparison, now, then) else place
        elif better(settings, comparison, then, now):
            found = place
    return found


def _without_a_needless_one(settings: StudySettings, comparison: Comparison,
                            paths: list[Path]) -> list[Round] | None:
    """Where an effect of the last path is not needed beside those added after it: a path with the next in its place.

    Two effects together may look like a third, which is then named before them.
    """
    rounds = paths[-1]["rounds"]
    added = rounds[-1]["added"]
    for place, after in enumerate(added[1:]):
        begins = [*added[:place], after]
        new = all(path["rounds"][-1]["added"][:len(begins)] != begins for path in paths)
        if new and not _needed(settings, comparison, rounds[-1], place):
            return _going_on(settings, comparison, rounds[:place + 1], after)
    return None


def _with_another_first(settings: StudySettings, comparison: Comparison,
                        paths: list[Path]) -> list[Round] | None:
    """Where something is left over: a path that begins with the next best effect."""
    rounds = paths[-1]["rounds"]
    if len(rounds) > 1 and left(rounds[-1]["fit"]) and len(paths) < _PATHS:
        for other in ranked(settings, comparison, rounds[0]):
            if other.effect not in begun(paths) and other.sure >= SURE and not other.at_bound:
                return _going_on(settings, comparison, rounds[:1], other.effect)
    return None


def _needed(settings: StudySettings, comparison: Comparison, last: Round, place: int) -> bool:
    """Whether the effects of a round explain less without the one at a place. No other's form leaves a drift."""
    if effects.find(last["added"][place]).uses_run_order:
        return True
    rest = [*last["added"][:place], *last["added"][place + 1:]]
    start = design(settings, comparison, *last["added"]).part(np.array(last["fit"]["theta"]), rest)
    fitted = mixed.fit(comparison, design(settings, comparison, *rest), start, profiled=False)
    without = {"added": rest, "fit": stored(fitted)}
    return better(settings, comparison, without, last)


def _going_on(settings: StudySettings, comparison: Comparison, rounds: list[Round], effect: str) -> list[Round]:
    """The rounds of a path, and the one that begins with an effect more, whatever the last of them adds."""
    *before, last = rounds
    if effect not in last["candidates"]:
        waiting = {one["effect"]: one for one in last["screening"]["shortlist"]}
        one = waiting.get(effect) or candidate(comparison.bench, last["screening"]["probes"], effect)
        fitted = stored(fit_candidate(settings, comparison, last, one))
        last = {**last, "candidates": {**last["candidates"], effect: fitted}}
    return [*before, last, add(settings, comparison, last, effect)]
