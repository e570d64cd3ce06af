"""The result of a finished study as JSON: the answer, where it was, how sure, and what adding the effect does."""

from typing import Any

import numpy as np

from slipstick.clutch import effects
from slipstick.study import confidence, gap, locate, rounds, study
from slipstick.study.answer import BLOCKS, coefficients, forms, left_over, names, placed, term
from slipstick.study.candidates import outside, ranked
from slipstick.study.comparison import Comparison
from slipstick.study.cut import cut
from slipstick.study.further import further
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import Ranked
from slipstick.study.settings import StudySettings
from slipstick.study.ties import Tie, ties

_ASKED = "Something asks for an effect, and none that is known predicts unseen experiments better: nothing is named"
"""What is said where the screening finds something and no candidate will do."""


def conclude(settings: StudySettings, comparison: Comparison, state: study.State) -> dict[str, Any]:
    """All that a study has found."""
    comparison = study.observed(comparison, state)
    fits = [rounds.restore(settings, comparison, one) for one in state["rounds"]]
    rankings = [ranked(settings, comparison, one) if one.get("candidates") else [] for one in state["rounds"]]
    added = state["rounds"][-1]["added"]
    seen = cut(comparison, fits[0], settings.seed)
    where = None if seen is None else locate.located(comparison, seen.left)
    groups = ties(settings, comparison, added, rankings, fits[-1])
    tied = [list(one) for one in groups]
    answer = _answer(settings, comparison, state, fits, tied, where) | {"confidence": None, "evidence": None}
    if answer["kind"] in ("effect", "tie", "several"):
        kind = confidence.evidence(rankings[0], added[0], added[1:], answer["left"] is not None)
        answer |= {"evidence": kind, "confidence": confidence.SHARES[kind]}
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
        "where": where, "gap": None, "further": _further(settings, comparison, groups),
    }
    if added:
        result["gap"] = _gap(settings, comparison, fits, state, rankings[0])
    return result


def _answer(settings: StudySettings, comparison: Comparison, state: study.State, fits: list[MixedFit],
            tied: list[list[str]], where: dict[str, Any] | None) -> dict[str, Any]:
    last = state["rounds"][-1]
    added, over = last["added"], left_over(comparison, fits[-1]) if rounds.left(last["fit"]) else None
    said: dict[str, Any] = {"kind": "none", "effects": added, "tied": tied, "block": None, "left": over,
                            "coefficients": coefficients(fits[-1], settings.level), "forms": [],
                            "sentence": "Nothing is missing that these recordings could show"}
    if not added and state["stopped"] == "unlisted":
        block = None if where is None else BLOCKS[where["worst"]["block"]]
        most = "shifting times" if block is None else block
        return {**said, "kind": "unlisted", "block": block, "sentence":
                f"Something is missing, most of all in the {most}, and nothing that is known explains it"}
    if not added and not fits[0].converged:
        return {**said, "kind": "not converged", "sentence": "The fit without any effect did not come to rest"}
    if not added:
        asked = any(one["asked_for"] for one in state["rounds"][0]["screening"]["shortlist"])
        return {**said, "sentence": _ASKED} if asked else said
    first = effects.find(added[0])
    if not first.listed:
        return {**said, "kind": "unlisted", "block": first.block, "forms": forms(state["rounds"][0]["screening"]),
                "sentence": f"Something is missing in the {first.quantity}, and no effect of the catalogue explains "
                            f"it: about {term(said['coefficients'])}"}
    kind = "several" if len(added) > 1 else "tie" if len(tied[0]) > 1 else "effect"
    phrases = [names(group) if len(group) == 1 else
               f"one of {len(group)} that these recordings do not tell apart: {names(group)}" for group in tied]
    more = "" if over is None else (f". Something more is left over, most of all in the {over['signal']}, where the "
                                    f"model is off by {over['noise_levels']:.1f} noise levels")
    return {**said, "kind": kind, "block": first.block, "sentence": f"Missing: {'; then '.join(phrases)}{more}"}


def _best_probes(one: dict[str, Any]) -> list[dict[str, Any]]:
    """The strongest probe of each effect, the strongest effect first."""
    best: dict[str, dict[str, Any]] = {}
    for probe in one.get("screening", {"probes": []})["probes"]:
        if probe["gain"] > best.get(probe["effect"], {"gain": -1.0})["gain"]:
            best[probe["effect"]] = probe
    return sorted(best.values(), key=lambda probe: -probe["gain"])


def _further(settings: StudySettings, comparison: Comparison, groups: list[Tie]) -> list[dict[str, Any]]:
    """Of each tie its effects, and the experiments that would tell them apart."""
    return [{"effects": list(tie), "experiments": further(comparison, list(tie.values()), settings.seed)}
            for tie in groups if len(tie) > 1]


def _gap(settings: StudySettings, comparison: Comparison, fits: list[MixedFit], state: study.State,
         ranking: list[Ranked]) -> dict[str, Any]:
    """The gap before and after, and what the best effect of another class would have closed."""
    first, added = state["rounds"][0], state["rounds"][-1]["added"]
    before, after = (gap.predict(comparison, one, settings.seed) for one in (fits[0], fits[-1]))
    found: dict[str, Any] = {"closures": gap.closures(comparison, before, after, settings.seed),
                             "before": before.time.tolist(), "after": after.time.tolist(), "control": None}
    named = {effects.find(name).quantity for name in added}
    others = [one for one in ranking if effects.find(one.effect).quantity not in named]
    spent = (others[0].effect, others[0].found) if others else outside(settings, comparison, first, named)
    if spent is not None:
        effect, fitted = spent
        control = gap.predict(comparison, fitted, settings.seed)
        # What a right model would leave is the named effect's to say, of the control as well.
        judged = gap.Prediction(control.square, after.variance, control.time)
        found["control"] = {"effect": effect, "closures": gap.closures(comparison, before, judged, settings.seed)}
    return found
