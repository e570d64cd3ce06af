"""The study: which effect the recordings ask for, one after the other, until nothing more is missing or known.

    state = start(settings, comparison)
    while not finished(state):
        state = advance(settings, comparison, state)
    result = conclude(settings, comparison, state)

A state is JSON, complete, and the same after a restart. A step is one fit or one screening: a few seconds.
"""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.study import mixed
from slipstick.study.comparison import Comparison
from slipstick.study.design import Design
from slipstick.study.linearised import Probe
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import Ranked, gained, in_errors, rank
from slipstick.study.score import Scores, score
from slipstick.study.settings import StudySettings

State = dict[str, Any]

_HELD = (0.9, 1.0, 1.1)
"""Multiples of nominal at which the mean of the first scattering parameter is tried: see `mixed.fit`."""
_SURE = 2.0
_SURE_OF_MORE = 5.0
"""Standard errors by which a candidate must improve held-out predictions: the first, and one beside another, which
must be more than what the first one's form leaves over."""
_TAKEN = 0.5
"""Share of what the effects before it leave (see `_share`) that a later one must take away: less may be no more than
what their form is wrong by. A drift need not: it shows in the scatter, and no other effect's form leaves one."""
_EXPLAINED = 0.4
"""Share of it that all names together, or an open term, must take away where there is more than a `_LITTLE` of it."""
_LITTLE = 0.6
"""Variance beyond the sensors' noise, as a share of it, that scatter of other parameters also leaves."""
_STATE = tuple(field.name for field in fields(mixed.State))
_OPEN = tuple(effect.name for effect in effects.CATALOGUE if not effect.listed)
_OPEN_TRIED = 2
"""Open terms that are fitted."""
_WORTH = 0.8
"""Share of an open term's held-out gain that a named effect must reach: its form need not be quite the true one."""
_FARTHEST = 3.0
"""Typical values from neutral at which a candidate's fit starts at most."""


def start(settings: StudySettings, comparison: Comparison) -> State:
    """The state after the fit without any effect."""
    design = Design(settings.parameters)
    rough = mixed.fit(comparison, design, settings.scattering)
    # The residuals show the sensors' noise better than the signals do, whose own bends add to it.
    sharp = comparison.with_noise(rough.about.residuals)
    found = max((mixed.fit(sharp, design, settings.scattering, _held(settings, rough.state, value)) for value in _HELD),
                key=lambda one: one.log_likelihood.sum())
    return {"noise": sharp.noise, "rounds": [_round((), found)], "stopped": None}


def finished(state: State) -> bool:
    """Whether nothing more is asked."""
    return state["stopped"] is not None


