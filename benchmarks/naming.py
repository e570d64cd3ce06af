"""What is named in recordings of the hidden benches: answers beside the truth, and how often they are right.

    python -m benchmarks.naming LIST [EVERY [FIRST]] [--again] [--dask ADDRESS]

LIST is one of tests/validation/hidden/cases.py. Two processes, or the workers of a Dask scheduler, each in a copy of
this repository; every finished case is a line of var/naming-LIST.jsonl, so that a killed run goes on where it was.
naming_LIST_cases.csv has the cases, naming_LIST.csv the rates with 95 % bounds, over strengths in units of the naming
limits of naming_limits.py, and docs/naming_LIST.svg draws those of single effects. Limits that the former tables of the
cases has are not computed again. With EVERY, only every so many-th case of the list is answered, from the case FIRST
on, counted from 0; files of a FIRST that is not 0 have the name LIST_from_FIRST. With --again a later version answers a
list: its files have the name LIST_again, and those of the first run, when nothing had been developed on the list,
remain. What the last answers `COUNTED` give is slipstick/study/confidence.json.
"""

import argparse
import csv
import importlib
import json
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

from numba import set_num_threads

from benchmarks.benches import BENCHES
from benchmarks.hidden_laws import differences
from benchmarks.naming_curves import drawn
from benchmarks.naming_limits import Told, told
from benchmarks.naming_rates import alike, findings_of, judged, reported, summary
from benchmarks.results import write
from slipstick.clutch.effects import CATALOGUE
from slipstick.naming.answer import answer
from slipstick.naming.measured import LawPoints
from slipstick.naming.selection import Finding, is_further
from slipstick.naming.study import name
from slipstick.recordings import Recordings
from slipstick.storage.files import replacing
from slipstick.study.confidence import FILE as CONFIDENCE
from slipstick.study.confidence import share_of
from tests.validation.hidden import cases, files
from tests.validation.hidden.truths import truth
from worker.cluster import Cluster
from worker.executors import add_dask_argument, explained

FOLDER = Path("var")
PICTURES = Path(__file__).parents[1] / "docs"
COUNTED = {"polar": ("polar_again",), "austral": ("austral_again",), "boreal": ("boreal_again",),
           "alpine": ("alpine", "alpine_from_2"), "glacial": ("glacial_from_1", "glacial_from_2"),
           "lunar": ("lunar", "lunar_from_1", "lunar_from_2"), "solar": ("solar", "solar_from_1")}
"""The lists whose findings make the confidence, and the files with the last answers to each."""


def one(job: tuple[str, str]) -> dict[str, Any]:
    """Answer a case: hidden pairs, and the findings with their rivals."""
    which, identity = job
    set_num_threads(1)
    case = cases.LISTS[which][identity]
    known = truth(case, relative=1e-6)
    limits = limits_of(which).get(identity) or [told(case, its["name"], alike(its)) for its in known["hidden"]]
    entry = {"case": identity, "bench": known["bench"], "bad": len(known["bad_runs"]),
             "hidden": [{key: its[key] for key in ("name", "pair", "listed", "strength")} | asdict(limit)
                        for its, limit in zip(known["hidden"], limits, strict=True)]}
    try:
        found = name(BENCHES[known["bench"]], Recordings.open(recorded(which, identity)))
    except Exception as error:  # a case that raises is a result: a wrong one
        return entry | {"findings": [], "error": repr(error), "seconds": 0.0, "aside": [], "unexplained": [],
                        "laws": []}
    return entry | {"findings": [{"pair": its.pair, "nats": its.nats, "errors": its.errors, "lead": its.lead,
                                  "rivals": [rival.pair for rival in its.rivals], "effect": answer(its, law).effect,
                                  "further": is_further(its, found.findings),
                                  "share": share_of(its, found.findings), "rare": its.rare,
                                  "left_out": left_out(its, law)}
                                 for its, law in ((its, found.measured.get(its.pair)) for its in found.findings)],
                    "error": "", "seconds": found.seconds, "aside": found.set_aside, "chi_square": found.chi_square,
                    "unexplained": found.lacking,
                    "laws": differences(known, found.measured, case.setup.parameters)}


@cache
def limits_of(which: str) -> dict[str, list[Told]]:
    """The limits of the effects of each case, as far as the tables of a list have them."""
    here, limits = Path(__file__).parent, dict[str, list[Told]]()
    for table in [*here.glob(f"naming_{which}_cases.csv"), *here.glob(f"naming_{which}_from_*_cases.csv")]:
        with table.open() as file:
            limits |= {row["case"]: [Told(float(seen), float(named)) for seen, named in
                                     zip(*(row[limit].replace("e+", "e").split("+") for limit in ("seen", "named")),
                                         strict=True)]
                       for row in csv.DictReader(file) if row["seen"]}
    return limits


