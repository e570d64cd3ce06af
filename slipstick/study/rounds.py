"""A round of a study as JSON: the fit it begins with, what the screening says, and the fits of its candidates."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.study import marginal, mixed
from slipstick.study.comparison import Comparison
from slipstick.study.design import Design
from slipstick.study.mixed import MixedFit
from slipstick.study.score import Scores
from slipstick.study.settings import StudySettings

Round = dict[str, Any]
Fit = dict[str, Any]

_STATE = tuple(field.name for field in fields(marginal.State))
_HOPELESS = 0.05
"""Share of the greatest rise that the screening promises below which a candidate is not fitted."""
_LITTLE = 0.6
"""Variance beyond the sensors' noise, as a share of it, that scatter of other parameters also leaves."""
_WIDE = 0.11
"""Standard deviation of a multiplier beyond which the scatter may be an effect: the paper's are 0.05 and 0.08."""
_FAR = 0.2
"""Distance of a multiplier from nominal, two standard deviations of its prior, beyond which it may be an effect."""
_HIDDEN = 0.05
"""Share of a signature's square that scatter leaves, below which it hides the effect."""
_EXPLAINS = 0.5
"""Share of what is left that a fit must take away to explain it."""
_FARTHEST = 3.0
"""Typical values from neutral at which a candidate's fit starts at most."""
_STARTS = 3
"""Points from which a candidate is fitted at most."""


def design(settings: StudySettings, comparison: Comparison, *added: str) -> Design:
    """What moves in a fit with the effects added."""
    return Design(comparison.bench, settings.parameters, settings.scattering, added, settings.widest_scatter)


def restore(settings: StudySettings, comparison: Comparison, one: Round,
            candidate: str | None = None) -> MixedFit:
    """The fit of a round, or of one of its candidates, from its JSON."""
    added = (*one["added"], candidate) if candidate else tuple(one["added"])
    stored = one["candidates"][candidate] if candidate else one["fit"]
    state = _state(stored)
    found = mixed.at(comparison, design(settings, comparison, *added), state)
    return replace(found, converged=stored["converged"], iterations=stored["iterations"])


def stored(found: MixedFit) -> Fit:
    """A fit as JSON."""
    state = {name: getattr(found.state, name).tolist() for name in _STATE}
    return {**state, "converged": found.converged, "iterations": found.iterations}


def left(fit: Fit) -> bool:
    """Whether a fit leaves more in some signal than scatter of other parameters does."""
    return max(fit["noise"][:-1], default=1.0) - 1 > _LITTLE


def wide(fit: Fit) -> bool:
    """Whether a fit scatters so much that an effect may be in it."""
    return bool(np.sqrt(np.diag(fit["covariance"])).max() > _WIDE)


def bent(settings: StudySettings, fit: Fit) -> bool:
    """Whether a fit moves a parameter so far that an effect may be in it."""
    return bool(np.abs(np.array(fit["theta"][:len(settings.parameters)]) - 1).max() > _FAR)


def pending(one: Round) -> list[dict[str, Any]]:
    """Candidates of a round that are still to be fitted."""
    return [its for its in one["screening"]["shortlist"] if its["effect"] not in one["candidates"]]


def explained(one: Round) -> bool:
    """Whether a candidate that has been fitted leaves nothing that scatter may hide."""
    listed = [fit for name, fit in one["candidates"].items() if effects.find(name).listed]
    return any(not left(fit) and not wide(fit) and taken(one["fit"], fit) >= _EXPLAINS for fit in listed)


def taken(before: Fit, after: Fit) -> float:
    """Of the variance beyond the sensor's noise in the signal that a fit helps most, the share that it takes away."""
    without, over = (np.array(one["noise"])[:-1] - 1 for one in (before, after))
    if not len(over):
        return 1.0
    most = (without - over).argmax()
    return float((without - over)[most] / max(1e-9, without[most]))


def narrowed(before: Fit, after: Fit) -> float:
    """Of the variance of the scatter, the greatest share that a fit takes away."""
    scatter = [np.diag(one["covariance"]) for one in (before, after)]
    return float(1 - (scatter[1] / scatter[0]).min())


