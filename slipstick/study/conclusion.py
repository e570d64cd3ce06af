"""The result of a finished study as JSON: the answer, where it was, how sure, and what adding the effect does."""

from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.study import gap, locate, study
from slipstick.study.answer import coefficients, names, placed, term
from slipstick.study.comparison import Comparison
from slipstick.study.cut import cut
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import Ranked
from slipstick.study.settings import StudySettings


def conclude(settings: StudySettings, comparison: Comparison, state: study.State) -> dict[str, Any]:
    """All that a study has found."""
    comparison = study.observed(comparison, state)
    fits = [study.restore(settings, comparison, one) for one in state["rounds"]]
    rankings = [study.ranked(settings, comparison, one) if one.get("candidates") else [] for one in state["rounds"]]
    added = state["rounds"][-1]["added"]
    tied = [[one.effect for one in ranking if one.tied] for ranking in rankings]
    seen = cut(comparison, fits[0], settings.seed)
    where = None if seen is None else locate.located(comparison, seen.left)
    answer = _answer(settings, state, fits, tied, where)
    result: dict[str, Any] = {
        "answer": answer, "settings_digest": settings.digest, "recordings_digest": comparison.recordings.digest,
        "experiments": len(comparison.measured), "noise": comparison.noise, "stopped": state["stopped"],
        "rounds": [{"added": one["added"], "p_value": one["screening"]["p_value"] if "screening" in one else None,
                    "screening": _best_probes(one), "ranking": [placed(each, settings.level) for each in ranking],
                    "parameters": dict(zip(settings.parameters, one["fit"]["theta"], strict=False)),
                    "scatter": dict(zip(settings.scatter, np.sqrt(np.diag(found.scatter)).tolist(), strict=True)),
                    "noise": np.sqrt(found.state.noise).tolist(), "converged": found.converged}
                   for one, found, ranking in zip(state["rounds"], fits, rankings, strict=True)],
        "models": {"before": fits[0].design.model(fits[0].state.theta).spec(),
                   "after": fits[-1].design.model(fits[-1].state.theta).spec()},
        "where": where, "gap": None,
    }
    if added:
        result["gap"] = _gap(settings, comparison, fits, added, rankings[0])
    return result


def _answer(settings: StudySettings, state: study.State, fits: list[MixedFit], tied: list[list[str]],
            where: dict[str, Any] | None) -> dict[str, Any]:
    added = state["rounds"][-1]["added"]
    if not added and state["stopped"] == "unlisted":
        block = "shifting times" if where is None else where["worst"]["block"].replace("_", " ")
        return {"kind": "unlisted", "effects": [], "tied": [], "coefficients": [],
                "sentence": f"Something is missing, most of all in the {block}, and nothing that is known explains it"}
    if not added:
        kind = "none" if fits[0].converged else "not converged"
        sentence = "Nothing is missing that these recordings could show"
        return {"kind": kind, "effects": [], "tied": [], "sentence": sentence, "coefficients": []}
    groups = [group if name in group else [name] for name, group in zip(added, tied, strict=False)]
    if not effects.find(added[0]).listed:
        found = coefficients(fits[-1], settings.level)
        return {"kind": "unlisted", "effects": added, "tied": [added], "coefficients": found,
                "sentence": f"Something is missing in the {effects.find(added[0]).quantity}, and no effect of the "
                            f"catalogue explains it: about {term(found)}"}
    kind = "several" if len(added) > 1 else "tie" if len(groups[0]) > 1 else "effect"
    phrases = [names(group) if len(group) == 1 else f"one of {names(group)}, not told apart by these recordings"
               for group in groups]
    return {"kind": kind, "effects": added, "tied": groups, "sentence": f"Missing: {'; then '.join(phrases)}",
            "coefficients": coefficients(fits[-1], settings.level)}


def _best_probes(one: dict[str, Any]) -> list[dict[str, Any]]:
    """The strongest probe of each effect, the strongest effect first."""
    best: dict[str, dict[str, Any]] = {}
    for probe in one.get("screening", {"probes": []})["probes"]:
        if probe["gain"] > best.get(probe["effect"], {"gain": -1.0})["gain"]:
            best[probe["effect"]] = probe
    return sorted(best.values(), key=lambda probe: -probe["gain"])


def _gap(settings: StudySettings, comparison: Comparison, fits: list[MixedFit], added: list[str],
         ranking: list[Ranked]) -> dict[str, Any]:
    """The gap before and after, and what the best effect of another class would have closed."""
    before, after = (gap.predict(comparison, one, settings.seed) for one in (fits[0], fits[-1]))
    found: dict[str, Any] = {"closures": gap.closures(comparison, before, after, settings.seed),
                             "before": before.time.tolist(), "after": after.time.tolist(), "control": None}
    named = {effects.find(name).quantity for name in added}
    others = [one for one in ranking if effects.find(one.effect).quantity not in named]
    if others:
        control = gap.predict(comparison, others[0].found, settings.seed)
        # What a right model would leave is the named effect's to say, of the control as well.
        judged = gap.Prediction(control.square, after.variance, control.time)
        found["control"] = {"effect": others[0].effect,
                            "closures": gap.closures(comparison, before, judged, settings.seed)}
    return found
