"""The study: which effect the recordings ask for, one after the other, until nothing more is missing or known.

    state = start(settings, comparison)
    while not finished(state):
        state = advance(settings, comparison, state)
    result = conclude(settings, comparison, state)

A state is JSON, complete, and the same after a restart. A step is one fit or one screening, or a few of
them where a path ends: some seconds.
"""

from dataclasses import replace
from typing import Any

from slipstick.clutch import effects
from slipstick.study import mixed, paths
from slipstick.study.candidates import SURE, SURE_OF_HIDDEN, SURE_OF_MORE, add, fit_candidate, much, ranked
from slipstick.study.comparison import Comparison
from slipstick.study.ranking import gained, in_errors
from slipstick.study.rounds import (
    Round,
    bent,
    design,
    explained,
    left,
    pending,
    restore,
    screening,
    stored,
    taken,
    wide,
)
from slipstick.study.score import score
from slipstick.study.settings import StudySettings

State = dict[str, Any]

_ROUGH = 100.0
"""Log-likelihood to which the first fit of all converges: it only shows the noise."""
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


def start(settings: StudySettings, comparison: Comparison) -> State:
    """The state after the fit without any effect."""
    rough = mixed.fit(comparison, design(settings, comparison), tolerance=_ROUGH, profiled=False)
    # The residuals show the sensors' noise better than the signals do, whose own bends add to it.
    sharp = comparison.with_noise(rough.about.residuals)
    first = {"added": [], "fit": stored(mixed.fit(sharp, design(settings, comparison)))}
    return {"noise": sharp.noise, "rounds": [first], "others": [], "stopped": None}


def finished(state: State) -> bool:
    """Whether nothing more is asked."""
    return state["stopped"] is not None


def advance(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Screen the catalogue, fit the next candidate, or settle on the best of those fitted."""
    comparison = observed(comparison, state)
    *before, last = state["rounds"]
    if "screening" not in last:
        tried = {*last["added"], *paths.begun(state["others"])}
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
        found = fit_candidate(settings, comparison, last, one)
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


def _settled(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Add the best candidate of the last round, if it is good enough."""
    last = state["rounds"][-1]
    best = _best(settings, comparison, last)
    if best is None:
        return _ended(settings, comparison, state, "nothing that predicts better")
    return _longer(settings, comparison, {**state, "rounds": [*state["rounds"],
                                                              add(settings, comparison, last, best)]})


def _longer(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """The state with an effect more; the path ends where it has as many as it may."""
    return _ended(settings, comparison, state, "enough") if len(state["rounds"]) > settings.most_effects else state


def _best(settings: StudySettings, comparison: Comparison, last: Round) -> str | None:
    """The best of the candidates fitted that are good enough to be added."""
    hidden = {one["effect"] for one in last["screening"]["shortlist"] if not one["asked_for"]}
    for one in ranked(settings, comparison, last):
        enough = SURE_OF_MORE if last["added"] else SURE_OF_HIDDEN if one.effect in hidden else SURE
        drift = one.effect not in hidden and effects.find(one.effect).uses_run_order
        first = not last["added"] and one.effect not in hidden
        takes = first or drift or much(settings, last["fit"], last["candidates"][one.effect])
        if one.sure >= enough and not one.at_bound and takes:
            return one.effect
    return None


def _ended(settings: StudySettings, comparison: Comparison, state: State, why: str) -> State:
    """Begin another path where this one asks for it; else judge the best path."""
    tried, begun = paths.another(settings, comparison, [*state["others"], paths.ended(state["rounds"], why)])
    if begun is not None:
        return _longer(settings, comparison, {**state, "rounds": begun, "others": tried})
    best = tried.pop(paths.best(settings, comparison, tried))
    return _judge(settings, comparison, {**state, "rounds": best["rounds"], "stopped": best["stopped"],
                                         "others": tried})


def _judge(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Take back all names where they explain too little; put an open term in their place where one explains more."""
    first, last = state["rounds"][0], state["rounds"][-1]
    visible = left(first["fit"])
    opened = [one for one in ranked(settings, comparison, first, listed=False) if one.sure >= SURE and not one.at_bound
              and not (visible and taken(first["fit"], first["candidates"][one.effect]) < _ABOUT)]
    named = bool(last["added"]) and not (left(last["fit"]) and taken(first["fit"], last["fit"]) < _EXPLAINED)
    if named and opened:
        without, found = (restore(settings, comparison, one) for one in (first, last))
        gain = gained(comparison, without, found, settings.seed)
        worth = _WORTH if len(last["added"]) == 1 else 1.0
        named = bool(gain.sum() >= worth * opened[0].gain.sum() or in_errors(opened[0].gain - gain) < SURE)
    if named:
        return state
    if opened:
        term = {"added": [opened[0].effect], "fit": first["candidates"][opened[0].effect]}
        return {**state, "rounds": [first, term], "stopped": "unlisted"}
    unexplained = visible and first["screening"]["shortlist"]
    return {**state, "rounds": [first], "stopped": "unlisted" if unexplained else state["stopped"]}
