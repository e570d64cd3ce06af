"""The candidates of a round: fitted, ranked, and how much better than another fit one must be."""

import numpy as np

from slipstick.clutch import effects
from slipstick.study import mixed
from slipstick.study.comparison import Comparison
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import Ranked, gained, in_errors, rank
from slipstick.study.rounds import Fit, Round, candidate, design, left, narrowed, restore, stored, straightened, taken
from slipstick.study.settings import StudySettings

_NEAR = 0.01
"""Share of the rise that the screening promises to which a candidate's fit converges."""
SURE = 2.0
SURE_OF_HIDDEN = 3.0
SURE_OF_MORE = 5.0
"""Standard errors by which a candidate must improve held-out predictions: one that the screening asks for, one that
scatter hides, and one beside another, which must be more than what the first one's form leaves over."""
_TAKEN = 0.5
"""Share of what the effects before it leave, in a signal, in the scatter or in parameters far from nominal, that a
later one must take away: less may be no more than what their form is wrong by. A drift need not: no other effect's form
leaves one."""


def fit_candidate(settings: StudySettings, comparison: Comparison, last: Round, one: Round) -> MixedFit:
    """The fit with one more effect, as near as ranking needs it: the temperature gain stays what it is without it."""
    with_it = design(settings, comparison, *last["added"], one["effect"])
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


def outside(settings: StudySettings, comparison: Comparison, one: Round,
            named: set[str]) -> tuple[str, MixedFit] | None:
    """The best-scoring effect outside the quantities `named`, fitted beside the effects of a round; None if none is."""
    others = [probe for probe in one["screening"]["probes"] if effects.find(probe["effect"]).quantity not in named]
    if not others:
        return None
    best = max(others, key=lambda probe: float(probe["gain"]))
    return best["effect"], fit_candidate(settings, comparison, one, candidate(comparison.bench, others, best["effect"]))


def ranked(settings: StudySettings, comparison: Comparison, one: Round, listed: bool = True) -> list[Ranked]:
    """The candidates of a round, the best first: those of the catalogue, or the open terms."""
    fitted = {name: restore(settings, comparison, one, name) for name in one["candidates"]
              if effects.find(name).listed == listed}
    return rank(comparison, restore(settings, comparison, one), fitted, settings.seed) if fitted else []


def add(settings: StudySettings, comparison: Comparison, last: Round, effect: str) -> Round:
    """The round that begins with one candidate more, fitted to the end."""
    added, near = [*last["added"], effect], last["candidates"][effect]
    again = mixed.fit(comparison, design(settings, comparison, *added), np.array(near["theta"]))
    found = (again, restore(settings, comparison, last, effect))
    best = max(found, key=lambda one: one.log_likelihood.sum())
    return {"added": added, "fit": stored(best)}


def much(settings: StudySettings, before: Fit, after: Fit) -> bool:
    """Whether a fit takes away so much that it is more than what the form of the effects before it leaves over."""
    return max(taken(before, after), narrowed(before, after), straightened(settings, before, after)) >= _TAKEN


def better(settings: StudySettings, comparison: Comparison, one: Round, other: Round) -> bool:
    """Whether another round's fit is so much better that its effects are more than what a form leaves over."""
    now, then = (restore(settings, comparison, each) for each in (one, other))
    surely = in_errors(gained(comparison, now, then, settings.seed)) >= SURE_OF_MORE
    return surely and much(settings, one["fit"], other["fit"])
