"""How far a study is, and what its next step does."""

from typing import Any

from slipstick.study.rounds import pending
from slipstick.study.settings import StudySettings
from slipstick.study.study import State, finished

STAGES = ("fit", "screen", "candidates", "choose", "conclude")
"""The fit without any effect, the screening of the catalogue, the fits of candidates, the choice among these (both
round after round), and the result."""


def progress(settings: StudySettings, state: State | None) -> dict[str, Any]:
    """As JSON: the `stage` of the next step, the effects `added` so far, and how far the present round is.

    `effects` are screened, of which `candidates` are fitted: `fitted` are ready, `candidate` is next. `p_value` is
    that of the last screening. None for the state: nothing is done yet.
    """
    if state is None:
        return _said("fit", [], 0, [], [], None)
    *before, last = state["rounds"]
    screened = [one for one in (*before, last) if "screening" in one]
    p_value = screened[-1]["screening"]["p_value"] if screened else None
    effects = sum(name not in last["added"] for name in settings.catalogue)
    if finished(state) or "screening" not in last:
        return _said("conclude" if finished(state) else "screen", last["added"], effects, [], [], p_value)
    waiting = [one["effect"] for one in pending(last)]
    shortlist = [*last["candidates"], *waiting]
    return _said("candidates" if waiting else "choose", last["added"], effects, shortlist, waiting, p_value)


def _said(stage: str, added: list[str], effects: int, shortlist: list[str], waiting: list[str],
          p_value: float | None) -> dict[str, Any]:
    return {"stage": stage, "added": list(added), "effects": effects, "candidates": len(shortlist),
            "fitted": len(shortlist) - len(waiting), "candidate": waiting[0] if waiting else None, "p_value": p_value}
