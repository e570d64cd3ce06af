"""The study: which effect the recordings ask for, one after the other, until nothing more is missing or known.

    state = start(settings, comparison)
    while not finished(state):
        state = advance(settings, comparison, state)
    result = conclude(settings, comparison, state)

A state is JSON, complete, and the same after a restart. A step is one fit or one screening: a few seconds.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.study import mixed
from slipstick.study.comparison import Comparison
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import Ranked, gained, in_errors, rank
from slipstick.study.rounds import (
    Fit,
    Round,
    bent,
    candidate,
    design,
    explained,
    left,
    narrowed,
    pending,
    restore,
    screening,
    stored,
    straightened,
    taken,
    wide,
)
from slipstick.study.score import score
from slipstick.study.settings import StudySettings

State = dict[str, Any]

_ROUGH = 100.0
"""Log-likelihood to which the first fit of all converges: it only shows the noise."""
_NEAR = 0.01
"""Share of the rise that the screening promises to which a candidate's fit converges."""
_SURE = 2.0
_SURE_OF_HIDDEN = 3.0
_SURE_OF_MORE = 5.0
"""Standard errors by which a candidate must improve held-out predictions: one that the screening asks for, one that
scatter hides, and one beside another, which must be more than what the first one's form leaves over."""
_TAKEN = 0.5
"""Share of what the effects before it leave, in a signal, in the scatter or in parameters far from nominal, that a
later one must take away: less may be no more than what their form is wrong by. A drift need not: no other effect's form
leaves one."""
_EXPLAINED, _ABOUT = 0.9, 0.4
"""Share of what is left in a signal that all names together must take away where something visible stays, and an open
term, which is only about right."""
_VISIBLE = 0.05
"""Significance that is enough where the residuals themselves say that something is missing."""
OPEN = tuple(effect.name for effect in effects.CATALOGUE if not effect.listed)
"""Open terms, one for each quantity: what is tried where no name will do."""
_OPEN_TRIED = 2
"""Open terms that are fitted."""
_WORTH = 0.8
"""Share of an open term's held-out gain that a named effect must reach: its form need not be quite the true one."""
_PATHS = 2
"""First effects to begin with, where the one before leaves something over: two together may look like a third."""


def start(settings: StudySettings, comparison: Comparison) -> State:
    """The state after the fit without any effect."""
    rough = mixed.fit(comparison, design(settings), tolerance=_ROUGH, profiled=False)
    # The residuals show the sensors' noise better than the signals do, whose own bends add to it.
    sharp = comparison.with_noise(rough.about.residuals)
    first = {"added": [], "fit": stored(mixed.fit(sharp, design(settings)))}
    return {"noise": sharp.noise, "rounds": [first], "others": [], "stopped": None}


def finished(state: State) -> bool:
    """Whether nothing more is asked."""
    return state["stopped"] is not None