def straightened(settings: StudySettings, before: Fit, after: Fit) -> float:
    """Of the squared distance of the parameters from nominal, where that is far, the share that a fit takes away."""
    distance = [((np.array(one["theta"][:len(settings.parameters)]) - 1) ** 2).sum() for one in (before, after)]
    return float(1 - distance[1] / distance[0]) if bent(settings, before) else 0.0


def screening(settings: StudySettings, screened: Scores, comparison: Comparison, level: float,
              suspicious: bool) -> dict[str, Any]:
    """The screening as JSON, with the candidates to fit, the most promising first.

    These are the ones whose p-value is at most `level`. Where the fit is `suspicious`, those that the scatter hides
    follow, which no screening can see.
    """
    values = float(comparison.weights.sum())
    signature = np.sqrt(2 * screened.gain / values)
    columns = {"statistic": screened.statistic, "p_value": screened.p_values, "gain": screened.gain,
               "estimate": screened.estimate, "kept": screened.kept, "signature": signature,
               "selected": screened.selected(settings.seed)}
    probes = [{"effect": one.effect, "coefficient": one.coefficient, "shape": dict(one.shape),
               **{name: float(column[place]) for name, column in columns.items()}}
              for place, one in enumerate(screened.probes)]
    asked_for = (screened.p_values <= level) & (signature >= settings.smallest)
    hopeful = asked_for & (screened.gain >= _HOPELESS * screened.gain[asked_for].max(initial=0.0))
    hidden = (screened.seen < _HIDDEN) & suspicious
    shortlist: dict[str, dict[str, Any]] = {}
    for some, most in ((hopeful, settings.shortlist), (hidden, len(hidden))):
        for place in np.argsort(-screened.gain):
            effect = screened.probes[place].effect
            if some[place] and effect not in shortlist and len(shortlist) < most:
                shortlist[effect] = {**candidate(comparison.bench, probes, effect, bool(hidden[place])),
                                     "asked_for": bool(hopeful[place])}
    return {"p_value": float(screened.p_values.min()), "probes": probes, "shortlist": list(shortlist.values())}


def candidate(bench: Bench, probes: list[dict[str, Any]], effect: str, hidden: bool = False) -> dict[str, Any]:
    """What to fit of an effect after its probes: the rise they promise, and where to start, in typical values.

    It starts at the shapes that promise most, an open term at the one that most halves of the experiments choose. Of
    what scatter has `hidden` a probe says nothing: that starts at its typical value, to either side of neutral.
    """
    listed, coefficients = effects.find(effect).listed, effects.find(effect).on(bench.scales).coefficients
    mine = sorted((one for one in probes if one["effect"] == effect),
                  key=lambda one: (0.0 if listed else -float(one["selected"]), -float(one["gain"])))
    starts: list[dict[str, float]] = []
    for probe in mine[:1] if hidden else mine:
        for amplitude in (1.0, -1.0) if hidden else (float(np.clip(probe["estimate"], -_FARTHEST, _FARTHEST)),):
            start = {}
            for one in coefficients:
                start[one.name] = probe["shape"].get(one.name, one.neutral) / one.typical
                if one.name == probe["coefficient"]:
                    start[one.name] = _inside(one, start[one.name], amplitude)
            if start not in starts:
                starts.append(start)
    return {"effect": effect, "gain": max(one["gain"] for one in mine), "starts": starts[:_STARTS], "hidden": hidden}


def _inside(one: effects.Coefficient, neutral: float, amplitude: float) -> float:
    """The amplitude away from neutral, or to the other side where a bound is in the way."""
    lower, upper = sorted((one.lower / one.typical, one.upper / one.typical))
    wanted = neutral + amplitude
    return float(np.clip(wanted if lower < wanted < upper else neutral - amplitude, lower, upper))


def _state(stored: dict[str, Any]) -> marginal.State:
    return marginal.State(*(np.array(stored[name]) for name in _STATE))