def advance(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Screen the catalogue, fit the next candidate, or settle on the best of those fitted."""
    comparison = observed(comparison, state)
    after = _advanced(settings, comparison, state)
    return after if after["stopped"] is None else _judge(settings, comparison, after)


def _advanced(settings: StudySettings, comparison: Comparison, state: State) -> State:
    *before, last = state["rounds"]
    if "screening" not in last:
        found = restore(settings, comparison, last)
        known = [name for name in settings.catalogue if name not in last["added"]]
        if not known:
            return {**state, "stopped": "nothing more"}
        screening = _screening(settings, score(comparison, found, known, settings.seed), comparison)
        if not last["added"] and screening["shortlist"]:
            opened = _screening(settings, score(comparison, found, _OPEN, settings.seed), comparison)
            screening["open"] = opened
            screening["shortlist"] += opened["shortlist"][:_OPEN_TRIED]
        last = {**last, "screening": screening, "candidates": {}}
        stopped = None if last["screening"]["shortlist"] else "nothing more"
        return {**state, "rounds": [*before, last], "stopped": stopped}
    waiting = [one for one in last["screening"]["shortlist"] if one["effect"] not in last["candidates"]]
    if waiting:
        one = waiting[0]
        found = _candidate(settings, comparison, last, one)
        fitted = {**last["candidates"], one["effect"]: _stored(found)}
        return {**state, "rounds": [*before, {**last, "candidates": fitted}]}
    return _settle(settings, comparison, state)


def _held(settings: StudySettings, state: mixed.State, value: float) -> mixed.State:
    """The state with the first scattering parameter at a multiple of its nominal value, where fits leave it."""
    theta = state.theta.copy()
    theta[settings.scattering[0]] = value
    return replace(state, theta=theta)


def observed(comparison: Comparison, state: State) -> Comparison:
    """The comparison with the sensors' noise that the study has found."""
    return replace(comparison, noise=state["noise"])


def restore(settings: StudySettings, comparison: Comparison, one: dict[str, Any],
            candidate: str | None = None) -> MixedFit:
    """The fit of a round, or of one of its candidates, from its JSON."""
    added = (*one["added"], candidate) if candidate else tuple(one["added"])
    stored = one["candidates"][candidate] if candidate else one["fit"]
    state = _state(stored)
    found = mixed.at(comparison, Design(settings.parameters, added), settings.scattering, state)
    return replace(found, converged=stored["converged"], iterations=stored["iterations"])


def ranked(settings: StudySettings, comparison: Comparison, one: dict[str, Any], listed: bool = True) -> list[Ranked]:
    """The candidates of a round, the best first: those of the catalogue, or the open terms."""
    fitted = {name: restore(settings, comparison, one, name) for name in one["candidates"]
              if effects.find(name).listed == listed}
    return rank(comparison, restore(settings, comparison, one), fitted, settings.seed) if fitted else []


def _settle(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Add the best candidate of the last round, if it is good enough."""
    last = state["rounds"][-1]
    for best in ranked(settings, comparison, last):
        beside = bool(last["added"]) and not effects.find(best.effect).uses_run_order
        enough = _SURE_OF_MORE if last["added"] else _SURE
        takes = not beside or _share(last["fit"], last["candidates"][best.effect]) >= _TAKEN
        if best.sure >= enough and not best.at_bound and takes:
            added = [*last["added"], best.effect]
            rounds = [*state["rounds"], {"added": added, "fit": last["candidates"][best.effect]}]
            return {**state, "rounds": rounds, "stopped": "enough" if len(added) == settings.most_effects else None}
    return {**state, "stopped": "nothing that predicts better"}


def _judge(settings: StudySettings, comparison: Comparison, state: State) -> State:
    """Take back all names where they explain too little; put an open term in their place where one explains more."""
    first, last = state["rounds"][0], state["rounds"][-1]
    visible = max(first["fit"]["noise"][:-1], default=1.0) - 1 > _LITTLE
    opened = [one for one in ranked(settings, comparison, first, listed=False) if one.sure >= _SURE and not one.at_bound
              and not (visible and _share(first["fit"], first["candidates"][one.effect]) < _EXPLAINED)]
    explained = bool(last["added"]) and not (visible and _share(first["fit"], last["fit"]) < _EXPLAINED)
    if explained and opened:
        without, found = (restore(settings, comparison, one) for one in (first, last))
        named = gained(comparison, without, found, settings.seed)
        worth = _WORTH if len(last["added"]) == 1 else 1.0
        explained = bool(named.sum() >= worth * opened[0].gain.sum()
                         or in_errors(opened[0].gain - named) < _SURE)
    if explained:
        return state
    if opened:
        term = {"added": [opened[0].effect], "fit": first["candidates"][opened[0].effect]}
        return {**state, "rounds": [first, term], "stopped": "unlisted"}
    unexplained = visible and first["screening"]["shortlist"]
    return {**state, "rounds": [first], "stopped": "unlisted" if unexplained else state["stopped"]}


def _share(before: dict[str, Any], after: dict[str, Any]) -> float:
    """Of the variance beyond the sensor's noise in the signal that a fit helps most, the share that it takes away."""
    without, left = (np.array(one["noise"])[:-1] - 1 for one in (before, after))
    if not len(left):
        return 1.0
    most = (without - left).argmax()
    return float((without - left)[most] / max(1e-9, without[most]))


def _candidate(settings: StudySettings, comparison: Comparison, last: dict[str, Any], one: dict[str, Any]) -> MixedFit:
    base = last["fit"]
    design = Design(settings.parameters, (*last["added"], one["effect"]))
    values = [one["start"][coefficient.name] for coefficient in effects.find(one["effect"]).coefficients]
    state = _state({**base, "theta": [*base["theta"], *values]})
    return mixed.fit(comparison, design, settings.scattering, state)


def _round(added: tuple[str, ...], found: MixedFit) -> dict[str, Any]:
    return {"added": list(added), "fit": _stored(found)}


def _state(stored: dict[str, Any]) -> mixed.State:
    return mixed.State(*(np.array(stored[name]) for name in _STATE))


def _stored(found: MixedFit) -> dict[str, Any]:
    state = {name: getattr(found.state, name).tolist() for name in _STATE}
    return {**state, "converged": found.converged, "iterations": found.iterations}


def _screening(settings: StudySettings, screened: Scores, comparison: Comparison) -> dict[str, Any]:
    """The screening as JSON, with the candidates to fit, the most promising first."""
    values = float(comparison.weights.sum())
    signature = np.sqrt(2 * screened.gain / values)
    columns = {"statistic": screened.statistic, "p_value": screened.p_values, "gain": screened.gain,
               "estimate": screened.estimate, "kept": screened.kept, "signature": signature}
    probes = [{"effect": one.effect, "coefficient": one.coefficient, "shape": dict(one.shape),
               **{name: float(column[place]) for name, column in columns.items()}}
              for place, one in enumerate(screened.probes)]
    shortlist: list[dict[str, Any]] = []
    for place in np.argsort(-screened.gain):
        one = screened.probes[place]
        asked_for = screened.p_values[place] <= settings.significance and signature[place] >= settings.smallest
        new = one.effect not in [chosen["effect"] for chosen in shortlist]
        if asked_for and new and len(shortlist) < settings.shortlist:
            shortlist.append({"effect": one.effect, "start": _begin(one, float(screened.estimate[place]))})
    return {"p_value": float(screened.p_values.min()), "probes": probes, "shortlist": shortlist}


def _begin(probe: Probe, estimate: float) -> dict[str, float]:
    """Where to start the coefficients of an effect, in typical values."""
    start = {}
    for one in effects.find(probe.effect).coefficients:
        neutral = one.neutral / one.typical
        start[one.name] = dict(probe.shape).get(one.name, one.neutral) / one.typical
        if one.name == probe.coefficient:
            start[one.name] = neutral + float(np.clip(estimate, -_FARTHEST, _FARTHEST))
    return start