def left_out(finding: Finding, law: LawPoints | None) -> str:
    """The effect that a finding is called where the catalogue lacks the one that it would be; empty for unlisted."""
    name = answer(finding, law).effect
    return answer(finding, law, {effect.name for effect in CATALOGUE} - {name}).effect


def recorded(which: str, identity: str) -> Path:
    """The recordings of a case, written where there are none yet."""
    file = FOLDER / "naming" / which / f"{identity}.h5"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        with replacing(file) as part:  # another process may write the same ones
            files.write(part, cases.LISTS[which][identity])
    return file


def main(which: str, every: int = 1, first: int = 0, dask: str | None = None, again: bool = False) -> None:
    """Answer those cases of a list that have no answer yet, and write the tables."""
    chosen = list(cases.LISTS[which])[first::every]
    label = f"{which}{f'_from_{first}' if first else ''}{'_again' if again else ''}"
    lines = FOLDER / f"naming-{label}.jsonl"
    lines.parent.mkdir(exist_ok=True)
    done = {entry["case"]: entry for entry in map(json.loads, lines.read_text().splitlines())} if lines.exists() else {}
    left = [(which, identity) for identity in chosen if identity not in done]
    answer = importlib.import_module("benchmarks.naming").one  # which other processes can import, unlike __main__'s
    executor = Cluster(dask, needs_one_thread=True) if dask else ProcessPoolExecutor(2)
    with executor as pool, lines.open("a") as file, explained():
        for future in as_completed([pool.submit(answer, job) for job in left]):
            entry = future.result()
            done[entry["case"]] = entry
            file.write(json.dumps(entry) + "\n")
            file.flush()
            print(entry["case"], joined(entry["hidden"]), "->", joined(entry["findings"]), round(entry["seconds"]),
                  entry["error"], flush=True)
    entries = [done[identity] for identity in chosen if identity in done]
    made_by = " ".join(["python -m benchmarks.naming", which, *(str(one) for one in (every, first) if every > 1),
                        *(["--again"] if again else [])])
    if label in COUNTED.get(which, ()):
        count(which)
    write(f"naming_{label}", ("rate", "cases", "of", "share", "lower", "upper"), summary(entries, which), made_by)
    answers = [reported(entry, which) for entry in entries]
    rows = [[e["case"], e["bench"], joined(e["hidden"]),
             *("+".join(f"{its[limit]:.2g}" for its in e["hidden"]) for limit in ("seen", "named")),
             joined(e["findings"]), "+".join(str(len(its["rivals"])) for its in e["findings"]),
             "+".join(f"{its['nats']:.0f}" for its in e["findings"]), "+".join(e["unexplained"]), joined(e["unlikely"]),
             len(e["aside"]), e["bad"], round(e["seconds"], 1), e["error"]] for e in answers]
    if not again:
        single = [entry for entry in answers if len(entry["hidden"]) == 1 and entry["hidden"][0]["listed"]]
        title = f"Names of a single listed effect, over its strength ({len(single)} cases, {which})"
        PICTURES.joinpath(f"naming_{label}.svg").write_bytes(
            drawn([entry["hidden"][0]["named"] for entry in single], [judged(entry) for entry in single], title))
    header = ("case", "bench", "hidden", "seen", "named", "findings", "rivals", "nats", "unexplained", "unlikely",
              "set_aside", "bad_runs", "seconds", "error")
    write(f"naming_{label}_cases", header, rows, made_by)


def count(which: str) -> None:
    """Write the findings of a list to the confidence, where all files with answers to it are there."""
    files = [FOLDER / f"naming-{label}.jsonl" for label in COUNTED[which]]
    if not all(file.exists() for file in files):
        return
    counted = {one: rows for one, rows in json.loads(CONFIDENCE.read_text()).items() if one in COUNTED}
    counted[which] = [[round(evidence.lead, 2), int(evidence.alone), int(evidence.further),
                       float(f"{evidence.share:.3g}"), int(evidence.rare), int(is_right)]
                      for file in files for line in file.read_text().splitlines()
                      for evidence, is_right in findings_of(json.loads(line))]
    lists = (f"{json.dumps(its)}: {json.dumps(rows)}" for its, rows in counted.items())
    CONFIDENCE.write_text("{" + ",\n ".join(lists) + "}\n")


def joined(effects: list[dict[str, Any]]) -> str:
    """The pairs of hidden effects or findings."""
    return "+".join(" ~ ".join(its["pair"]) for its in effects)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.naming")
    parser.add_argument("which", choices=cases.LISTS)
    parser.add_argument("every", type=int, nargs="?", default=1)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--again", action="store_true")
    add_dask_argument(parser)
    main(**vars(parser.parse_args()))