def advance(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Screen the catalogue, fit the next candidate, or settle on the best of those fitted."""
    comparison = observed(comparison, state)
    *before, last = state["rounds"]
    if "screening" not in last:
        tried = {*last["added"], *begun(state["others"])}
        known = [name for name in settings.catalogue if name not in tried]
        last = {**last, "screening": _screened(settings, comparison, last, known), "candidates": {}, "hidden": False}
        state = {**state, "rounds": [*before, last]}
        return state if last["screening"]["shortlist"] else _ended(settings, comparison, state, "nothing more")
    waiting = pending(last)
    if waiting and not waiting[0]["asked_for"] and not last["hidden"]:
        # What scatter hides is worth its time only where nothing that is asked for will do.
        will_do = _best(settings, comparison, last) is not None if last["added"] else explained(last)
        waiting, last = [] if will_do else waiting, {**last, "hidden": True}
    if waiting:
        one = waiting[0]
        found = _candidate(settings, comparison, last, one)
        fitted = {**last["candidates"], one["effect"]: stored(found)}
        return {**state, "rounds": [*before, {**last, "candidates": fitted}]}
    return _settled(settings, comparison, state)


def _screened(settings: StudySettings, comparison: Comparison, last: Round, known: list[str]) -> Round:
    """The screening of a round: of the catalogue and, in the first where something is asked for, of open terms."""
    if not known:
        return {"p_value": 1.0, "probes": [], "shortlist": []}
    found = restore(settings, comparison, last)
    level = max(settings.significance, _VISIBLE if left(last["fit"]) else 0.0)
    suspicious = wide(last["fit"]) or (not last["added"] and (left(last["fit"]) or bent(settings, last["fit"])))
    screened = screening(settings, score(comparison, found, known, settings.seed), comparison, level, suspicious)
    if not last["added"] and screened["shortlist"]:
        opened = screening(settings, score(comparison, found, OPEN, settings.seed), comparison, level, False)
        both = [*screened["shortlist"], *opened["shortlist"][:_OPEN_TRIED]]
        screened |= {"open": opened, "shortlist": sorted(both, key=lambda one: not one["asked_for"])}
    return screened


def observed(comparison: Comparison, state: State) -> Comparison:
    """The comparison with the sensors' noise that the study has found."""
    return replace(comparison, noise=state["noise"])


def ranked(settings: StudySettings, comparison: Comparison, one: Round, listed: bool = True) -> list[Ranked]:
    """The candidates of a round, the best first: those of the catalogue, or the open terms."""
    fitted = {name: restore(settings, comparison, one, name) for name in one["candidates"]
              if effects.find(name).listed == listed}
    return rank(comparison, restore(settings, comparison, one), fitted, settings.seed) if fitted else []


def another(settings: StudySettings, comparison: Comparison, one: Round,
            named: set[str]) -> tuple[str, MixedFit] | None:
    """The best-scoring effect outside the quantities `named`, fitted beside the effects of a round; None if none is."""
    others = [probe for probe in one["screening"]["probes"] if effects.find(probe["effect"]).quantity not in named]
    if not others:
        return None
    best = max(others, key=lambda probe: float(probe["gain"]))
    return best["effect"], _candidate(settings, comparison, one, candidate(others, best["effect"]))


def _settled(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Add the best candidate of the last round, if it is good enough."""
    last = state["rounds"][-1]
    best = _best(settings, comparison, last)
    if best is None:
        return _ended(settings, comparison, state, "nothing that predicts better")
    state = {**state, "rounds": [*state["rounds"], _added(settings, comparison, last, best)]}
    return _ended(settings, comparison, state, "enough") if len(state["rounds"]) > settings.most_effects else state


def _best(settings: StudySettings, comparison: Comparison, last: Round) -> str | None:
    """The best of the candidates fitted that are good enough to be added."""
    hidden = {one["effect"] for one in last["screening"]["shortlist"] if not one["asked_for"]}
    for one in ranked(settings, comparison, last):
        enough = _SURE_OF_MORE if last["added"] else _SURE_OF_HIDDEN if one.effect in hidden else _SURE
        drift = one.effect not in hidden and effects.find(one.effect).uses_run_order
        first = not last["added"] and one.effect not in hidden
        takes = first or drift or _much(settings, last["fit"], last["candidates"][one.effect])
        if one.sure >= enough and not one.at_bound and takes:
            return one.effect
    return None


def _added(settings: StudySettings, comparison: Comparison, last: Round, effect: str) -> Round:
    """The round that begins with one candidate more, fitted to the end."""
    added, near = [*last["added"], effect], last["candidates"][effect]
    again = mixed.fit(comparison, design(settings, *added), np.array(near["theta"]))
    found = (again, restore(settings, comparison, last, effect))
    best = max(found, key=lambda one: one.log_likelihood.sum())
    return {"added": added, "fit": stored(best)}


def _ended(settings: StudySettings, comparison: Comparison, state: State, why: str) -> State:
    """Begin anew with another first effect where this path asks for it; else judge the best path."""
    paths = [*state["others"], {"rounds": state["rounds"], "stopped": why}]
    other = _another(settings, comparison, paths)
    if other is not None:
        return {**state, "rounds": other, "others": paths}
    best = 0
    for place in range(1, len(paths)):
        if _better(settings, comparison, paths[best]["rounds"][-1], paths[place]["rounds"][-1]):
            best = place
    others = [one for place, one in enumerate(paths) if place != best]
    return _judge(settings, comparison, {**state, **paths[best], "others": others})


def _another(settings: StudySettings, comparison: Comparison, paths: list[dict[str, Any]]) -> list[Round] | None:
    """The beginning of another path, if the last one asks for it: two effects together may look like a third.

    Where an effect is not needed beside those added after it, the next of these takes its place; where something is
    left over, the path begins with the next best effect.
    """
    rounds = paths[-1]["rounds"]
    added = rounds[-1]["added"]
    for place, after in enumerate(added[1:]):
        begins = [*added[:place], after]
        new = all(path["rounds"][-1]["added"][:len(begins)] != begins for path in paths)
        if new and not _needed(settings, comparison, rounds[-1], place):
            return _going_on(settings, comparison, rounds[:place + 1], after)
    if added and left(rounds[-1]["fit"]) and len(paths) < _PATHS:
        for other in ranked(settings, comparison, rounds[0]):
            if other.effect not in begun(paths) and other.sure >= _SURE and not other.at_bound:
                return _going_on(settings, comparison, rounds[:1], other.effect)
    return None


def _needed(settings: StudySettings, comparison: Comparison, last: Round, place: int) -> bool:
    """Whether the effects of a round explain less without the one at a place. No other's form leaves a drift."""
    if effects.find(last["added"][place]).uses_run_order:
        return True
    rest = [*last["added"][:place], *last["added"][place + 1:]]
    theta = np.array(last["fit"]["theta"])
    beside = design(settings, *last["added"]).of_each(theta)
    start = np.concatenate([theta[:len(settings.parameters)], *(beside[name] for name in rest)])
    without = {"added": rest, "fit": stored(mixed.fit(comparison, design(settings, *rest), start, profiled=False))}
    return _better(settings, comparison, without, last)


def _going_on(settings: StudySettings, comparison: Comparison, rounds: list[Round], effect: str) -> list[Round]:
    """The rounds of a path, and the one that begins with an effect more, whatever the last of them adds."""
    *before, last = rounds
    if effect not in last["candidates"]:
        found = _candidate(settings, comparison, last, candidate(last["screening"]["probes"], effect))
        last = {**last, "candidates": {**last["candidates"], effect: stored(found)}}
    return [*before, last, _added(settings, comparison, last, effect)]


def begun(paths: list[dict[str, Any]]) -> list[str]:
    """The effects that paths began with."""
    return [path["rounds"][1]["added"][0] for path in paths if len(path["rounds"]) > 1]


def _much(settings: StudySettings, before: Fit, after: Fit) -> bool:
    """Whether a fit takes away so much that it is more than what the form of the effects before it leaves over."""
    return max(taken(before, after), narrowed(before, after), straightened(settings, before, after)) >= _TAKEN


def _better(settings: StudySettings, comparison: Comparison, one: Round, other: Round) -> bool:
    """Whether the end of another path is so much better that its effects are more than what a form leaves over.

    Fewer of the same effects are better where the others add no more than that.
    """
    if set(other["added"]) < set(one["added"]):
        return not _better(settings, comparison, other, one)
    now, then = (restore(settings, comparison, each) for each in (one, other))
    surely = in_errors(gained(comparison, now, then, settings.seed)) >= _SURE_OF_MORE
    return surely and _much(settings, one["fit"], other["fit"])


def _judge(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Take back all names where they explain too little; put an open term in their place where one explains more."""
    first, last = state["rounds"][0], state["rounds"][-1]
    visible = left(first["fit"])
    opened = [one for one in ranked(settings, comparison, first, listed=False) if one.sure >= _SURE and not one.at_bound
              and not (visible and taken(first["fit"], first["candidates"][one.effect]) < _ABOUT)]
    named = bool(last["added"]) and not (left(last["fit"]) and taken(first["fit"], last["fit"]) < _EXPLAINED)
    if named and opened:
        without, found = (restore(settings, comparison, one) for one in (first, last))
        gain = gained(comparison, without, found, settings.seed)
        worth = _WORTH if len(last["added"]) == 1 else 1.0
        named = bool(gain.sum() >= worth * opened[0].gain.sum() or in_errors(opened[0].gain - gain) < _SURE)
    if named:
        return state
    if opened:
        term = {"added": [opened[0].effect], "fit": first["candidates"][opened[0].effect]}
        return {**state, "rounds": [first, term], "stopped": "unlisted"}
    unexplained = visible and first["screening"]["shortlist"]
    return {**state, "rounds": [first], "stopped": "unlisted" if unexplained else state["stopped"]}


def _candidate(settings: StudySettings, comparison: Comparison, last: Round, one: Round) -> MixedFit:
    """The fit with one more effect, as near as ranking needs it: the temperature gain stays what it is without it."""
    with_it = design(settings, *last["added"], one["effect"])
    d, known, nominal = len(settings.parameters), last["fit"]["theta"], np.ones(len(settings.parameters))
    # What scatter hides has bent the temperature gain as well: that begins at nominal.
    if with_it.valley is not None and not one["hidden"]:
        nominal[with_it.valley] = known[with_it.valley]
    listed, found = effects.find(one["effect"]).listed, []
    for start in one["starts"]:
        values = [start[its.name] for its in effects.find(one["effect"]).coefficients]
        theta = np.array([*nominal, *known[d:], *values])
        found.append(mixed.fit(comparison, with_it, theta, max(mixed.TOLERANCE, _NEAR * one["gain"]), profiled=False))
        # Another shape is worth its time only where one leaves something; an open term is only about right.
        if not one["hidden"] and (not listed or not left(stored(found[-1]))):
            break
    return max(found, key=lambda its: its.log_likelihood.sum())
