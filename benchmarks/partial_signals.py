"""What a study says of hidden benches where the pressure was not recorded, or nothing but the shifting times.

    python -m benchmarks.partial_signals

All cases of the list `lunar` without an effect, and every sixth one, without the pressure and by shifting times alone.
Every finished case is a line of var/partial-signals.jsonl, so that a killed run goes on where it was.
partial_signals_cases.csv has the cases, partial_signals.csv the rates with 95 % bounds.
"""

import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, replace
from time import perf_counter
from typing import Any

from numba import set_num_threads

from benchmarks.benches import BENCHES
from benchmarks.naming import FOLDER, joined, limits_of, recorded
from benchmarks.naming_rates import block, rate, right_of_any, same
from benchmarks.results import write
from slipstick.clutch import effects
from slipstick.recordings import Recordings
from slipstick.study import StudySettings, conclude, examine
from tests.validation.hidden import cases
from tests.validation.hidden.truths import truth

LIST, EVERY, PROCESSES = "lunar", 6, 2


def _without_pressure(whole: Recordings) -> Recordings:
    assert whole.signals is not None
    return replace(whole, signals=replace(whole.signals, pressure=None))


RECORDED: dict[str, Callable[[Recordings], Recordings]] = {
    "no pressure": _without_pressure, "shifting times": lambda whole: replace(whole, signals=None, further={})}
"""What was recorded, and how it is made of the whole recordings."""
CLOSED = {"valve", "clutch"}
"""Blocks that are not tested without the pressure."""


def one(job: tuple[str, str]) -> dict[str, Any]:
    """The study of a case of which less was `recorded`."""
    identity, what = job
    set_num_threads(1)
    known, settings = truth(cases.LISTS[LIST][identity], relative=1e-6), StudySettings()
    limits = limits_of(LIST).get(identity, [])
    entry = {"case": identity, "recorded": what, "hidden": [
        {key: its[key] for key in ("name", "pair", "listed")} | asdict(limit)
        for its, limit in zip(known["hidden"], limits, strict=True)]}
    bench, recordings = BENCHES[known["bench"]], RECORDED[what](Recordings.open(recorded(LIST, identity)))
    began = perf_counter()
    try:
        result, _ = conclude(settings, bench, recordings, examine(settings, bench, recordings))
    except Exception as error:  # a study that raises is a result: a wrong one
        return entry | {"error": repr(error), "seconds": perf_counter() - began}
    return entry | {"error": "", "seconds": perf_counter() - began, "kind": result.kind, "sentence": result.sentence,
                    "findings": [{"pair": (its.quantity, its.depends_on)} for its in result.findings],
                    "explanations": [asdict(its) for its in result.explanations],
                    "times": [asdict(its) for its in result.times]}


def row(entry: dict[str, Any]) -> list[object]:
    """A case in the table of all cases."""
    hidden = [entry["case"], entry["recorded"], joined(entry["hidden"]),
              "+".join(f"{its['seen']:.2g}" for its in entry["hidden"])]
    if entry["error"]:
        return [*hidden, *[""] * 6, round(entry["seconds"], 1), entry["error"]]
    would = entry["explanations"]
    return [*hidden, entry["kind"], joined(entry["findings"]), would[0]["effect"] if would else "",
            "+".join(its["effect"] for its in would if its["tied"]), would[0]["sufficient"] if would else "",
            "+".join(its["condition"] for its in entry["times"] if its["shown"]), round(entry["seconds"], 1), ""]


def summary(entries: list[dict[str, Any]]) -> list[list[object]]:
    """What comes of all studies."""
    rows = []
    for what in RECORDED:
        some = [entry for entry in entries if entry["recorded"] == what]
        done = [entry for entry in some if not entry["error"]]
        single = [entry for entry in done if len(entry["hidden"]) == 1 and entry["hidden"][0]["seen"] >= 1
                  and (what == "shifting times" or block(entry["hidden"][0]["pair"]) in CLOSED)]
        listed = [entry for entry in single if entry["hidden"][0]["listed"]]
        outside = [entry for entry in single if not entry["hidden"][0]["listed"]]
        rows += [rate(f"{what}: studies that raised an error", [bool(entry["error"]) for entry in some]),
                 rate(f"{what}: nulls called anything", [_says(entry) for entry in done if not entry["hidden"]])]
        for whose, those in (("listed", listed), ("unlisted", outside)):
            told = [entry for entry in those if entry["explanations"]]
            where = f"{what}, {whose} effect where no block was tested"
            rows.append(rate(f"{where}: something is missing", [_says(entry) for entry in those]))
            if whose == "listed":
                rows.append(rate(f"{where}: effects would explain it, the right one is the first, or not told apart",
                                 [_right(entry) for entry in told]))
            rows.append(rate(f"{where}: a wrong effect would explain it alone",
                             [_wrong_alone(entry) for entry in those]))
    return rows


def _says(entry: dict[str, Any]) -> bool:
    return str(entry["kind"]) != "none"


def _first(entry: dict[str, Any]) -> list[str]:
    """The effect that gains most, and those that are not told apart from it."""
    return [its["effect"] for place, its in enumerate(entry["explanations"]) if place == 0 or its["tied"]]


def _is_right(name: str, entry: dict[str, Any]) -> bool:
    return bool({same(pair) for pair in effects.find(name).pairs} & right_of_any(entry))


def _right(entry: dict[str, Any]) -> bool:
    return any(_is_right(name, entry) for name in _first(entry))


def _wrong_alone(entry: dict[str, Any]) -> bool:
    first = _first(entry)
    return len(first) == 1 and entry["explanations"][0]["sufficient"] and not _is_right(first[0], entry)


def main() -> None:
    """Study those cases that have no line yet, and write the tables."""
    lines = FOLDER / "partial-signals.jsonl"
    lines.parent.mkdir(exist_ok=True)
    done = [json.loads(line) for line in lines.read_text().splitlines()] if lines.exists() else []
    known = {(entry["case"], entry["recorded"]) for entry in done}
    every = cases.LISTS[LIST]
    without = [identity for identity, case in every.items() if not case.effects]
    chosen = dict.fromkeys([*without, *list(every)[::EVERY]])
    jobs = [(identity, what) for identity in chosen for what in RECORDED]
    with ProcessPoolExecutor(PROCESSES) as pool, lines.open("a") as file:
        for future in as_completed([pool.submit(one, job) for job in jobs if job not in known]):
            entry = future.result()
            done.append(entry)
            file.write(json.dumps(entry) + "\n")
            file.flush()
            print(*row(entry), flush=True)
    done.sort(key=lambda entry: jobs.index((entry["case"], entry["recorded"])))
    made_by = "python -m benchmarks.partial_signals"
    write("partial_signals", ("of", "cases", "of all", "share", "lower", "upper"), summary(done), made_by)
    write("partial_signals_cases", ("case", "recorded", "hidden", "seen", "kind", "findings", "would explain it",
                                    "not told apart", "sufficient", "shifting times over", "seconds", "error"),
          map(row, done), made_by)


if __name__ == "__main__":
    main()
