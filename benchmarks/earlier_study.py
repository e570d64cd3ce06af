"""The study by score tests, and a one-shot regression, on every eighth final case of hidden effects.

    python -m benchmarks.earlier_study

writes earlier_study.csv. Each finished case is a line of var/earlier-study.jsonl, so that a killed run goes on where it
was; entries are those of `benchmarks.naming`, for comparison by the same rules.
"""

import json
import time
from pathlib import Path
from typing import Any

from benchmarks.benches import BENCHES
from benchmarks.naming import joined, multiple
from benchmarks.results import write
from benchmarks.study_blind import regression
from slipstick.clutch import effects
from slipstick.recordings import Recordings
from slipstick.study import comparison, conclusion, study
from slipstick.study.settings import StudySettings
from tests.validation.hidden import cases, files
from tests.validation.hidden.truths import truth

FILE = Path("var/earlier-study.jsonl")
EVERY = 8


def answered(identity: str) -> dict[str, Any]:
    """Study a case with default settings; names are told as pairs of quantity and dependence."""
    case, file = cases.FINAL[identity], FILE.parent / f"{identity}.h5"
    if not file.exists():
        files.write(file, case)
    known = truth(case, relative=1e-6)
    entry = {"case": identity, "bench": known["bench"], "bad": len(known["bad_runs"]),
             "hidden": [{key: its[key] for key in ("name", "pair", "listed", "strength", "typical", "limit")}
                        for its in known["hidden"]]}
    began, settings = time.perf_counter(), StudySettings()
    try:
        compared = comparison.compare(BENCHES[known["bench"]], Recordings.open(file), settings.shifting_time_noise)
        state = study.start(settings, compared)
        while not study.finished(state):
            state = study.advance(settings, compared, state)
        answer = conclusion.conclude(settings, compared, state)["answer"]
        named = regression(settings, compared, state)["effect"]
    except Exception as error:  # a case that raises is a result: a wrong one
        return entry | {"kind": "", "findings": [], "regression": [], "clear": False, "error": repr(error),
                        "seconds": time.perf_counter() - began}
    findings = [{"pair": pair(effect), "rivals": [pair(other) for other in tied if other != effect]}
                for effect, tied in zip(answer["effects"], answer["tied"] or [[]] * 9, strict=False)]
    if answer["kind"] == "unlisted" and not findings:
        findings = [{"pair": (answer["block"] or "", ""), "rivals": []}]
    return entry | {"kind": answer["kind"], "findings": findings, "error": "",
                    "clear": bool(answer["confidence"] and answer["confidence"] >= 0.9),
                    "regression": [{"pair": pair(named), "rivals": []}] if named else [],
                    "seconds": time.perf_counter() - began}


def pair(name: str) -> tuple[str, str]:
    """What an effect changes, and what that depends on."""
    effect = effects.find(name)
    return effect.quantity, effect.depends_on or ""


def main() -> None:
    """Answer what has no answer yet."""
    FILE.parent.mkdir(exist_ok=True)
    done = {json.loads(line)["case"] for line in FILE.read_text().splitlines()} if FILE.exists() else set()
    with FILE.open("a") as file:
        for identity in [one for one in list(cases.FINAL)[::EVERY] if one not in done]:
            file.write(json.dumps(answered(identity)) + "\n")
            file.flush()
    entries = [json.loads(line) for line in FILE.read_text().splitlines()]
    write("earlier_study", ("case", "bench", "hidden", "limits", "kind", "findings", "clear", "regression", "seconds"),
          [[one["case"], one["bench"], joined(one["hidden"]),
            "+".join(f"{multiple(its):.2g}" for its in one["hidden"]), one["kind"], joined(one["findings"]),
            one["clear"], joined(one["regression"]), round(one["seconds"])] for one in entries],
          "python -m benchmarks.earlier_study")


if __name__ == "__main__":
    main()
