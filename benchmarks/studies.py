"""Whole studies of fixed cases: convergence, the gap, its control, and measured laws beside the hidden ones.

    python -m benchmarks.studies LIST [PROCESSES]

LIST is sixty, elsewhere, fresh, later, further, beyond, outlying, distant, austral, boreal, glacial or solar. `sixty`
is every fourth case of the lists development and final, and `outlying` and those after it every eighth of these lists.
Every finished case is a line of var/studies-LIST.jsonl, so that a killed run goes on where it was.
studies_LIST_cases.csv has the cases, studies_LIST.csv what comes of them.
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from time import perf_counter
from typing import Any

import numpy as np
from numba import set_num_threads

from benchmarks.benches import BENCHES
from benchmarks.hidden_laws import Difference, differences
from benchmarks.naming import FOLDER, joined, recorded
from benchmarks.naming_rates import rate, same
from benchmarks.results import write
from slipstick.confirmation.gap import WITHIN
from slipstick.naming.record import from_json
from slipstick.recordings import Recordings
from slipstick.study import StudySettings, conclude, examine
from tests.validation.hidden import cases
from tests.validation.hidden.truths import truth

CHOSEN = {"sixty": [(which, identity) for which in ("development", "final")
                    for identity in list(cases.LISTS[which])[::4]],
          **{which: [(which, identity) for identity in cases.LISTS[which]]
             for which in ("elsewhere", "fresh", "later", "further", "beyond")},
          **{which: [(which, identity) for identity in list(cases.LISTS[which])[::8]]
             for which in ("outlying", "distant", "austral", "boreal", "glacial", "solar")}}


def one(job: tuple[str, str]) -> dict[str, Any]:
    """The study of a case on one core, beside its truth."""
    set_num_threads(1)
    case = cases.LISTS[job[0]][job[1]]
    known, settings = truth(case, relative=1e-6), StudySettings()
    entry = {"case": job[1], "hidden": [{"pair": its["pair"]} for its in known["hidden"]], "error": ""}
    bench, recordings = BENCHES[known["bench"]], Recordings.open(recorded(*job))
    try:
        began = perf_counter()
        named = examine(settings, bench, recordings)
        between = perf_counter()
        result, _ = conclude(settings, bench, recordings, named)
    except Exception as error:  # a study that raises is a result: a wrong one
        return entry | {"error": repr(error)}
    laws = differences(known, from_json(named).measured, case.setup.parameters)
    return entry | {"naming": between - began, "confirmation": perf_counter() - between, "laws": laws,
                    "result": result.to_dict()}


def row(entry: dict[str, Any]) -> list[object]:
    """A case in the table of all cases."""
    if entry["error"]:
        return [entry["case"], joined(entry["hidden"]), *[""] * 14, entry["error"]]
    result = entry["result"]
    gap = result["gap"]
    time, control = gap and gap["closures"]["shifting_time"], gap and gap["control"]
    laws = [Difference(**its) for its in entry["laws"]]
    return [entry["case"], joined(entry["hidden"]), "+".join(_name(its) for its in result["findings"]),
            result["before"]["converged"], result["after"]["converged"],
            result["after"]["log_likelihood"] - result["before"]["log_likelihood"],
            *(1e3 * time[name] if time else "" for name in ("rms_before", "rms_after", "rms_expected")),
            *(_closure(its and its["closures"][name]) for name in (WITHIN, "shifting_time") for its in (gap, control)),
            "+".join(f"{its.share:.2g}" for its in laws), "+".join(f"{its.held:.2g}" for its in laws),
            round(entry["naming"] + entry["confirmation"], 1), ""]


def _name(finding: dict[str, Any]) -> str:
    return finding["effect"] or f"{finding['quantity']} ~ {finding['depends_on']}"


def _closure(one: dict[str, Any] | None) -> object:
    return "" if not one or one["closure"] is None else round(one["closure"], 2)


def summary(entries: list[dict[str, Any]]) -> list[list[object]]:
    """What comes of all studies."""
    done = [entry for entry in entries if not entry["error"]]
    fits = [entry["result"][name] for entry in done for name in ("before", "after")]
    right = [entry for entry in done if entry["hidden"] and _is_right(entry)]
    gaps = [entry["result"]["gap"] for entry in right if entry["result"]["gap"]]
    controls = [gap["control"] for gap in gaps if gap["control"]]
    laws = [Difference(**its) for entry in done for its in entry["laws"]]
    return [
        rate("studies that raised an error", [bool(entry["error"]) for entry in entries]),
        rate("fits of the simulation that converged", [fit["converged"] for fit in fits]),
        rate("nulls with a gap that is called closed", [entry["result"]["gap"] is not None for entry in done
                                                        if not entry["hidden"]]),
        *(rate(f"{whose}: significant gaps {where} closed by 80 % or more", _closed(those, within))
          for within, where in ((True, "within engagements"), (False, "of a signal or the shifting time"))
          for whose, those in (("right names", gaps), ("their controls", controls))),
        rate("right names: the simulation supports the finding",
             [all(its["confirmation"]["agrees"] for its in entry["result"]["findings"]
                  if its["confirmation"]["agrees"] is not None) for entry in right]),
        rate("right pairs over a number: law within 20 % RMS of its own size", [its.share < 0.2 for its in laws]),
        ["right pairs over a number: mean share of the range in the 90 % band", "", len(laws),
         float(np.mean([its.held for its in laws])) if laws else "", "", ""]]


def _closed(gaps: list[dict[str, Any]], within: bool) -> list[bool]:
    """Whether each significant gap is closed, of those within engagements or of the other ones."""
    return [its["closure"] >= 0.8 for gap in gaps for name, its in gap["closures"].items()
            if its["closure"] is not None and (name == WITHIN) == within]


def _is_right(entry: dict[str, Any]) -> bool:
    hidden = {same(its["pair"]) for its in entry["hidden"]}
    return {same((its["quantity"], its["depends_on"])) for its in entry["result"]["findings"]} == hidden


def main(which: str, processes: int = 2) -> None:
    """Study those cases that have no line yet, and write the tables."""
    lines = FOLDER / f"studies-{which}.jsonl"
    lines.parent.mkdir(exist_ok=True)
    done = {one["case"]: one for one in map(json.loads, lines.read_text().splitlines())} if lines.exists() else {}
    with ProcessPoolExecutor(processes) as pool, lines.open("a") as file:
        for future in as_completed([pool.submit(one, job) for job in CHOSEN[which] if job[1] not in done]):
            entry = future.result()
            done[entry["case"]] = entry
            file.write(json.dumps(entry) + "\n")
            file.flush()
            print(*row(entry), flush=True)
    entries = [done[identity] for _, identity in CHOSEN[which] if identity in done]
    made_by = f"python -m benchmarks.studies {which}"
    write(f"studies_{which}", ("of", "cases", "of all", "share", "lower", "upper"), summary(entries), made_by)
    write(f"studies_{which}_cases", ("case", "hidden", "findings", "converged before", "converged after", "nats",
                            "RMS before [ms]", "RMS after [ms]", "RMS right model [ms]", "closure within",
                            "closure within by control", "closure", "closure by control", "law off by", "share in band",
                            "seconds", "error"), map(row, entries), made_by)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
